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

#include <math.h>
#include <string.h>

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

static double *take_rods(const struct sim *sim, struct arena *scratch)
{
    return arena_take(scratch, (size_t)sim->plan->particles * sizeof(double));
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
    int64_t n = sim->plan->particles;
    noise_layout(&work.noise, n, scratch);
    work.scratch = take_rods(sim, scratch);
    /* What follows is for those scenes only that have it. */
    if (plan->field || plan->pair || (plan->force != 0 && plan->walls))
        work.blocks = arena_take(scratch, isotonic_blocks(n) * sizeof *work.blocks);
    if (needs_midpoint(plan))
        work.middle = take_rods(sim, scratch);
    if (plan->looks_inside && !strang_exact(plan, false)) {
        noise_layout(&work.view_noise, n, scratch);
        work.view = take_rods(sim, scratch);
    }
    if (own)
        *own = work;
    sim->work = own;
}

/* Explicit midpoint, order 2: for interactions, and potentials without a known flow. */
static void flow_midpoint(const struct sim *sim, double time, double *y)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    size_t bytes = (size_t)plan->particles * sizeof *y;
    memcpy(work->middle, y, bytes);
    proposal_add_forces(sim, y, plan->mobility * time / 2, work->middle);
    /* Forces push rods of a cluster into each other: half way they are in order again. */
    resolve_sticking(plan, work->middle, work->blocks);
    proposal_add_forces(sim, work->middle, plan->mobility * time, y);
}

static void shift(double *y, int64_t count, double by)
{
    for (int64_t i = 0; by != 0 && i < count; i++)
        y[i] += by;
}

/* Exact flow in the field, between two halves of what the drag does. */
static void flow_exact(const struct sim *sim, double time, double *y)
{
    const struct plan *plan = sim->plan;
    const double dragged = plan->mobility * plan->force * time;
    if (!plan->field) {
        shift(y, plan->particles, dragged);
        return;
    }
    shift(y, plan->particles, dragged / 2);
    plan->potential->flow(plan->potential_par, plan, sim_time(sim) + time / 2, time, y);
    shift(y, plan->particles, dragged / 2);
}

/* The constrained deterministic flow over `time`. */
static void drift(const struct sim *sim, double time, double *y)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    if (needs_midpoint(plan))
        flow_midpoint(sim, time, y);
    else if (plan->field || plan->force != 0)
        flow_exact(sim, time, y);
    bool ordered = !plan->pair && !plan->field && (plan->force == 0 || !plan->walls);
    if (ordered) /* the same shift for all */
        return;
    resolve_sticking(plan, y, work->blocks);
}

static void strang_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct strang_work *work = sim->work;
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    for (int64_t t = 0; t < ticks; t++) {
        drift(sim, plan->time_step, sim->y);
        if (noise > 0) {
            noise_add(&work->noise, &sim->noise, sim->clock->tick, noise, sim->y);
            resolve_reflecting(plan, sim->y, work->scratch);
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
    memcpy(work->view, sim->y, (size_t)plan->particles * sizeof *work->view);
    drift(sim, view == VIEW_MID_DRIFT ? plan->time_step / 2 : plan->time_step, work->view);
    if (view == VIEW_MID_DRIFT || plan->diffusion == 0)
        return work->view;
    struct noise_key key = sim->noise;
    key.stream = STREAM_VIEW;
    const double noise = sqrt(plan->diffusion * plan->time_step);
    noise_add(&work->view_noise, &key, sim->clock->tick, noise, work->view);
    resolve_reflecting(plan, work->view, work->scratch);
    return work->view;
}

const struct method_type method_strang = {
    .part = {.name = "strang", .doc = "deterministic sticky flow and reflected noise in turns"},
    .order = 1.5,
    .step_ns = 8,
    .view_ns = 12,
    .exact = strang_exact,
    .time_step = strang_time_step,
    .layout = strang_layout,
    .advance = strang_advance,
    .view = strang_view,
};
