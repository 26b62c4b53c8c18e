/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * spline.h - cubic splines over equidistant points: tabulated energies with a continuous force.
 */
#ifndef KERNELS_SPLINE_H
#define KERNELS_SPLINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Value at x = from + (k + t) * step, 0 <= t < 1:  c[4k] + t (c[4k+1] + t (c[4k+2] + t c[4k+3])).
 */
struct spline {
    double from, step;
    size_t pieces;
    double *c; /* [4 * pieces], malloc'ed; NULL = none */
    bool periodic;
};

/* Through values[i] at from + i * step, i = 0 .. count-1; count >= 3. Periodic: over count pieces,
 * back to values[0] at from + count * step, with continuous second derivative. Not periodic: over
 * count - 1 pieces, not-a-knot at both ends (count >= 4). False = no memory. */
bool spline_periodic(struct spline *spline, double from, double step, const double *values,
                     size_t count);
bool spline_open(struct spline *spline, double from, double step, const double *values,
                 size_t count);
void spline_free(struct spline *spline); /* may be zeroed memory */

/* One point; beyond the ends a periodic one repeats, an open one goes on with its last piece.
 * derivative 0, 1, 2. */
double spline_at(const struct spline *spline, double x, int derivative);

/* Many points x[i] = y[i] + (first + i) * diameter, or y[i] + offset[i], i = 0 .. count-1. */
struct spline_points {
    const double *y;
    int64_t count;
    double diameter;
    const double *offset; /* NULL = none; not for sums, */
    int64_t first;        /* nor is this */
};

/* out[i] += scale * first derivative at x[i]; out may be y. */
void spline_add_slope(const struct spline *spline, const struct spline_points *points, double scale,
                      double *out);

/* Sum of the values at x[i], in a fixed order of eight partial sums. */
double spline_sum(const struct spline *spline, const struct spline_points *points);

/* Largest |second derivative|, exact: it is linear on every piece. */
double spline_curvature_max(const struct spline *spline);

#endif
