/* SPDX-License-Identifier: GPL-3.0-or-later
 * proposal.c - see proposal.h. */
#include "proposal.h"
#include "part.h"
#include "kernels/rods.h"

#include <assert.h>
#include <math.h>

void proposal_layout(struct proposal *proposal, const struct sim *sim, struct arena *scratch)
{
    const struct plan *plan = sim->plan;
    noise_layout(&proposal->noise, plan->particles, 1, scratch);
    proposal->old = plan->pair ? sim_take_rods(sim, scratch) : NULL;
}

void proposal_add_forces(const struct sim *sim, const double *y, double scale, double *out)
{
    const struct plan *plan = sim->plan;
    const int64_t whole = arena_whole(plan->particles);
    assert(!plan->pair || y != out);
    if (plan->field) {
        struct rods rods = {y, sim_rods(sim), plan->diameter, sim_time(sim), sim->offset};
        plan->potential->add_force(plan->potential_par, &rods, scale, out);
    }
    for (int64_t lane = 0; plan->pair && lane < sim->lanes; lane++) {
        struct ring ring = {.y = y + lane * whole,
                            .count = plan->particles,
                            .free_length = plan->free_length,
                            .diameter = plan->diameter,
                            .temperature = plan->temperature,
                            .walls = plan->walls};
        plan->pair->add_force(plan->pair_par, &ring, scale, out + lane * whole);
    }
    if (plan->force != 0)
        rods_shift(out, scale * plan->force, sim_rods(sim));
}

void proposal_euler(struct proposal *proposal, struct sim *sim)
{
    const struct plan *plan = sim->plan;
    const double drift = plan->mobility * plan->time_step;
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    const double *at = sim->y;
    if (plan->pair) {
        sim_copy_rods(sim, proposal->old, sim->y);
        at = proposal->old;
    }
    proposal_add_forces(sim, at, drift, sim->y);
    if (noise > 0)
        noise_add(&proposal->noise, &sim->noise, sim->clock->tick, noise, sim->y);
}
