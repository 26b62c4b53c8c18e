/* SPDX-License-Identifier: GPL-3.0-or-later
 * order.h - are rods in order? Eight pairs of neighbours at a time, without a branch between. */
#ifndef KERNELS_ORDER_H
#define KERNELS_ORDER_H

#include <stdbool.h>
#include <stdint.h>
#ifdef __x86_64__
#include <emmintrin.h>
#endif

/* Bit j: y[j] >= y[j+1], j = 0 .. 7. */
static inline unsigned order_met(const double *y)
{
    unsigned bits = 0;
#ifdef __x86_64__
    for (int j = 0; j < 8; j += 2) {
        __m128d here = _mm_loadu_pd(y + j), right = _mm_loadu_pd(y + j + 1);
        bits |= (unsigned)_mm_movemask_pd(_mm_cmpge_pd(here, right)) << j;
    }
#else
    for (int j = 0; j < 8; j++)
        bits |= (unsigned)(y[j] >= y[j + 1]) << j;
#endif
    return bits;
}

/* Bit i: rod i is beyond its right neighbour, y[i] > y[i+1], i = 0 .. n-2 <= 63. */
static inline uint64_t order_crossed(const double *y, int64_t n)
{
    uint64_t bits = 0;
    int64_t i = 0;
#ifdef __x86_64__
    for (; i + 2 < n; i += 2) {
        __m128d here = _mm_loadu_pd(y + i), right = _mm_loadu_pd(y + i + 1);
        bits |= (uint64_t)(unsigned)_mm_movemask_pd(_mm_cmpgt_pd(here, right)) << i;
    }
#endif
    for (; i + 1 < n; i++)
        bits |= (uint64_t)(y[i] > y[i + 1]) << i;
    return bits;
}

/* No rod beyond its right neighbour: y[i] <= y[i+1], i = 0 .. n-2. */
static inline bool order_kept(const double *y, int64_t n)
{
    int64_t i = 0;
#ifdef __x86_64__
    for (; i + 2 < n; i += 2)
        if (_mm_movemask_pd(_mm_cmpgt_pd(_mm_loadu_pd(y + i), _mm_loadu_pd(y + i + 1))))
            return false;
#endif
    for (; i + 1 < n; i++)
        if (y[i] > y[i + 1])
            return false;
    return true;
}

#endif
