/* SPDX-License-Identifier: GPL-3.0-or-later
 * proposal.c - see proposal.h. */
#include "proposal.h"
#include "part.h"
#include "sharing.h"
#include "kernels/rods.h"

#include <assert.h>
#include <math.h>

void proposal_layout(struct proposal *proposal, const struct sim *sim, struct arena *scratch)
{
    const struct plan *plan = sim->plan;
    noise_layout(&proposal->noise, plan->particles, 1, scratch);
    proposal->old = plan->pair ? sim_take_rods(sim, scratch) : NULL;
}

/* What acts on the rods of a stretch, or on all of them: scale times the forces at y, added to out.
 */
struct forces {
    const struct sim *sim;
    const double *y;
    double scale;
    double *out;
};

static void add_field(const struct forces *f, int64_t first, int64_t count)
{
    const struct plan *plan = f->sim->plan;
    const struct rods rods = {.y = f->y + first,
                              .count = count,
                              .diameter = plan->diameter,
                              .time = sim_time(f->sim),
                              .offset = f->sim->offset,
                              .first = first};
    if (plan->field)
        plan->potential->add_force(plan->potential_par, &rods, f->scale, f->out + first);
}

static void add_drag(const struct forces *f, int64_t first, int64_t count)
{
    if (f->sim->plan->force != 0)
        rods_shift(f->out + first, f->scale * f->sim->plan->force, count);
}

static struct ring ring_of(const struct plan *plan, const double *y)
{
    return (struct ring){.y = y,
                         .count = plan->particles,
                         .free_length = plan->free_length,
                         .diameter = plan->diameter,
                         .temperature = plan->temperature,
                         .walls = plan->walls};
}

static void add_all(const struct forces *f)
{
    const struct plan *plan = f->sim->plan;
    const int64_t whole = arena_whole(plan->particles), all = sim_rods(f->sim);
    add_field(f, 0, all);
    for (int64_t lane = 0; plan->pair && lane < f->sim->lanes; lane++) {
        const struct ring ring = ring_of(plan, f->y + lane * whole);
        plan->pair->add_force(plan->pair_par, &ring, f->scale, f->out + lane * whole);
    }
    add_drag(f, 0, all);
}

static void add_part(void *of, int64_t part)
{
    const struct forces *f = of;
    const struct plan *plan = f->sim->plan;
    const struct stretch rods = sharing_stretch(f->sim, part);
    const int64_t room = rods.room - rods.first;
    add_field(f, rods.first, room);
    if (plan->pair) {
        const struct ring ring = ring_of(plan, f->y);
        const struct pair_stretch within = {rods.first, rods.end};
        plan->pair->add_force_within(plan->pair_par, &ring, &within, f->scale, f->out);
    }
    add_drag(f, rods.first, room);
}

/* Do the forces on a stretch follow from its rods and the two beside it? */
static bool in_parts(const struct sim *sim)
{
    const struct plan *plan = sim->plan;
    return sharing(sim) && (!plan->pair || plan->pair->add_force_within);
}

void proposal_add_forces(const struct sim *sim, const double *y, double scale, double *out)
{
    struct forces forces = {sim, y, scale, out};
    assert(!sim->plan->pair || y != out);
    if (in_parts(sim))
        sharing_each(sim, add_part, &forces);
    else
        add_all(&forces);
}

void proposal_add_noise(const struct sim *sim, struct noise *noise, const struct noise_key *key,
                        double scale, double *z)
{
    if (sharing(sim))
        sharing_add_noise(sim, key, scale, z);
    else
        noise_add(noise, key, sim->clock->tick, scale, z);
}

struct euler {
    struct forces forces;
    double noise;
};

static void euler_part(void *of, int64_t part)
{
    struct euler *e = of;
    const struct sim *sim = e->forces.sim;
    const struct stretch rods = sharing_stretch(sim, part);
    add_part(&e->forces, part);
    if (e->noise > 0)
        sharing_add_noise_within(sim, &sim->noise, e->noise, &rods, sim->y);
}

void proposal_euler(struct proposal *proposal, struct sim *sim)
{
    const struct plan *plan = sim->plan;
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    struct euler euler = {{sim, sim->y, plan->mobility * plan->time_step, sim->y}, noise};
    if (plan->pair) {
        sim_copy_rods(sim, proposal->old, sim->y);
        euler.forces.y = proposal->old;
    }
    if (in_parts(sim)) {
        sharing_each(sim, euler_part, &euler);
        return;
    }
    add_all(&euler.forces);
    if (noise > 0)
        proposal_add_noise(sim, &proposal->noise, &sim->noise, noise, sim->y);
}
