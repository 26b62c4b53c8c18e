/* SPDX-License-Identifier: GPL-3.0-or-later
 * sums.c - see sums.h. */
#include "sums.h"
#include "simd.h"

enum { LANES = 8 };

static inline double total(const double *sum)
{
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

KERNEL_CLONES
double sum_squared_displacement(const double *y, const double *from, int64_t n, double shift)
{
    double sum[LANES] = {0};
    int64_t whole = n - n % LANES;
    for (int64_t i = 0; i < whole; i += LANES)
        for (int j = 0; j < LANES; j++) {
            double d = y[i + j] - from[i + j] + shift;
            sum[j] += d * d;
        }
    for (int64_t i = whole; i < n; i++) {
        double d = y[i] - from[i] + shift;
        sum[i - whole] += d * d;
    }
    return total(sum);
}

KERNEL_CLONES
double sum_plain(const double *y, int64_t n)
{
    double sum[LANES] = {0};
    int64_t whole = n - n % LANES;
    for (int64_t i = 0; i < whole; i += LANES)
        for (int j = 0; j < LANES; j++)
            sum[j] += y[i + j];
    for (int64_t i = whole; i < n; i++)
        sum[i - whole] += y[i];
    return total(sum);
}
