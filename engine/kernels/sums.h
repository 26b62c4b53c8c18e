/* SPDX-License-Identifier: GPL-3.0-or-later
 * sums.h - reductions over rods in a fixed order: eight partial sums, then pairs of them. */
#ifndef KERNELS_SUMS_H
#define KERNELS_SUMS_H

#include <stdint.h>

/* Sum of (y[i] - from[i] + shift)^2, i = 0 .. n-1. */
double sum_squared_displacement(const double *y, const double *from, int64_t n, double shift);

/* Sum of y[i]. */
double sum_plain(const double *y, int64_t n);

#endif
