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
void rods_kick(double *restrict y, double *restrict kick, const double *restrict x, double scale,
               int64_t n)
{
    for (int64_t i = 0; i < n && !x; i++) {
        y[i] += kick[i];
        kick[i] = 0;
    }
    for (int64_t i = 0; i < n && x; i++) {
        double next = 0 + scale * x[i];
        y[i] = (y[i] + kick[i]) + next;
        kick[i] = next;
    }
}

KERNEL_CLONES
void rods_shift(double *y, double by, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        y[i] += by;
}
