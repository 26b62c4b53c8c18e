/* SPDX-License-Identifier: GPL-3.0-or-later
 * ramp.h - a rising function with F(x + period) = F(x) + rise, in a table, to be inverted. */
#ifndef THEORY_RAMP_H
#define THEORY_RAMP_H

enum { RAMP_POINTS = 8192 };

struct ramp {
    double value[RAMP_POINTS + 1], slope[RAMP_POINTS + 1]; /* at multiples of period/RAMP_POINTS */
    double rise;
};

/* Cubic between the points. */
double ramp_at(const struct ramp *ramp, double period, double x);
double ramp_inverse(const struct ramp *ramp, double period, double target);

#endif
