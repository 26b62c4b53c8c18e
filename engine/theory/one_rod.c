/* SPDX-License-Identifier: GPL-3.0-or-later
 * one_rod.c - effective diffusion and drift of one rod, by quadrature (closed_forms.h). */
#include <math.h>

#include "closed_forms.h"
#include "tools.h"

enum { RULE = 16, PANELS_MAX = 4096 };

static enum bcd_status check(const struct one_rod *rod, struct bcd_error *error)
{
    if (!rod->energy || !(rod->period > 0) || !(rod->kT > 0) || !(rod->D >= 0) ||
        !isfinite(rod->force)) {
        return theory_fail(error, BCD_INVALID,
                           "one rod: period %g, kT %g, D %g or force %g out of range", rod->period,
                           rod->kT, rod->D, rod->force);
    }
    return BCD_OK;
}

/* Largest and smallest U/kT on the points of the trapezoidal rule, and both averages beyond them:
 * <exp(U - highest)>, <exp(lowest - U)>. */
static double averages(const struct one_rod *rod, size_t points)
{
    double lowest = INFINITY, highest = -INFINITY, up = 0, down = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < points; i++) {
            double u =
                rod->energy(rod->ctx, rod->period * (double)i / (double)points) / rod->kT;
            if (pass == 0) {
                lowest = fmin(lowest, u);
                highest = fmax(highest, u);
            } else {
                up += exp(u - highest) / (double)points;
                down += exp(lowest - u) / (double)points;
            }
        }
    }
    return exp(lowest - highest) / (up * down);
}

enum bcd_status lifson_jackson(double *diffusion, const struct one_rod *rod,
                               struct bcd_error *error)
{
    enum bcd_status status = check(rod, error);
    if (status) {
        return status;
    }
    double before = NAN;
    for (size_t points = 64; points <= 1 << 20; points *= 2) {
        double now = averages(rod, points);
        if (fabs(now - before) <= 1e-12 * now) {
            *diffusion = rod->D * now;
            return BCD_OK;
        }
        before = now;
    }
    return theory_fail(error, BCD_INVALID, "one rod: the averages of exp(+-U/kT) do not settle");
}

/* One run over x with all integrals on panels. The force is taken positive: with a negative one the
 * potential is mirrored. Arrays over the points x of the rule, ascending. */
struct tilt {
    const struct one_rod *rod;
    double mirror, drop; /* +-1; f P/kT */
    size_t count;
    double *v;               /* [count] V/kT */
    double *up, *down;       /* [count] exp(V - highest), exp(lowest - V) */
    double *up_below, *down_below; /* [count + 1] integrals up to each point, and up to P */
    double highest, lowest;
    double node[RULE], weight[RULE], below[RULE][RULE];
};

static void rule_below(struct tilt *tilt)
{
    gauss_legendre(RULE, tilt->node, tilt->weight);
    for (size_t tau = 0; tau < RULE; tau++) {
        double half = (tilt->node[tau] + 1) / 2;
        for (size_t nu = 0; nu < RULE; nu++) {
            double sum = 0;
            for (size_t i = 0; i < RULE; i++) {
                double t = -1 + half * (tilt->node[i] + 1), product = tilt->weight[i];
                for (size_t mu = 0; mu < RULE; mu++) {
                    product *= mu == nu
                                   ? 1
                                   : (t - tilt->node[mu]) / (tilt->node[nu] - tilt->node[mu]);
                }
                sum += product;
            }
            tilt->below[tau][nu] = half * sum;
        }
    }
}

/* below[i] = integral of f from 0 to point i; below[count] = to the end. */
static void accumulate(const struct tilt *tilt, const double *f, double width, double *below)
{
    double sum = 0;
    for (size_t start = 0; start < tilt->count; start += RULE) {
        double whole = 0;
        for (size_t tau = 0; tau < RULE; tau++) {
            double part = 0;
            for (size_t nu = 0; nu < RULE; nu++) {
                part += tilt->below[tau][nu] * f[start + nu];
            }
            below[start + tau] = sum + part * width / 2;
            whole += tilt->weight[tau] * f[start + tau] * width / 2;
        }
        sum += whole;
    }
    below[tilt->count] = sum;
}

