/* SPDX-License-Identifier: GPL-3.0-or-later
 * equilibrium.c - see equilibrium.h. */
#include "equilibrium.h"
#include "part.h"

#include <math.h>

const char *equilibrium_missing(const struct plan *plan)
{
    if (plan->temperature == 0)
        return "without noise (temperature 0) there is no equilibrium distribution";
    if (plan->free_length == 0)
        return "closest packing (particles * diameter = length) is a rigid body";
    if (plan->force != 0 && plan->field && !plan->walls)
        return "a constant force in a potential drives a current: not in equilibrium";
    if (plan->field && !plan_field_steady(plan))
        return "the potential moves: not in equilibrium";
    if (plan->pair && !plan->pair->theory)
        return "no exact theory for this interaction";
    return NULL;
}

/* Between walls: a length over which the potential is smooth. */
static double smooth_over(const struct plan *plan)
{
    double curvature = plan->potential->curvature_max(plan->potential_par);
    return 6 * sqrt(plan->temperature / curvature);
}

struct theory_system equilibrium_system(const struct plan *plan)
{
    struct theory_system system = {
        .particles = plan->particles,
        .length = plan->length,
        .diameter = plan->diameter,
        .temperature = plan->temperature,
        .period = plan->period,
        .walls = plan->walls,
        .force = plan->walls ? plan->force : 0, /* on a ring it only makes the rods drift */
        .pair = {.kind = THEORY_HARD},
    };
    if (plan->field) {
        system.energy = plan_energy;
        system.ctx = plan;
        system.energy_ns = plan_energy_ns(plan);
        system.curvature = plan->potential->curvature_max(plan->potential_par);
        if (plan->potential->rough && plan->potential->rough(plan->potential_par))
            system.tolerance = 1e-6; /* grids converge by powers only */
        if (plan->walls)
            system.period = fmin(plan->length, smooth_over(plan));
    }
    if (plan->pair)
        plan->pair->theory(plan->pair_par, &system.pair);
    return system;
}
