/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * strating - an Euler step of all rods whose overlaps are undone at its end, pair after pair along
 * the chain, as elastic collisions (doi 10.1103/PhysRevE.59.2175; as compared in doi
 * 10.1063/1.2719190). In one dimension and with equal mobilities every order of collisions ends in
 * the same configuration: the scheme is that of method "elastic", found by another way
 * (kernels/overlap_sweep.h), with its errors.
 */
#include "part.h"
#include "proposal.h"
#include "step_limit.h"
#include "kernels/overlap_sweep.h"

#include <math.h>

struct strating_work {
    struct proposal proposal;
    double *scratch; /* [N] */
};

static const char *strating_cannot(const struct plan *plan)
{
    return plan->temperature == 0 ? "makes no contacts, which the limit without noise consists of"
                                  : NULL;
}

static struct step_limit strating_time_step(const struct plan *plan)
{
    struct step_limit limit = {INFINITY, "nothing"};
    step_limit_rates(&limit, plan, fmin(0.018 * tolerance_share(plan, 1), 0.5), 0.1);
    return limit;
}

static bool strating_exact(const struct plan *plan, bool dynamic)
{
    (void)dynamic;
    return moves_freely(plan);
}

static void strating_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct strating_work work, *own = arena_take(scratch, sizeof *own);
    (void)kept;
    proposal_layout(&work.proposal, sim, scratch);
    work.scratch = arena_take(scratch, (size_t)sim->plan->particles * sizeof *work.scratch);
    if (own)
        *own = work;
    sim->work = own;
}

static void strating_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct strating_work *work = sim->work;
    for (int64_t t = 0; t < ticks; t++) {
        proposal_euler(&work->proposal, sim);
        if (plan->walls)
            sweep_walls(sim->y, plan->particles, plan->low, plan->low + plan->free_length,
                        work->scratch);
        else
            sweep_ring(sim->y, plan->particles, plan->free_length, work->scratch);
        sim->clock->tick++;
    }
}

const struct method_type method_strating = {
    .part = {.name = "strating",
             .doc = "Euler step, overlaps undone pair by pair; on a line the same as elastic"},
    .order = 1,
    .step_ns = 11,
    .cannot = strating_cannot,
    .exact = strating_exact,
    .time_step = strating_time_step,
    .layout = strating_layout,
    .advance = strating_advance,
};
