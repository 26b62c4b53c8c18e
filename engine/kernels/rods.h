/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * rods.h - numbers of all rods, one by one. In vectors as wide as those of the other kernels: what
 * one has stored in narrow pieces another reads only after a wait.
 */
#ifndef KERNELS_RODS_H
#define KERNELS_RODS_H

#include <stdint.h>

/* out[i] += scale * x[i], i = 0 .. n-1. */
void rods_add(double *restrict out, const double *restrict x, double scale, int64_t n);

/* y[i] += kick[i], which is scale * x[i] from then on, and once more: the second half of one kick
 * and the first of the next. x = NULL: the kick is 0 from then on. */
void rods_kick(double *restrict y, double *restrict kick, const double *restrict x, double scale,
               int64_t n);

/* The lowest and the highest of them; INFINITY and -INFINITY of none. */
struct rods_range {
    double low, high;
};
struct rods_range rods_range(const double *y, int64_t n);

/* y[i] += by. */
void rods_shift(double *y, double by, int64_t n);

#endif
