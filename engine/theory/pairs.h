/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * pairs.h - pair distribution: an open chain from x to x + r (chain.h), closed by the rest.
 *
 *   density of pairs at distance r = sum_j mean over x of w(x) E_j(x, r - j sigma) w(x + r) rest_j
 *
 * The rest, N - j gaps from x + r round the ring back to x, is smooth in r and tabulated at
 * multiples of the grid's spacing; values between come from 16-point interpolation. */
#ifndef THEORY_PAIRS_H
#define THEORY_PAIRS_H

#include "transfer.h"

enum { PAIRS_MARGIN = 8 };

/* Values kept for every theta, and values added up for all bins: seconds of them. */
#define PAIRS_TABLE_MAX 3e7
#define PAIRS_JOINS_MAX 3e7

struct pairs {
    const struct transfer *transfer;
    size_t terms, most; /* rods j that are counted; that could be */
    size_t steps;       /* of r: -MARGIN .. steps - MARGIN - 1 */
    double *rest;       /* [terms][steps][n] */
};

/* terms = 0 when no pair distribution is wanted. */
enum bcd_status pairs_init(struct pairs *pairs, const struct transfer *transfer,
                           struct scratch *scratch, struct bcd_error *error);
/* Adds Re(factor * rest), rest = scaled K^(N-j); c->factor includes exp(s ell), c->s = p + i
 * theta/P. */
void pairs_add(struct pairs *pairs, size_t j, const struct contribution *c);
/* norm: sum of the density profile before normalisation. */
enum bcd_status pairs_finish(struct theory_result *result, const struct pairs *pairs, double norm,
                             struct scratch *scratch, struct bcd_error *error);

/* Quadrature of one bin for the term j: breaks where the chain of j rods has them. */
struct bin_points {
    size_t count;
    double *r, *weight; /* [capacity] */
    size_t capacity;
};
enum bcd_status bin_points_init(struct bin_points *points, const struct model *model, size_t n,
                                struct scratch *scratch);
void bin_points_set(struct bin_points *points, const struct model *model, size_t j, size_t bin);
/* Bin of r = j sigma; a bin includes its lower end, up to rounding. pair_bins when beyond. */
size_t bin_of_contact(const struct model *model, size_t j);

#endif
