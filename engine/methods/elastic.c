/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * elastic - an Euler step of all rods with elastic collisions, De Michele's scheme in one dimension
 * (doi 10.1063/1.2719190): collisions are one sort (kernels/ring_sort.h). Exact in law for any time
 * step when the force is zero or constant; weak order 1 in a field. Makes no contacts: not for the
 * limit without noise.
 */
#include "part.h"
#include "proposal.h"
#include "resolve.h"
#include "step_limit.h"

#include <math.h>

struct elastic_work {
    struct proposal proposal;
    double *scratch; /* [N] */
};

static const char *elastic_cannot(const struct plan *plan)
{
    return plan->temperature == 0 ? "makes no contacts, which the limit without noise consists of"
                                  : NULL;
}

static struct step_limit elastic_time_step(const struct plan *plan)
{
    struct step_limit limit = {INFINITY, "nothing"};
    double scale = tolerance_share(plan, 1), stable = 0.5; /* twice the step is, too */
    step_limit_rates(&limit, plan, fmin(0.018 * scale, stable), fmin(0.1 * scale, stable));
    return limit;
}

static bool elastic_exact(const struct plan *plan, bool dynamic)
{
    (void)dynamic;
    return moves_freely(plan);
}

static void elastic_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct elastic_work work, *own = arena_take(scratch, sizeof *own);
    (void)kept;
    proposal_layout(&work.proposal, sim, scratch);
    work.scratch = arena_take(scratch, (size_t)sim->plan->particles * sizeof *work.scratch);
    if (own)
        *own = work;
    sim->work = own;
}

static void elastic_advance(struct sim *sim, int64_t ticks)
{
    struct elastic_work *work = sim->work;
    for (int64_t t = 0; t < ticks; t++) {
        proposal_euler(&work->proposal, sim);
        resolve_reflecting(sim, sim->y, work->scratch);
        sim->clock->tick++;
    }
}

const struct method_type method_elastic = {
    .part = {.name = "elastic", .doc = "Euler step with elastic collisions by sorting"},
    .lanes = true,
    .order = 1,
    .step_ns = 5,
    .sorts = true,
    .cannot = elastic_cannot,
    .exact = elastic_exact,
    .time_step = elastic_time_step,
    .layout = elastic_layout,
    .advance = elastic_advance,
};
