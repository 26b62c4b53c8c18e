/* SPDX-License-Identifier: GPL-3.0-or-later
 * rods.c - see rods.h. */
#include "rods.h"
#include "simd.h"

KERNEL_CLONES
void rods_add(double *restrict out, const double *restrict x, double scale, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        out[i] += scale * x[i];
}

KERNEL_CLONES
void rods_take(double *restrict out, double *restrict x, int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        out[i] += x[i];
        x[i] = 0;
    }
}

KERNEL_CLONES
void rods_shift(double *y, double by, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        y[i] += by;
}
