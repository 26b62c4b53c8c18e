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

/* out[i] += x[i], which is 0 afterwards. */
void rods_take(double *restrict out, double *restrict x, int64_t n);

/* y[i] += by. */
void rods_shift(double *y, double by, int64_t n);

#endif
