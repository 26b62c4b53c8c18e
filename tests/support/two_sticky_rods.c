/* SPDX-License-Identifier: GPL-3.0-or-later
 * two_sticky_rods.c - see two_sticky_rods.h. */
#include "support/two_sticky_rods.h"

#include <math.h>

/* 0 at a mode: sin(ka) gamma k = cos(ka) (1 - l gamma k^2), in turns of which each holds one. */
static double off_mode(double k, double gamma, double a, double l)
{
    return sin(k * a) * gamma * k - cos(k * a) * (1 - l * gamma * k * k);
}

double two_sticky_rods_msd(double gamma, double ell, double time, double resistance)
{
    const double a = ell / 2, scan = M_PI / a / 200;
    double sum = 0, before = off_mode(1e-9, gamma, a, resistance);
    for (int i = 1; i <= 200 * 200; i++) {
        double low = scan * (i - 1), high = scan * i, now = off_mode(high, gamma, a, resistance);
        if ((now < 0) != (before < 0)) {
            for (int j = 0; j < 60; j++) {
                double k = (low + high) / 2;
                if ((off_mode(k, gamma, a, resistance) < 0) == (before < 0))
                    low = k;
                else
                    high = k;
            }
            double k = low, bond = cos(k * a) / (gamma * k);
            double overlap = 2 * (sin(k * a) / (k * k) - a * cos(k * a) / k) + 2 * gamma * a * bond;
            double norm = a - sin(2 * k * a) / (2 * k) + 2 * gamma * bond * bond;
            sum += overlap * overlap / norm / (ell + 2 * gamma) * (1 - exp(-2 * k * k * time));
        }
        before = now;
    }
    return time + sum / 2;
}