static bool tabulate(struct tilt *tilt, double width)
{
    const struct one_rod *rod = tilt->rod;
    tilt->highest = -INFINITY;
    tilt->lowest = INFINITY;
    for (size_t i = 0; i < tilt->count; i++) {
        double x = width * ((double)(i / RULE) + (tilt->node[i % RULE] + 1) / 2);
        double v = rod->energy(rod->ctx, tilt->mirror * x) / rod->kT - tilt->drop * x / rod->period;
        tilt->v[i] = v;
        tilt->highest = fmax(tilt->highest, v);
        tilt->lowest = fmin(tilt->lowest, v);
    }
    for (size_t i = 0; i < tilt->count; i++) {
        tilt->up[i] = exp(tilt->v[i] - tilt->highest);
        tilt->down[i] = exp(tilt->lowest - tilt->v[i]);
    }
    return tilt->highest - tilt->lowest < 600;
}

/* <I+> and <I+^2 I->, both I over exp(highest - lowest), in units of the period. */
static void moments(struct tilt *tilt, double width, double *mean, double *cubic)
{
    double period = tilt->rod->period, factor = exp(-tilt->drop);
    accumulate(tilt, tilt->up, width, tilt->up_below);
    accumulate(tilt, tilt->down, width, tilt->down_below);
    double up_all = tilt->up_below[tilt->count], down_all = tilt->down_below[tilt->count];
    *mean = *cubic = 0;
    for (size_t i = 0; i < tilt->count; i++) {
        /* (x - P, x) = (x - P, 0) + (0, x), the first a period on, where exp(-V) is larger. */
        double below = tilt->down_below[i] + factor * (down_all - tilt->down_below[i]);
        double above = (up_all - tilt->up_below[i]) + factor * tilt->up_below[i];
        double plus = tilt->up[i] * below / period, minus = tilt->down[i] * above / period;
        double share = tilt->weight[i % RULE] * width / 2 / period;
        *mean += share * plus;
        *cubic += share * plus * plus * minus;
    }
}

static enum bcd_status settle(struct tilt *tilt, double *velocity, double *diffusion,
                              struct bcd_error *error)
{
    const struct one_rod *rod = tilt->rod;
    double before_v = NAN, before_d = NAN;
    for (size_t panels = 8; panels <= PANELS_MAX; panels *= 2) {
        double width = rod->period / (double)panels, mean, cubic;
        tilt->count = panels * RULE;
        if (!tabulate(tilt, width)) {
            break;
        }
        moments(tilt, width, &mean, &cubic);
        double scale = exp(tilt->lowest - tilt->highest);
        double v = tilt->mirror * rod->D / rod->period * -expm1(-tilt->drop) * scale / mean;
        double d = rod->D * cubic / (mean * mean * mean);
        if (fabs(v - before_v) <= 1e-10 * fabs(v) && fabs(d - before_d) <= 1e-10 * d) {
            *velocity = v;
            *diffusion = d;
            return BCD_OK;
        }
        before_v = v;
        before_d = d;
    }
    return theory_fail(error, BCD_INVALID,
                       "one rod: drift and diffusion do not settle, energies spanning %.3g kT",
                       tilt->highest - tilt->lowest);
}

enum bcd_status tilted_drift(double *velocity, double *diffusion, const struct one_rod *rod,
                             struct bcd_error *error)
{
    enum bcd_status status = check(rod, error);
    if (status) {
        return status;
    }
    struct scratch scratch = {0};
    struct tilt tilt = {.rod = rod,
                        .mirror = rod->force < 0 ? -1 : 1,
                        .drop = fabs(rod->force) * rod->period / rod->kT};
    size_t most = PANELS_MAX * RULE;
    tilt.v = scratch_doubles(&scratch, most);
    tilt.up = scratch_doubles(&scratch, most);
    tilt.down = scratch_doubles(&scratch, most);
    tilt.up_below = scratch_doubles(&scratch, most + 1);
    tilt.down_below = scratch_doubles(&scratch, most + 1);
    if (scratch.failed) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
    } else {
        rule_below(&tilt);
        status = settle(&tilt, velocity, diffusion, error);
    }
    scratch_free(&scratch);
    return status;
}
