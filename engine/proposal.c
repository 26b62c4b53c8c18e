/* SPDX-License-Identifier: GPL-3.0-or-later
 * proposal.c - see proposal.h. */
#include "proposal.h"
#include "part.h"

#include <math.h>
#include <string.h>

void proposal_layout(struct proposal *proposal, const struct plan *plan, struct arena *scratch)
{
    noise_layout(&proposal->noise, plan->particles, scratch);
    proposal->z = NULL; /* without forces rods are displaced in place */
    if (plan->field || plan->pair)
        proposal->z = arena_take(scratch, (size_t)plan->particles * sizeof *proposal->z);
}

void proposal_add_forces(const struct sim *sim, const double *y, double scale, double *out)
{
    const struct plan *plan = sim->plan;
    if (plan->field) {
        struct rods rods = {y, plan->particles, plan->diameter, sim_time(sim)};
        plan->potential->add_force(plan->potential_par, &rods, scale, out);
    }
    if (plan->pair) {
        struct ring ring = {.y = y,
                            .count = plan->particles,
                            .free_length = plan->free_length,
                            .diameter = plan->diameter,
                            .temperature = plan->temperature,
                            .walls = plan->walls};
        plan->pair->add_force(plan->pair_par, &ring, scale, out);
    }
    if (plan->force != 0)
        for (int64_t i = 0; i < plan->particles; i++)
            out[i] += scale * plan->force;
}

double *proposal_euler(struct proposal *proposal, struct sim *sim)
{
    const struct plan *plan = sim->plan;
    const double drift = plan->mobility * plan->time_step;
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    double *z = sim->y;
    if (plan->field || plan->pair) {
        z = proposal->z;
        memcpy(z, sim->y, (size_t)plan->particles * sizeof *z);
    }
    proposal_add_forces(sim, sim->y, drift, z);
    if (noise > 0)
        noise_add(&proposal->noise, &sim->noise, sim->clock->tick, noise, z);
    return z;
}

void proposal_accept(struct sim *sim, const double *z)
{
    if (z != sim->y)
        memcpy(sim->y, z, (size_t)sim->plan->particles * sizeof *z);
    sim->clock->tick++;
}
