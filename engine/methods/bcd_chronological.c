/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd_chronological - Brownian cluster dynamics as first published, doi
 * 10.1103/PhysRevE.106.054606: fragmentation of clusters where mean forces differ most, then
 * collisions one after another (kernels/chronological.h). The same map as bcd up to rounding, at a
 * higher cost: kept as a reference, and to compare costs with.
 */
#include "bcd_forms.h"
#include "step_limit.h"
#include "kernels/chronological.h"

struct chronological_work {
    struct bcd_step step;
    struct chronological rods;
};

enum { PARTICLES_MAX = 100000 };

/* A step is not interrupted: the worst one of so many rods, in one cluster that breaks off rod by
 * rod, takes some 20 s. */
static const char *chronological_cannot(const struct plan *plan)
{
    return plan->particles > PARTICLES_MAX
               ? "takes N^2 operations a step at worst: at most 100000 particles"
               : NULL;
}

static void chronological_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct chronological_work work, *own = arena_take(scratch, sizeof *own);
    size_t n = (size_t)sim->plan->particles;
    (void)kept;
    bcd_step_layout(&work.step, sim, true, scratch);
    work.rods.clusters = arena_take(scratch, n * sizeof *work.rods.clusters);
    work.rods.first_of = arena_take(scratch, n * sizeof *work.rods.first_of);
    work.rods.time = arena_take(scratch, n * sizeof *work.rods.time);
    work.rods.winner = arena_take(scratch, n * sizeof *work.rods.winner);
    if (own)
        *own = work;
    sim->work = own;
}

static void chronological_resolve(struct sim *sim, const double *y, double *z)
{
    struct chronological_work *work = sim->work;
    const struct lane lane = bcd_lane(sim->plan);
    chronological_step(&lane, y, z, &work->rods);
}

static void chronological_advance(struct sim *sim, int64_t ticks)
{
    struct chronological_work *work = sim->work;
    bcd_step_advance(sim, &work->step, chronological_resolve, ticks);
}

static void chronological_contact_forces(struct sim *sim, double *force)
{
    struct chronological_work *work = sim->work;
    bcd_step_contact_forces(sim, &work->step, chronological_resolve, force);
}

const struct method_type method_bcd_chronological = {
    .part = {.name = "bcd_chronological",
             .doc = "Brownian cluster dynamics, collisions event by event (2022)"},
    .keeps_contacts = true,
    .order = 0.5,
    .step_ns = 60,
    .cannot = chronological_cannot,
    .time_step = bcd_time_step,
    .layout = chronological_layout,
    .advance = chronological_advance,
    .contact_forces = chronological_contact_forces,
};
