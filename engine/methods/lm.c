/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * lm - the scheme of Leimkuhler and Matthews (doi 10.1093/amrx/abs010) with elastic collisions by
 * sorting: an Euler step whose noise is the mean of this step's and the last one's,
 *
 *     y <- SORT(y + mu h F(y) + sqrt(2 D h) (R + n) / 2),   R <- n.
 *
 * Equilibrium averages only: they are an order better than those of the Euler step, whereas
 * displacements over a few steps mean nothing. R belongs to a path, not to a label: it travels with
 * the path through the sort, hand-over round the ring included. At a wall it changes sign with the
 * path: a wall is a mirror, the mirrored path is a path of the same scheme in the mirrored field,
 * and seen from this side its noise is the mirrored one. (Two rods that swap do the same: their
 * relative noise changes sign.)
 */
#include "part.h"
#include "proposal.h"
#include "sharing.h"
#include "step_limit.h"
#include "kernels/ring_sort_marked.h"
#include "kernels/rods.h"

#include <math.h>

struct lm_work {
    struct noise noise;
    double *kick;    /* [N], sqrt(2 D h) R / 2; kept in checkpoints */
    double *scratch; /* [2 N] */
};

static const char *lm_cannot(const struct plan *plan)
{
    if (plan->temperature == 0)
        return "is for equilibrium, which the limit without noise does not have";
    if (plan->asks_dynamics)
        return "gives equilibrium averages alone, not what depends on how rods move";
    if (plan->force != 0)
        return "is for equilibrium, which there is none of under a drag force";
    if (plan->field && !plan->potential->steady(plan->potential_par))
        return "is for equilibrium, which there is none of in a potential that moves";
    return NULL;
}

/* Shares measured at an L1 error of the density of .005; errors fall as h^(3/2) there. Dense rings
 * need shorter steps; and steps of twice the length, which tell the error, stay allowed, whatever
 * is tolerated. */
static struct step_limit lm_time_step(const struct plan *plan)
{
    const double stable = 0.5;
    struct step_limit limit = {INFINITY, "nothing"};
    double gap = plan->free_length / (double)plan->particles;
    double share = gap < 0.1 * plan->period ? 0.2 : 0.4;
    double scale = tolerance_share(plan, 1.5);
    step_limit_rates(&limit, plan, fmin(stable, share * scale), fmin(stable, 0.25 * scale));
    return limit;
}

static bool lm_exact(const struct plan *plan, bool dynamic)
{
    return !dynamic && moves_freely(plan);
}

static double half_noise(const struct plan *plan)
{
    return sqrt(2 * plan->diffusion * plan->time_step) / 2;
}

static void lm_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct lm_work work, *own = arena_take(scratch, sizeof *own);
    size_t n = (size_t)sim->plan->particles;
    noise_layout(&work.noise, sim->plan->particles, 1, scratch);
    work.kick = sim_take_rods(sim, kept);
    work.scratch = arena_take(scratch, 2 * n * sizeof *work.scratch);
    if (own)
        *own = work;
    sim->work = own;
}

static void lm_begin(struct sim *sim)
{
    struct lm_work *work = sim->work;
    const int64_t n = sim->plan->particles;
    struct noise_key key = sim->noise;
    key.stream = STREAM_FIRST_KICK;
    for (int64_t i = 0; i < sim_rods(sim); i++)
        work->kick[i] = 0;
    for (int64_t lane = 0; lane < sim->lanes; lane++, key.realization++)
        normals_add(work->kick + lane * arena_whole(n), n, half_noise(sim->plan), &key, 0);
}

static void collide(const struct sim *sim)
{
    const struct plan *plan = sim->plan;
    const struct lm_work *work = sim->work;
    struct marked_rods rods = {sim->y, work->kick, plan->particles, work->scratch};
    if (sharing(sim)) {
        sharing_reflect_marked(sim, &rods);
        return;
    }
    for (int64_t lane = 0; lane < sim->lanes; lane++) {
        if (plan->walls)
            reflect_walls_marked(&rods, plan->low, plan->low + plan->free_length);
        else
            ring_sort_marked(&rods, plan->free_length);
        rods.y += arena_whole(plan->particles);
        rods.mark += arena_whole(plan->particles);
    }
}

/* A large ring keeps no rows of noise. */
static void kick_part(void *of, int64_t part)
{
    const struct sim *sim = of;
    const struct lm_work *work = sim->work;
    const struct stretch rods = sharing_stretch(sim, part);
    const int64_t count = rods.room - rods.first;
    double *y = sim->y + rods.first, *kick = work->kick + rods.first;
    rods_kick(y, kick, NULL, 0, count);
    sharing_add_noise_within(sim, &sim->noise, half_noise(sim->plan), &rods, work->kick);
    rods_add(y, kick, 1, count);
}

static void kick(struct sim *sim, double noise)
{
    struct lm_work *work = sim->work;
    const int64_t whole = sim_rods(sim);
    if (sharing(sim)) {
        sharing_each(sim, kick_part, sim);
        return;
    }
    const double *row = noise_row(&work->noise, &sim->noise, sim->clock->tick);
    rods_kick(sim->y, work->kick, row, noise, whole);
    if (!row) {
        noise_add(&work->noise, &sim->noise, sim->clock->tick, noise, work->kick);
        rods_add(sim->y, work->kick, 1, whole);
    }
}

static void lm_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct lm_work *work = sim->work;
    const double drift = plan->mobility * plan->time_step, noise = half_noise(plan);
    for (int64_t t = 0; t < ticks; t++) {
        proposal_add_forces(sim, sim->y, drift, work->kick);
        kick(sim, noise);
        collide(sim);
        sim->clock->tick++;
    }
}

const struct method_type method_lm = {
    .part = {.name = "lm", .doc = "Leimkuhler-Matthews step by sorting, equilibrium averages only"},
    .lanes = true,
    .order = 1.5,
    .step_ns = 5,
    .sorts = true,
    .cannot = lm_cannot,
    .exact = lm_exact,
    .time_step = lm_time_step,
    .layout = lm_layout,
    .begin = lm_begin,
    .advance = lm_advance,
};
