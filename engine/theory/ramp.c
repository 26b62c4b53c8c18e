/* SPDX-License-Identifier: GPL-3.0-or-later
 * ramp.c - see ramp.h. */
#include <math.h>
#include <stddef.h>

#include "ramp.h"

static double in_cell(const struct ramp *ramp, size_t k, double t, double width)
{
    double a = ramp->value[k], b = ramp->value[k + 1];
    double u = ramp->slope[k] * width, v = ramp->slope[k + 1] * width;
    return a + t * (u + t * (3 * (b - a) - 2 * u - v + t * (u + v - 2 * (b - a))));
}

double ramp_at(const struct ramp *ramp, double period, double x)
{
    double place = x / period, whole = floor(place);
    place = (place - whole) * RAMP_POINTS;
    size_t k = place < RAMP_POINTS ? (size_t)place : RAMP_POINTS - 1;
    return whole * ramp->rise + in_cell(ramp, k, place - (double)k, period / RAMP_POINTS);
}

/* Bisection over the cells, regula falsi (Illinois) within. */
double ramp_inverse(const struct ramp *ramp, double period, double target)
{
    double whole = floor((target - ramp->value[0]) / ramp->rise), width = period / RAMP_POINTS;
    target -= whole * ramp->rise;
    size_t low = 0, high = RAMP_POINTS;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (ramp->value[middle] <= target) {
            low = middle;
        } else {
            high = middle;
        }
    }
    double a = 0, b = 1, fa = ramp->value[low] - target, fb = ramp->value[low + 1] - target;
    for (int turn = 0; turn < 60 && fb - fa > 0 && b - a > 1e-12; turn++) {
        double t = a - fa * (b - a) / (fb - fa);
        t = t > a && t < b ? t : (a + b) / 2;
        double f = in_cell(ramp, low, t, width) - target;
        if (fabs(f) < 1e-14 * ramp->rise) {
            a = t;
            break;
        }
        if (f < 0) {
            a = t;
            fa = f;
            fb /= 2;
        } else {
            b = t;
            fb = f;
            fa /= 2;
        }
    }
    return (whole + ((double)low + a) / RAMP_POINTS) * period;
}
