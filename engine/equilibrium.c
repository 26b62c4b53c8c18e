/* SPDX-License-Identifier: GPL-3.0-or-later
 * equilibrium.c - see equilibrium.h. */
#include "equilibrium.h"
#include "part.h"

const char *equilibrium_missing(const struct plan *plan)
{
    if (plan->temperature == 0)
        return "without noise (temperature 0) there is no equilibrium distribution";
    if (plan->free_length == 0)
        return "closest packing (particles * diameter = length) is a rigid body";
    if (plan->force != 0 && plan->field)
        return "a constant force in a potential drives a current: not in equilibrium";
    if (plan->walls)
        return "no exact theory between walls yet";
    if (plan->field && !plan_field_steady(plan))
        return "the potential moves: not in equilibrium";
    if (plan->pair && !plan->pair->theory)
        return "no exact theory for this interaction";
    return NULL;
}

struct theory_system equilibrium_system(const struct plan *plan)
{
    struct theory_system system = {
        .particles = plan->particles,
        .length = plan->length,
        .diameter = plan->diameter,
        .temperature = plan->temperature,
        .period = plan->period,
        .pair = {.kind = THEORY_HARD},
    };
    if (plan->field) {
        system.energy = plan_energy;
        system.ctx = plan;
    }
    if (plan->pair)
        plan->pair->theory(plan->pair_par, &system.pair);
    return system;
}
