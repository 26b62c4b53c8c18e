/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd - Brownian cluster dynamics: an Euler step of all rods, projected back onto the rings in
 * order. The projection is one isotonic regression (kernels/isotonic.h) and equals fragmentation
 * and merging of clusters in doi 10.1103/PhysRevE.106.054606 and doi 10.1016/j.cpc.2024.109474.
 * Weak order 1/2 at contacts, 1 in smooth fields: rods behave as if shorter by 1.165 sqrt(D h).
 */
#include "bcd_forms.h"
#include "resolve.h"
#include "step_limit.h"

struct bcd_work {
    struct bcd_step step;
    struct isotonic_block *blocks;
};

static void bcd_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct bcd_work work, *own = arena_take(scratch, sizeof *own);
    (void)kept;
    bcd_step_layout(&work.step, sim, false, scratch);
    work.blocks = arena_take(scratch, isotonic_blocks(sim->plan->particles) * sizeof *work.blocks);
    if (own)
        *own = work;
    sim->work = own;
}

static void bcd_advance(struct sim *sim, int64_t ticks)
{
    struct bcd_work *work = sim->work;
    for (int64_t t = 0; t < ticks; t++) {
        proposal_euler(&work->step.proposal, sim);
        resolve_sticking(sim, sim->y, work->blocks);
        sim->clock->tick++;
    }
}

static void bcd_resolve(struct sim *sim, const double *y, double *z)
{
    struct bcd_work *work = sim->work;
    (void)y;
    resolve_sticking(sim, z, work->blocks);
}

static void bcd_contact_forces(struct sim *sim, double *force)
{
    struct bcd_work *work = sim->work;
    bcd_step_contact_forces(sim, &work->step, bcd_resolve, force);
}

const struct method_type method_bcd = {
    .part = {.name = "bcd", .doc = "Brownian cluster dynamics by isotonic regression"},
    .keeps_contacts = true,
    .lanes = true,
    .order = 0.5,
    .step_ns = 6,
    .time_step = bcd_time_step,
    .layout = bcd_layout,
    .advance = bcd_advance,
    .contact_forces = bcd_contact_forces,
};
