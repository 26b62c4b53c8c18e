/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * line.h - the open chain of rods that begins at a wall.
 *
 * Rods 0, 1, ... from the wall on, rod j at distance sigma/2 + j sigma + t from it, 0 <= t <= ell:
 *
 *   A_0(t) = 1,   A_{j+1}(t) = int_0^t f(t - s) w_j(s) A_j(s) ds
 *
 * w_j(s) = Boltzmann factor of rod j there, f the neighbours' (Baxter's delta function included).
 * w_j A_j is the weight of rod j at s, all rods between it and the wall anywhere. From the other
 * wall the same with x mirrored. A_j is kept at the nodes of Gauss-Legendre panels, which end where
 * the bump of f makes A_j not smooth: at multiples of its reach. The last panel ends at ell. */
#ifndef THEORY_LINE_H
#define THEORY_LINE_H

#include "tools.h"

enum { LINE_RULE = 16 };

struct line_tables {
    const struct model *model;
    double width; /* of every panel but the last */
    size_t panels, nodes, reach_panels;
    double node[LINE_RULE], weight[LINE_RULE], barycentric[LINE_RULE];
    double below[LINE_RULE][LINE_RULE]; /* integrals of cardinal functions up to node tau */
    double *place;                      /* [nodes] t */
    double *bump, *bump_end; /* [1 + reach_panels][RULE][RULE], NULL: none */
};

struct line {
    const struct line_tables *tables;
    bool mirrored;
    int64_t rod;     /* j */
    double *value;   /* [nodes] A_j, up to a factor */
    double *product; /* [nodes] w_{j-1} A_{j-1} of the step before, the same factor as value had */
    double scale;    /* value is what that product gives, over scale */
};

/* Panels of at most this width. BCD_NO_MEMORY only. */
enum bcd_status line_tables_init(struct line_tables *tables, const struct model *model,
                                 double width, struct scratch *scratch);
/* How many panels they will be; operations of one step. */
double line_panels(const struct model *model, double width);
double line_cost(const struct model *model, double width);

/* Rod 0. */
enum bcd_status line_init(struct line *line, const struct line_tables *tables, bool mirrored,
                          struct scratch *scratch);
/* On to the next rod; the largest value becomes 1. */
void line_step(struct line *line);
/* product = w_j A_j, for the rod that the line has come to; line_step does it itself. */
void line_multiply(struct line *line);

double line_edge(const struct line_tables *tables, size_t panel); /* its lower end */
size_t line_panel(const struct line_tables *tables, double t);
/* Values at the nodes, interpolated. */
double line_at(const struct line_tables *tables, const double *values, double t);
/* Shares of a panel's nodes in the value at u, -1 <= u <= 1. */
void line_cardinal(const struct line_tables *tables, double u, double share[LINE_RULE]);

/* Boltzmann factor of the rod-th rod from the left wall at reduced place y in [0, ell]. */
double line_weight(const struct model *model, int64_t rod, double y);

#endif
