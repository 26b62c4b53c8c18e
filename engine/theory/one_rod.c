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
    enum { LOOK = 1024 };
    double lowest = INFINITY, highest = -INFINITY, up = 0, down = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < points; i++) {
            if (i % LOOK == 0 && !watch_spend(rod->watch, LOOK * (20 + rod->energy_ns))) {
                return NAN;
            }
            double u = rod->energy(rod->ctx, rod->period * (double)i / (double)points) / rod->kT;
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
        if (watch_ended(rod->watch)) {
            return watch_stopped(rod->watch, error);
        }
        if (fabs(now - before) <= 1e-12 * now) {
            *diffusion = rod->D * now;
            return BCD_OK;
        }
        before = now;
    }
    return theory_fail(error, BCD_INVALID, "one rod: the averages of exp(+-U/kT) do not settle");
}

/* One run over x on panels. The force is taken positive: with a negative one the potential is
 * mirrored. With V = U - f x, in units of kT, and V(P) = V(0) - drop,
 *
 *   S(x) = e^{V(x)} int_0^x e^{-V},  R(x) = e^{-V(x)} int_x^P e^V
 *   P I+ = (1 - e^{-drop}) S(x) + e^{V(x) - V(0)} S(P)
 *   P I- = (1 - e^{-drop}) R(x) + e^{V(P) - V(x)} R(0)
 *
 * S and R go from panel to panel with differences of V alone: nothing larger than the barrier's
 * exponential ever occurs, whatever the drop, and that factor is taken out. */
struct tilt {
    const struct one_rod *rod;
    double mirror, drop; /* +-1; f P/kT */
    double barrier;      /* largest rise of V on the way down, within a period */
    size_t panels;
    double *v, *edge;     /* [panels RULE], [panels + 1] V at the points and between the panels */
    double *plus, *minus; /* [panels RULE] S, R; then I+ and I-: over exp(barrier) */
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
                    product *=
                        mu == nu ? 1 : (t - tilt->node[mu]) / (tilt->node[nu] - tilt->node[mu]);
                }
                sum += product;
            }
            tilt->below[tau][nu] = half * sum;
        }
    }
}

static double tilted_energy(const struct tilt *tilt, double x)
{
    const struct one_rod *rod = tilt->rod;
    return rod->energy(rod->ctx, tilt->mirror * x) / rod->kT - tilt->drop * x / rod->period;
}

static bool tabulate(struct tilt *tilt)
{
    double width = tilt->rod->period / (double)tilt->panels, lowest = INFINITY;
    tilt->barrier = 0;
    /* Two periods: the rise may lie across the end of the first. */
    for (size_t i = 0; i < 2 * tilt->panels * RULE; i++) {
        size_t k = i % (tilt->panels * RULE);
        double fallen = k == i ? 0 : tilt->drop;
        if (k == i) {
            double x = width * ((double)(i / RULE) + (tilt->node[i % RULE] + 1) / 2);
            tilt->v[i] = tilted_energy(tilt, x);
        }
        lowest = fmin(lowest, tilt->v[k] - fallen);
        tilt->barrier = fmax(tilt->barrier, tilt->v[k] - fallen - lowest);
    }
    for (size_t panel = 0; panel <= tilt->panels; panel++) {
        tilt->edge[panel] = tilted_energy(tilt, width * (double)panel);
    }
    return tilt->barrier < 600;
}

/* S at all points; returns S(P). */
static double sweep_right(struct tilt *tilt)
{
    double half = tilt->rod->period / (2 * (double)tilt->panels), running = 0;
    for (size_t panel = 0; panel < tilt->panels; panel++) {
        const double *v = tilt->v + panel * RULE;
        double *out = tilt->plus + panel * RULE;
        double end = tilt->edge[panel + 1], whole = 0;
        for (size_t tau = 0; tau < RULE; tau++) {
            double part = 0;
            for (size_t nu = 0; nu < RULE; nu++) {
                part += tilt->below[tau][nu] * exp(v[tau] - v[nu] - tilt->barrier);
            }
            out[tau] = running * exp(v[tau] - tilt->edge[panel]) + half * part;
            whole += half * tilt->weight[tau] * exp(end - v[tau] - tilt->barrier);
        }
        running = running * exp(end - tilt->edge[panel]) + whole;
    }
    return running;
}

/* R at all points; returns R(0). */
static double sweep_left(struct tilt *tilt)
{
    double half = tilt->rod->period / (2 * (double)tilt->panels), running = 0;
    for (size_t panel = tilt->panels; panel-- > 0;) {
        const double *v = tilt->v + panel * RULE;
        double *out = tilt->minus + panel * RULE;
        double start = tilt->edge[panel], end = tilt->edge[panel + 1], whole = 0;
        for (size_t tau = 0; tau < RULE; tau++) {
            double part = 0;
            for (size_t nu = 0; nu < RULE; nu++) {
                /* The rest of the panel, beyond tau. */
                double share = tilt->weight[nu] - tilt->below[tau][nu];
                part += share * exp(v[nu] - v[tau] - tilt->barrier);
            }
            out[tau] = running * exp(end - v[tau]) + half * part;
            whole += half * tilt->weight[tau] * exp(v[tau] - start - tilt->barrier);
        }
        running = running * exp(end - start) + whole;
    }
    return running;
}

/* <I+> and <I+^2 I-> over exp(barrier), exp(3 barrier). */
static void moments(struct tilt *tilt, double *mean, double *cubic)
{
    double period = tilt->rod->period, kept = -expm1(-tilt->drop);
    double s_end = sweep_right(tilt), r_start = sweep_left(tilt);
    double first = tilt->edge[0], last = tilt->edge[tilt->panels];
    *mean = *cubic = 0;
    for (size_t i = 0; i < tilt->panels * RULE; i++) {
        double plus = (kept * tilt->plus[i] + exp(tilt->v[i] - first) * s_end) / period;
        double minus = (kept * tilt->minus[i] + exp(last - tilt->v[i]) * r_start) / period;
        double share = tilt->weight[i % RULE] / (2 * (double)tilt->panels);
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
        double mean, cubic, point_ns = 2 * RULE * 10 + rod->energy_ns;
        tilt->panels = panels;
        if (!watch_spend(rod->watch, (double)(panels * RULE) * point_ns)) {
            return watch_stopped(rod->watch, error);
        }
        if (!tabulate(tilt)) {
            break;
        }
        moments(tilt, &mean, &cubic);
        double scale = exp(-tilt->barrier);
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
                       "one rod: drift and diffusion do not settle, with a barrier of %.3g kT",
                       tilt->barrier);
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
    tilt.edge = scratch_doubles(&scratch, PANELS_MAX + 1);
    tilt.plus = scratch_doubles(&scratch, most);
    tilt.minus = scratch_doubles(&scratch, most);
    if (scratch.failed) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
    } else {
        rule_below(&tilt);
        status = settle(&tilt, velocity, diffusion, error);
    }
    scratch_free(&scratch);
    return status;
}
