/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * transfer.h - the transfer operator of the chain of nearest neighbours.
 *
 *   (K_s psi)(x) = int_0^inf f(g) e^{-s g} w(x + sigma + g) psi(x + sigma + g) dg,  w = exp(-U/kT)
 *
 * adds a rod to the right of one at x, at reduced pressure s = P/kT. On functions with the period
 * of U it is a convolution after a multiplication: diagonal in Fourier space but for w. Hence no
 * kink or step of f ever meets the grid; with w smooth everything converges faster than any power
 * of the number of points.
 *
 * Infinite system: K_p phi = lambda phi and chi K_p = lambda chi (leading, positive) with p such
 * that the mean gap, -d ln(lambda)/dp, is the wanted one. "left" below is the left eigenvector of
 * the matrix, w included; right * left is the density of rods, up to a factor.
 *
 * Averages of one gap, seen from the rod on its left at x, replace the K of that gap by one with
 * another measure in place of f(g) dg: a delta function at 0, a window, a bin. */
#ifndef THEORY_TRANSFER_H
#define THEORY_TRANSFER_H

#include "tools.h"

struct transfer {
    const struct model *model;
    struct grid grid;
    struct measure all;          /* f(g) dg */
    double p, lambda;            /* reduced pressure; leading eigenvalue */
    double gap_variance;         /* -d(mean gap)/dp: variance of a gap, correlations included */
    double *right, *left;        /* [n], positive, sum of right * left = 1 */
    double *matrix, *work, *sum; /* [n][n], [n], [2n] */
    size_t *pivot;
    double complex *mode, *complex_column; /* [n] */
};

/* Solves for p at the model's mean gap, on n points. */
enum bcd_status transfer_init(struct transfer *transfer, const struct model *model,
                              struct scratch *scratch, size_t n, struct bcd_error *error);

/* Column of the circulant of a measure at s, without lambda: transfer->complex_column. */
void transfer_column(struct transfer *transfer, const struct measure *measure, double complex s);

/* Factor of mode number `mode` (not necessarily whole) that fades out the modes towards the edge of
 * the grid. Cut off sharply, the modes of a narrow interaction, still large there, would make up
 * growing eigenvectors of their own. */
double transfer_fade(const struct grid *grid, double mode);

/* Highest wave number of the grid. */
double transfer_wave_number(const struct model *model, size_t n);

/* Profiles at the grid's points, summed over contributions. */
struct profile {
    double *density, *contact, *window, *bond; /* [n]; window NULL when not wanted */
    double *gap;                               /* [gap_bins]; */
};

/* Measures of one gap. contact and window consist of points alone; for these the shifts of the grid
 * by sigma + g, which do not depend on s, are kept: column[point][0 .. 2n-1] so that column[n + i -
 * j] takes x_j to x_i + sigma + g, and w there, weight_there[point][i]. */
struct shifts {
    double *column, *weight_there; /* [count][2n], [count][n] */
};
struct functionals {
    struct measure contact, window, bond;
    struct shifts contact_shifts, window_shifts;
    struct measure *gap; /* [gap_bins] */
};
enum bcd_status functionals_init(struct functionals *functionals, const struct model *model,
                                 const struct grid *grid, struct scratch *scratch);
enum bcd_status profile_init(struct profile *profile, const struct model *model,
                             struct scratch *scratch, size_t n);

/* Adds Re(factor * (operator of each measure, over lambda, times rest)_ii). rest is the chain of
 * the other gaps: rest_ji leads from x_j on to x_i. */
struct contribution {
    struct transfer *transfer;
    const struct functionals *functionals;
    const struct matrix *rest;
    double complex s, factor;
};
void profile_add(struct profile *profile, const struct contribution *contribution,
                 struct scratch *scratch);

/* Normalises to the mean density and turns profiles into the wanted bin means. */
enum bcd_status profile_finish(struct theory_result *result, const struct profile *profile,
                               const struct model *model, const struct grid *grid,
                               struct scratch *scratch);

#endif
