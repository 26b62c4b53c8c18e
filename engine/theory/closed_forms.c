/* SPDX-License-Identifier: GPL-3.0-or-later
 * closed_forms.c - Tonks gas, zero-noise flow, two rods (closed_forms.h). */
#include <math.h>

#include "closed_forms.h"
#include "tools.h"

static bool is_gas(double density, double diameter)
{
    return density > 0 && diameter >= 0 && density * diameter < 1;
}

double tonks_pressure(double density, double diameter, double kT)
{
    return is_gas(density, diameter) ? kT * density / (1 - density * diameter) : NAN;
}

double tonks_contact(double density, double diameter)
{
    return is_gas(density, diameter) ? density * density / (1 - density * diameter) : NAN;
}

double tonks_pair(double density, double diameter, double r)
{
    if (!is_gas(density, diameter) || !(r >= 0)) {
        return NAN;
    }
    if (diameter == 0) {
        return 1;
    }
    double p = density / (1 - density * diameter), sum = 0;
    for (double j = 1; j * diameter <= r; j++) {
        double z = p * (r - j * diameter);
        /* z = 0 with j = 1 is contact: z^0 = 1. */
        sum += j == 1 ? exp(-z) : z > 0 ? exp((j - 1) * log(z) - z - lgamma(j)) : 0;
    }
    return sum * p / density;
}

double tonks_pair_ring(int64_t particles, double length, double diameter, double r)
{
    double n = (double)particles, ell = length - n * diameter;
    if (particles < 1 || !(diameter >= 0) || !(ell > 0) || !(r >= 0 && r <= length)) {
        return NAN;
    }
    if (diameter == 0) {
        return 1 - 1 / n;
    }
    /* The sum of j of N gaps has the density of ell times a Beta(j, N - j) variable. */
    double sum = 0;
    for (double j = 1; j < n && j * diameter <= r; j++) {
        double u = (r - j * diameter) / ell;
        if (u > 1) {
            continue;
        }
        double left = j == 1 ? 0 : (j - 1) * log(u);
        double right = j == n - 1 ? 0 : (n - j - 1) * log1p(-u);
        sum += exp(left + right + lgamma(n) - lgamma(j) - lgamma(n - j));
    }
    return sum / ell * length / n;
}

/* With theta = 2 pi x/lambda + phase: theta' = w + k sin(theta), and u = tan(theta/2) = a/b follows
 * the linear flow (a, b)' = A (a, b), A = [[k, w], [-w, -k]]/2, A^2 = (k^2 - w^2)/4. */
double cosine_flow_position(const struct cosine_flow *flow, double start, double t)
{
    double q = 2 * PI / flow->wavelength;
    double w = q * flow->mobility * flow->force;
    double k = q * q * flow->mobility * flow->amplitude / 2;
    double theta = remainder(q * start + flow->phase, 2 * PI);
    double a = sin(theta / 2), b = cos(theta / 2), turns = 0, slope = w + k * sin(theta);
    double s2 = (k - w) * (k + w) / 4, ratio; /* ratio = sinh(s t)/s over cosh(s t) */
    double rest = t, scale = 1;
    if (s2 < 0) {
        double s = sqrt(-s2), period = PI / s;
        turns = floor(t / period);
        rest = t - turns * period;
        scale = cos(s * rest);
        ratio = sin(s * rest) / s;
    } else {
        double s = sqrt(s2);
        ratio = s * t > 1e-8 ? tanh(s * t) / s : t;
    }
    double a1 = scale * a + ratio * (k * a + w * b) / 2;
    double b1 = scale * b - ratio * (w * a + k * b) / 2;
    /* The vector may turn by up to pi: theta by up to 2 pi, in the direction it started with. */
    double angle = 2 * atan2(a1 * b - b1 * a, a1 * a + b1 * b);
    double ahead = slope > 0 ? 1 : -1;
    if (s2 < 0) {
        angle += angle * ahead < 0 ? 2 * PI * ahead : 0;
        turns *= ahead;
    }
    return slope == 0 ? start : start + (angle + 2 * PI * turns) / q;
}

double cosine_flow_velocity(const struct cosine_flow *flow)
{
    double critical = PI * fabs(flow->amplitude) / flow->wavelength, f = fabs(flow->force);
    if (f <= critical)
        return 0;
    return copysign(flow->mobility * sqrt((f - critical) * (f + critical)), flow->force);
}

double two_rods_elastic(double gap, double D, double t)
{
    if (!(gap >= 0) || !(D >= 0) || !(t >= 0)) {
        return NAN;
    }
    double s = sqrt(D * t);
    return s == 0 ? 0
                  : 2 * s / sqrt(PI) * exp(-gap * gap / (4 * s * s)) - gap * erfc(gap / (2 * s));
}

double two_rods_rejection(double gap, double D, double t)
{
    if (!(gap >= 0) || !(D >= 0) || !(t >= 0)) {
        return NAN;
    }
    double s = sqrt(D * t);
    return s == 0 ? 0 : s / sqrt(PI) * exp(-gap * gap / (4 * s * s));
}

/* Modes k odd of the box: MSD = w^2/6 - (16 w^2/pi^4) sum e^{-k^2 pi^2 tau}/k^4, tau = D t/w^2. For
 * short times the same by Poisson's formula: 2 tau - 16/(3 sqrt pi) tau^(3/2), up to
 * e^{-1/(4 tau)}. */
double msd_between_walls(double width, double D, double t)
{
    if (!(width >= 0) || !(D >= 0) || !(t >= 0)) {
        return NAN;
    }
    double tau = width > 0 ? D * t / (width * width) : INFINITY;
    if (tau < 0.007) {
        return width * width * tau * (2 - 16 / (3 * sqrt(PI)) * sqrt(tau));
    }
    double sum = 0;
    for (double k = 1; k < 30; k += 2) {
        sum += exp(-k * k * PI * PI * tau) / (k * k * k * k);
    }
    return width * width * (1. / 6 - 16 / (PI * PI * PI * PI) * sum);
}
