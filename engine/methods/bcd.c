/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd - Brownian cluster dynamics: an Euler step of all rods, projected back onto the rings in
 * order. The projection is one isotonic regression (kernels/isotonic.h) and equals fragmentation
 * and merging of clusters in doi 10.1103/PhysRevE.106.054606 and doi 10.1016/j.cpc.2024.109474.
 * Weak order 1/2 at contacts, 1 in smooth fields: rods behave as if shorter by 1.165 sqrt(D h).
 */
#include "part.h"
#include "proposal.h"
#include "resolve.h"
#include "step_limit.h"

#include <math.h>

struct bcd_work {
    struct proposal proposal;
    struct isotonic_block *blocks;
};

static void bcd_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct bcd_work work, *own = arena_take(scratch, sizeof *own);
    (void)kept;
    proposal_layout(&work.proposal, sim->plan, scratch);
    work.blocks =
        arena_take(scratch, isotonic_blocks(sim->plan->particles) * sizeof *work.blocks);
    if (own)
        *own = work;
    sim->work = own;
}

static void bcd_advance(struct sim *sim, int64_t ticks)
{
    struct bcd_work *work = sim->work;
    for (int64_t t = 0; t < ticks; t++) {
        double *z = proposal_euler(&work->proposal, sim);
        resolve_sticking(sim->plan, z, work->blocks);
        proposal_accept(sim, z);
    }
}

/* L1 error of the density within the tolerance: in the smooth part as measured, at contacts from how much
 * shorter rods seem against the mean gap. */
static struct step_limit bcd_time_step(const struct plan *plan)
{
    const double gap_share = 0.25;
    struct step_limit limit = {INFINITY, "nothing"};
    step_limit_rates(&limit, plan, fmin(0.018 * tolerance_share(plan, 1), 0.5), 0.1);
    double gap = plan->free_length / (double)plan->particles, reach = plan->tolerance * gap / gap_share;
    if (plan->particles > 1 && plan->diffusion > 0 && gap > 0)
        step_limit(&limit, reach * reach / (4 * plan->diffusion), "mean gap between rods");
    return limit;
}

const struct method_type method_bcd = {
    .part = {.name = "bcd", .doc = "Brownian cluster dynamics by isotonic regression"},
    .keeps_contacts = true,
    .order = 0.5,
    .step_ns = 12,
    .time_step = bcd_time_step,
    .layout = bcd_layout,
    .advance = bcd_advance,
};
