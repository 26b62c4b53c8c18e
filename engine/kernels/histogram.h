/* SPDX-License-Identifier: GPL-3.0-or-later
 * histogram.h - where in a period the rods are: x_i = y_i + i * diameter, folded into [0,
 * period); or where between two walls, [0, length]. */
#ifndef KERNELS_HISTOGRAM_H
#define KERNELS_HISTOGRAM_H

#include <stdbool.h>
#include <stdint.h>

struct fold {
    double inverse_period;
    int64_t bins; /* over one period; at most 2^31 - 1 */
    bool walls;   /* nothing is folded: the last bin includes its end, x = period */
};

/* The bin of one position. */
int64_t fold_bin(const struct fold *fold, double x);

/* counts[fold_bin(x_i)] += 1, i = 0 .. n-1. */
void histogram_add(int64_t *counts, const struct fold *fold, const double *y, int64_t n,
                   double diameter);

#endif
