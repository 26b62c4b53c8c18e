/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * strang - drift and noise in turns, each resolved exactly on its own: the drift flows without
 * noise and rods that meet stick (one isotonic regression), the noise is reflected diffusion (one
 * sort). Order 3/2 at contacts, 2 in the smooth part; without noise the deterministic sticky flow.
 *
 *     y <- PAVA(flow_h(y));   y <- SORT(y + sqrt(2 D h) n)
 *
 * The kept state is the one after the noise. Static observables look at it in the middle of a noise
 * or of a drift (views); the truth lies between the two as a rule, so that their difference bounds
 * the error of the time step. Looking does not change the run.
 */
#include "part.h"
#include "proposal.h"
#include "resolve.h"
#include "step_limit.h"
#include "kernels/rods.h"

#include <math.h>

struct strang_work {
    struct noise noise, view_noise;
    struct isotonic_block *blocks;
    double *scratch, *middle, *view; /* [N] each */
};

static struct step_limit strang_time_step(const struct plan *plan)
{
    struct step_limit limit = {INFINITY, "nothing"};
    double scale = tolerance_share(plan, 1.5), stable = 0.5; /* twice the step is, too */
    const double seen = 0.3; /* both views are to tell the error (step_error.c) */
    step_limit_rates(&limit, plan, fmin(0.2 * scale, seen), fmin(0.3 * scale, stable));
    return limit;
}

static bool strang_exact(const struct plan *plan, bool dynamic)
{
    (void)dynamic;
    return moves_freely(plan) && plan->diffusion > 0;
}

/* No exact flow is known. */
static bool needs_midpoint(const struct plan *plan)
{
    return plan->pair || (plan->field && !plan->potential->flow);
}

static void strang_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    const struct plan *plan = sim->plan;
    struct strang_work work = {0}, *own = arena_take(scratch, sizeof *own);
    (void)kept;
    int64_t n = plan->particles;
    noise_layout(&work.noise, n, 1, scratch);
    work.scratch = sim_take_rods(sim, scratch);
    /* What follows is for those scenes only that have it. */
    if (plan->field || plan->pair || (plan->force != 0 && plan->walls))
        work.blocks = arena_take(scratch, isotonic_blocks(n) * sizeof *work.blocks);
    if (needs_midpoint(plan))
        work.middle = sim_take_rods(sim, scratch);
    if (plan->looks_inside && !strang_exact(plan, false)) {
        noise_layout(&work.view_noise, n, plan->sample_steps, scratch);
        work.view = sim_take_rods(sim, scratch);
    }
    if (own)
        *own = work;
    sim->work = own;
}

/* A drift of that length, and what the potential's flow makes of it. */
struct strang_drift {
    double time, growth;
};

static struct strang_drift drift_of(const struct plan *plan, double time)
{
    const bool flows = plan->field && !needs_midpoint(plan);
    double growth = 1;
    if (flows)
        growth = plan->potential->flow_growth(plan->potential_par, plan->mobility, time);
    return (struct strang_drift){time, growth};
}

/* Explicit midpoint, order 2: for interactions, and potentials without a known flow. */
static void flow_midpoint(const struct sim *sim, double time, double *y)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    sim_copy_rods(sim, work->middle, y);
    proposal_add_forces(sim, y, plan->mobility * time / 2, work->middle);
    /* Forces push rods of a cluster into each other: half way they are in order again. */
    resolve_sticking(sim, work->middle, work->blocks);
    proposal_add_forces(sim, work->middle, plan->mobility * time, y);
}

static void shift(double *y, double by, int64_t count)
{
    if (by != 0)
        rods_shift(y, by, count);
}

/* Exact flow of rods first .. first + count - 1 in the field, between two halves of what the drag
 * does. */
struct strang_flow {
    const struct sim *sim;
    const struct strang_drift *over;
    double *y;
};

static void flow_stretch(const struct strang_flow *flow, int64_t first, int64_t count)
{
    const struct plan *plan = flow->sim->plan;
    const struct strang_drift *over = flow->over;
    const double dragged = plan->mobility * plan->force * over->time;
    double *y = flow->y + first;
    if (!plan->field) {
        shift(y, dragged, count);
        return;
    }
    const struct rods rods = {.y = y,
                              .count = count,
                              .diameter = plan->diameter,
                              .time = sim_time(flow->sim) + over->time / 2,
                              .offset = flow->sim->offset,
                              .first = first};
    shift(y, dragged / 2, count);
    plan->potential->flow(plan->potential_par, &rods, over->growth, y);
    shift(y, dragged / 2, count);
}

static void flow_part(void *of, int64_t part)
{
    const struct strang_flow *flow = of;
    const struct stretch rods = sharing_stretch(flow->sim, part);
    flow_stretch(flow, rods.first, rods.room - rods.first);
}

static void flow_exact(const struct sim *sim, const struct strang_drift *over, double *y)
{
    struct strang_flow flow = {sim, over, y};
    if (sharing(sim))
        sharing_each(sim, flow_part, &flow);
    else
        flow_stretch(&flow, 0, sim_rods(sim));
}

/* The constrained deterministic flow. */
static void drift(const struct sim *sim, const struct strang_drift *over, double *y)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    if (needs_midpoint(plan))
        flow_midpoint(sim, over->time, y);
    else if (plan->field || plan->force != 0)
        flow_exact(sim, over, y);
    bool ordered = !plan->pair && !plan->field && (plan->force == 0 || !plan->walls);
    if (ordered) /* the same shift for all */
        return;
    resolve_sticking(sim, y, work->blocks);
}

static void strang_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    const struct strang_drift whole = drift_of(plan, plan->time_step);
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    for (int64_t t = 0; t < ticks; t++) {
        drift(sim, &whole, sim->y);
        if (noise > 0) {
            proposal_add_noise(sim, &work->noise, &sim->noise, noise, sim->y);
            resolve_reflecting(sim, sim->y, work->scratch);
        }
        sim->clock->tick++;
    }
}

/* Mid-drift: half a drift further. Mid-noise: a whole drift and noise of half the variance, from a
 * stream of its own; the same in law as half way through the next step. */
static const double *strang_view(struct sim *sim, enum view view)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    const struct strang_drift over =
        drift_of(plan, view == VIEW_MID_DRIFT ? plan->time_step / 2 : plan->time_step);
    sim_copy_rods(sim, work->view, sim->y);
    drift(sim, &over, work->view);
    if (view == VIEW_MID_DRIFT || plan->diffusion == 0)
        return work->view;
    struct noise_key key = sim->noise;
    key.stream = STREAM_VIEW;
    const double noise = sqrt(plan->diffusion * plan->time_step);
    proposal_add_noise(sim, &work->view_noise, &key, noise, work->view);
    resolve_reflecting(sim, work->view, work->scratch);
    return work->view;
}

const struct method_type method_strang = {
    .part = {.name = "strang", .doc = "deterministic sticky flow and reflected noise in turns"},
    .lanes = true,
    .order = 1.5,
    .step_ns = 8,
    .view_ns = 12,
    .sorts = true,
    .exact = strang_exact,
    .time_step = strang_time_step,
    .layout = strang_layout,
    .advance = strang_advance,
    .view = strang_view,
};
