/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * expression - V(r) as a formula, "4*(1/r^12 - 1/r^6)", with its exact derivative, cut and shifted
 * at the cutoff.
 */
#include "central.h"
#include "kernels/formula.h"

#include <math.h>

struct expression_par {
    struct central central;
    char *energy;
    double cutoff;
    struct formula *formula; /* made by complete */
};

static const struct bcd_param expression_params[] = {
    {.name = "energy",
     .type = BCD_PARAM_TEXT,
     .required = true,
     .unit = "energy",
     .least = 1,
     .most = FORMULA_LENGTH_MAX,
     .doc = "V(r), a formula in the distance r of centres",
     .offset = offsetof(struct expression_par, energy)},
    {.name = "cutoff",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 1e-100,
     .max = 1e12,
     .doc = "distance of centres where V, shifted to V(cutoff) = 0, and its force end",
     .offset = offsetof(struct expression_par, cutoff)},
    {0},
};

static double expression_energy(const void *par, double r)
{
    double energy;
    formula_values(((const struct expression_par *)par)->formula, &r, 1, &energy, NULL, NULL);
    return energy;
}

/* The scan of checks sees 4096 distances; a pole between them must not end in NaN either. */
static void expression_force(const void *par, const double *r, int64_t count, double *force)
{
    enum { TILE = 256 };
    const double most = 1e150;
    double energy[TILE], slope[TILE];
    for (int64_t start = 0; start < count; start += TILE) {
        int64_t n = count - start < TILE ? count - start : TILE;
        formula_values(((const struct expression_par *)par)->formula, r + start, (size_t)n, energy,
                       slope, NULL);
        for (int64_t i = 0; i < n; i++) {
            double above = -slope[i] < most ? -slope[i] : most;
            force[start + i] = above > -most ? above : -most;
        }
    }
}

static const struct central_law expression_law = {"cutoff", "energy", expression_energy,
                                                  expression_force};

static void expression_complete(struct bcd_group *group, const struct plan *plan,
                                struct bcd_errors *errors)
{
    struct expression_par *p = group->values;
    char complaint[160] = "";
    p->formula = formula_create(p->energy, "r", complaint);
    if (!p->formula) {
        if (complaint[0])
            group_fault(group, "energy", errors, "%s", complaint);
        else
            group_no_memory(group, "energy", errors);
        return;
    }
    central_complete(group, &expression_law, p->cutoff, plan, errors);
}

static void expression_release(void *par)
{
    formula_free(((struct expression_par *)par)->formula);
}

static double expression_force_ns(const void *par)
{
    const double distances = 64; /* at once */
    return 12 + formula_ns(((const struct expression_par *)par)->formula, distances);
}

const struct pair_type pair_expression = {
    .base = {.part = {.name = "expression",
                      .doc = "V(r) as a formula, shifted to 0 at the cutoff",
                      .params = expression_params},
             .par_size = sizeof(struct expression_par),
             .complete = expression_complete,
             .release = expression_release},
    .athermal = true,
    .absent = central_absent,
    .range = central_range,
    .stiffness = central_stiffness,
    .theory = central_theory,
    .add_force = central_add_force,
    .energy = central_energy,
    .force_ns = expression_force_ns,
};
