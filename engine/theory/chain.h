/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * chain.h - open chains of rods, one rod at a time, in real space.
 *
 * E_j(x, g) is the weight of all ways to put j rods to the right of one at x, the j-th of them at
 * x + j sigma + g: the interactions f of all j gaps, the factors w of the rods between, neither
 * that of the first nor that of the last.
 *
 *   E_1 = f,   E_{j+1}(x, g) = int_0^g E_j(x, g') w(x + j sigma + g') f(g - g') dg'
 *
 * E_j is a function on Gauss-Legendre panels of g, for every point x of a grid, plus a delta
 * function at g = 0 in Baxter's limit. Values are divided by lambda^j to keep them within range. */
#ifndef THEORY_CHAIN_H
#define THEORY_CHAIN_H

#include "tools.h"

enum { CHAIN_RULE = 16 };

struct chain {
    const struct model *model;
    const struct grid *grid;
    double lambda, width, last; /* width of a panel; largest g */
    size_t panels, per_period;  /* per_period: panels of one period; 0: panels do not divide it */
    int64_t rods;               /* j */
    double *value;              /* [panels * CHAIN_RULE][n], at rising g */
    double *delta;              /* [n] */
    double *product, *table, *running; /* work */
    double node[CHAIN_RULE], weight[CHAIN_RULE], barycentric[CHAIN_RULE];
    double below[CHAIN_RULE][CHAIN_RULE]; /* integral of cardinal function nu up to node tau */
    size_t reach_panels;                  /* q: panels within the reach of the bump */
    double *bump; /* [q + 1][RULE][RULE]: bump folded with cardinal functions d panels back */
};

/* j = 1 on g in [0, last]. points: grid points per period that the panels go with; the grid itself
 * may have others. */
struct chain_args {
    const struct model *model;
    const struct grid *grid; /* n and x are used */
    size_t points;
    double lambda, last;
    const struct chain
        *like; /* one of the same model, points and last, to share tables with; or NULL */
};
enum bcd_status chain_init(struct chain *chain, const struct chain_args *args,
                           struct scratch *scratch);
/* Number of nodes, and a rough count of operations for one step of one x. */
double chain_nodes(const struct model *model, size_t points, double last);
double chain_cost(const struct model *model, size_t points, double last);

void chain_step(struct chain *chain);

/* Values of the rule's cardinal functions at t in [-1, 1]. */
void chain_cardinal(const struct chain *chain, double t, double value[CHAIN_RULE]);

/* E_j(x_i, g) / lambda^j without delta function, for all i. */
void chain_value(const struct chain *chain, double gap, double *out);
/* The same from an array kept of an earlier j = rods. */
void chain_kept_value(const struct chain *chain, const double *value, int64_t rods, double gap,
                      double *out);

#endif
