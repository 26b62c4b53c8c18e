/* SPDX-License-Identifier: GPL-3.0-or-later
 * rods.c - see rods.h. */
#include "rods.h"
#include "simd.h"

#include <math.h>

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
struct rods_range rods_range(const double *y, int64_t n)
{
    enum { LANES = 16 };
    double low[LANES], high[LANES];
    const int64_t whole = n - n % LANES;
    for (int j = 0; j < LANES; j++) {
        low[j] = INFINITY;
        high[j] = -INFINITY;
    }
    for (int64_t i = 0; i < whole; i += LANES)
        for (int j = 0; j < LANES; j++) {
            low[j] = y[i + j] < low[j] ? y[i + j] : low[j];
            high[j] = y[i + j] > high[j] ? y[i + j] : high[j];
        }
    struct rods_range range = {INFINITY, -INFINITY};
    for (int j = 0; j < LANES; j++) {
        range.low = low[j] < range.low ? low[j] : range.low;
        range.high = high[j] > range.high ? high[j] : range.high;
    }
    for (int64_t i = whole; i < n; i++) {
        range.low = y[i] < range.low ? y[i] : range.low;
        range.high = y[i] > range.high ? y[i] : range.high;
    }
    return range;
}

KERNEL_CLONES
void rods_shift(double *y, double by, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        y[i] += by;
}
