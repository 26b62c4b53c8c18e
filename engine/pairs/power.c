/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * power - V(r) = A / r^n, cut and shifted at the cutoff: n = 3 dipoles side by side, n = 12 soft
 * cores. A < 0 attracts.
 */
#include "central.h"
#include "kernels/elementary.h"
#include "kernels/simd.h"

#include <math.h>

struct power_par {
    struct central central;
    double strength, exponent, cutoff;
};

static const struct bcd_param power_params[] = {
    {.name = "strength",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "energy length^n",
     .min = -1e6,
     .max = 1e6,
     .doc = "A in V(r) = A / r^n; above 0 repels",
     .offset = offsetof(struct power_par, strength)},
    {.name = "exponent",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .above_min = true,
     .min = 0,
     .max = 100,
     .doc = "n, how steeply V falls",
     .offset = offsetof(struct power_par, exponent)},
    {.name = "cutoff",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 1e-100,
     .max = 1e12,
     .doc = "distance of centres where V, shifted to V(cutoff) = 0, and its force end",
     .offset = offsetof(struct power_par, cutoff)},
    {0},
};

/* r^-a, kept a number on both sides. */
static inline double inverse_power(double r, double a)
{
    double exponent = -a * log_normal(r);
    double above = exponent > -700 ? exponent : -700;
    return exp_bounded(above < 700 ? above : 700);
}

static double power_energy(const void *par, double r)
{
    const struct power_par *p = par;
    return p->strength * inverse_power(r, p->exponent);
}

KERNEL_CLONES
static void general_powers(const double *r, int64_t count, double a, double *result)
{
    for (int64_t i = 0; i < count; i++)
        result[i] = inverse_power(r[i], a);
}

/* r^-whole by squares: one of the two loops for each binary digit. */
KERNEL_CLONES
static void whole_powers(const double *r, int64_t count, int whole, double *result)
{
    enum { TILE = 64 };
    for (int64_t start = 0; start < count; start += TILE) {
        int64_t n = count - start < TILE ? count - start : TILE;
        double square[TILE], *to = result + start;
        for (int64_t i = 0; i < n; i++)
            square[i] = 1 / r[start + i];
        for (int64_t i = 0; i < n; i++)
            to[i] = whole & 1 ? square[i] : 1;
        for (int left = whole >> 1; left > 0; left >>= 1) {
            for (int64_t i = 0; i < n; i++)
                square[i] *= square[i];
            for (int64_t i = 0; (left & 1) && i < n; i++)
                to[i] *= square[i];
        }
    }
}

static void power_force(const void *par, const double *r, int64_t count, double *force)
{
    const struct power_par *p = par;
    const double scale = p->strength * p->exponent;
    if (p->exponent == floor(p->exponent))
        whole_powers(r, count, (int)p->exponent + 1, force);
    else
        general_powers(r, count, p->exponent + 1, force);
    for (int64_t i = 0; i < count; i++)
        force[i] *= scale;
}

static const struct central_law power_law = {"cutoff", "strength", power_energy, power_force};

static void power_complete(struct bcd_group *group, const struct plan *plan,
                           struct bcd_errors *errors)
{
    const struct power_par *p = group->values;
    central_complete(group, &power_law, p->cutoff, plan, errors);
}

const struct pair_type pair_power = {
    .base = {.part = {.name = "power",
                      .doc = "V(r) = A / r^n, shifted to 0 at the cutoff",
                      .params = power_params},
             .par_size = sizeof(struct power_par),
             .complete = power_complete},
    .athermal = true,
    .absent = central_absent,
    .range = central_range,
    .stiffness = central_stiffness,
    .theory = central_theory,
    .add_force = central_add_force,
    .energy = central_energy,
};
