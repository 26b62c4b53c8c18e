/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * attraction.h - attraction of two rods at a gap, doi 10.1103/PhysRevE.106.054606 Eq. 32: the
 * excess of exp(-V/kT) over 1 is deep * u^p, u = 1 - gap / range, deep = gamma (p + 1) / range.
 */
#ifndef KERNELS_ATTRACTION_H
#define KERNELS_ATTRACTION_H

#include "elementary.h"

struct attraction {
    double range, inverse_range, exponent;
    double deep, steep; /* steep = deep * p / range */
    int whole;          /* p - 1 where that is a small whole number, for products; else -1 */
};

static inline struct attraction attraction_make(double strength, double range, double exponent)
{
    enum { WHOLE_MAX = 15 };
    double deep = strength * (exponent + 1) / range;
    return (struct attraction){
        .range = range,
        .inverse_range = 1 / range,
        .exponent = exponent,
        .deep = deep,
        .steep = deep * exponent / range,
        .whole = exponent <= WHOLE_MAX && exponent == round_whole(exponent) ? (int)exponent - 1
                                                                             : -1,
    };
}

static inline double attraction_power(const struct attraction *a, double u)
{
    if (a->whole < 0)
        return power(u, a->exponent - 1);
    double result = 1, square = u;
    for (int left = a->whole; left > 0; left >>= 1, square *= square)
        result = left & 1 ? result * square : result;
    return result;
}

/* dV/dg / kT at gap >= 0. */
static inline double attraction_at(const struct attraction *a, double gap)
{
    double u = 1 - gap * a->inverse_range;
    if (u < 1e-300)
        return 0;
    double below = attraction_power(a, u);
    return a->steep * below / (1 + a->deep * below * u);
}

#endif
