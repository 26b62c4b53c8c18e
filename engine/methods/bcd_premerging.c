/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd_premerging - Brownian cluster dynamics in O(N) with clusters that will collide merged
 * beforehand, after doi 10.1016/j.cpc.2024.109474 (kernels/premerging.h says what is from there and
 * what is ours). The same map as bcd up to rounding, at a higher cost: kept as a reference, and to
 * compare costs with.
 */
#include "bcd_forms.h"
#include "step_limit.h"
#include "kernels/premerging.h"

struct premerging_work {
    struct bcd_step step;
    struct cluster *stack; /* [N] */
};

static void premerging_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct premerging_work work, *own = arena_take(scratch, sizeof *own);
    (void)kept;
    bcd_step_layout(&work.step, sim, true, scratch);
    work.stack = arena_take(scratch, (size_t)sim->plan->particles * sizeof *work.stack);
    if (own)
        *own = work;
    sim->work = own;
}

static void premerging_resolve(struct sim *sim, const double *y, double *z)
{
    struct premerging_work *work = sim->work;
    const struct lane lane = bcd_lane(sim->plan);
    premerging_step(&lane, y, z, work->stack);
}

static void premerging_advance(struct sim *sim, int64_t ticks)
{
    struct premerging_work *work = sim->work;
    bcd_step_advance(sim, &work->step, premerging_resolve, ticks);
}

static void premerging_contact_forces(struct sim *sim, double *force)
{
    struct premerging_work *work = sim->work;
    bcd_step_contact_forces(sim, &work->step, premerging_resolve, force);
}

const struct method_type method_bcd_premerging = {
    .part = {.name = "bcd_premerging",
             .doc = "Brownian cluster dynamics, clusters merged before they move (2024)"},
    .keeps_contacts = true,
    .order = 0.5,
    .step_ns = 30,
    .time_step = bcd_time_step,
    .layout = premerging_layout,
    .advance = premerging_advance,
    .contact_forces = premerging_contact_forces,
};
