/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * yukawa - screened charges, V(r) = A exp(-kappa r) / r, cut and shifted at the cutoff. A < 0
 * attracts.
 */
#include "central.h"
#include "kernels/elementary.h"
#include "kernels/simd.h"

#include <math.h>

struct yukawa_par {
    struct central central;
    double strength, screening, cutoff;
};

static const struct bcd_param yukawa_params[] = {
    {.name = "strength",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "energy length",
     .min = -1e6,
     .max = 1e6,
     .doc = "A in V(r) = A exp(-kappa r) / r; above 0 repels",
     .offset = offsetof(struct yukawa_par, strength)},
    {.name = "screening",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "1/length",
     .min = 0,
     .max = 1e9,
     .doc = "kappa, inverse screening length",
     .offset = offsetof(struct yukawa_par, screening)},
    {.name = "cutoff",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 1e-100,
     .max = 1e12,
     .doc = "distance of centres where V, shifted to V(cutoff) = 0, and its force end",
     .offset = offsetof(struct yukawa_par, cutoff)},
    {0},
};

static inline double screened(double exponent)
{
    return exp_bounded(exponent < 700 ? -exponent : -700);
}

static double yukawa_energy(const void *par, double r)
{
    const struct yukawa_par *p = par;
    return p->strength * screened(p->screening * r) / r;
}

KERNEL_CLONES
static void yukawa_force(const void *par, const double *r, int64_t count, double *force)
{
    const struct yukawa_par *p = par;
    const double strength = p->strength, screening = p->screening;
    for (int64_t i = 0; i < count; i++) {
        double inverse = 1 / r[i], exponent = screening * r[i];
        force[i] = strength * screened(exponent) * (1 + exponent) * inverse * inverse;
    }
}

static const struct central_law yukawa_law = {"cutoff", "strength", yukawa_energy, yukawa_force};

static void yukawa_complete(struct bcd_group *group, const struct plan *plan,
                            struct bcd_errors *errors)
{
    const struct yukawa_par *p = group->values;
    central_complete(group, &yukawa_law, p->cutoff, plan, errors);
}

const struct pair_type pair_yukawa = {
    .base = {.part = {.name = "yukawa",
                      .doc = "screened charges, V(r) = A exp(-kappa r) / r, shifted to 0 at the "
                             "cutoff",
                      .params = yukawa_params},
             .par_size = sizeof(struct yukawa_par),
             .complete = yukawa_complete},
    .athermal = true,
    .absent = central_absent,
    .range = central_range,
    .stiffness = central_stiffness,
    .theory = central_theory,
    .add_force = central_add_force,
    .energy = central_energy,
};
