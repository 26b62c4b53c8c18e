/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * metropolis - Metropolis Monte Carlo with the displacements of a Brownian step: one rod after
 * another tries x + sqrt(2 D h) n and stays where it is when that overlaps a neighbour or a wall,
 * else moves with probability min(1, exp(-(dU - f dx) / kT)) (doi 10.1063/1.1699114). Every move
 * keeps the equilibrium law, hence so does a sweep in fixed order: equilibrium averages are exact
 * for any time step and any number of rods. As dynamics right for short steps only: what is refused
 * slows rods down by O(sqrt h).
 */
#include "part.h"
#include "proposal.h"
#include "step_limit.h"
#include "kernels/elementary.h"

#include <math.h>

enum { BLOCKS_AT_ONCE = 64 };

/* Random words, one per rod and tick: those of `span` ticks are drawn at once. */
struct lots {
    uint32_t *words; /* [span][row] */
    int64_t span, row;
    int64_t batch;       /* which span of ticks they are of; -1 = none yet */
    int64_t realization; /* and whose */
};

struct metropolis_work {
    struct noise noise;
    double *jump; /* [N] */
    struct lots lots;
};

static const char *metropolis_cannot(const struct plan *plan)
{
    if (plan->temperature == 0)
        return "accepts moves by their energy over kT, which must not be 0";
    if (plan->free_length == 0 && plan->particles > 1)
        return "moves one rod at a time, for which a closed packing has no room";
    return NULL;
}

/* Where there is an equilibrium at all. */
static bool metropolis_exact(const struct plan *plan, bool dynamic)
{
    bool steady = !plan->field || plan->potential->steady(plan->potential_par);
    return !dynamic && steady && (plan->force == 0 || plan->walls);
}

/* Statics are exact: moves of about the width of a well and of a gap, most of which are accepted.
 * Dynamics: each rod is slowed down by the share of its moves that are refused, .4 of the step
 * times the slope of U/kT and .2 of the step over the gap. */
static struct step_limit metropolis_time_step(const struct plan *plan)
{
    struct step_limit limit = {INFINITY, "nothing"};
    const double refused = plan->tolerance / 0.4, slope_share = refused * refused / 2;
    double share = plan->asks_dynamics ? slope_share : 0.5;
    step_limit_rates(&limit, plan, share, share);
    double climb = (plan->asks_dynamics ? refused : 1) * plan->temperature / plan->slope;
    step_limit(&limit, climb * climb / (2 * plan->diffusion), "slope of the potential over kT");
    double gap = plan->free_length / (double)plan->particles;
    double reach = plan->asks_dynamics ? 5 * plan->tolerance * gap : gap;
    if (plan->particles > 1)
        step_limit(&limit, reach * reach / (2 * plan->diffusion), "mean gap between rods");
    return limit;
}

static void metropolis_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct metropolis_work work, *own = arena_take(scratch, sizeof *own);
    const int64_t n = sim->plan->particles;
    (void)kept;
    noise_layout(&work.noise, n, 1, scratch);
    work.jump = sim_take_rods(sim, scratch);
    int64_t blocks = normals_stride(n) / 4;
    work.lots = (struct lots){.span = blocks < BLOCKS_AT_ONCE ? BLOCKS_AT_ONCE / blocks : 1,
                              .row = 4 * blocks,
                              .batch = -1};
    work.lots.words =
        arena_take(scratch, (size_t)(work.lots.span * work.lots.row) * sizeof *work.lots.words);
    if (own)
        *own = work;
    sim->work = own;
}

/* ---------------------------------------------------------------- one move */

/* How far from rod i its k-th neighbour lies in reduced coordinates, on the right for side = 1, on
 * the left for side = -1; INFINITY where the line between walls ends. */
static double offset(const struct sim *sim, int64_t i, int64_t k, int side)
{
    const struct plan *plan = sim->plan;
    const int64_t n = plan->particles, at = i + side * k;
    if (at >= 0 && at < n)
        return side * (sim->y[at] - sim->y[i]);
    if (plan->walls)
        return INFINITY;
    return side * (sim->y[at - side * n] - sim->y[i]) + plan->free_length;
}

/* The move by dx ends between the neighbours, and between the walls. One rod alone on a ring meets
 * nobody. */
static bool fits(const struct sim *sim, int64_t i, double dx)
{
    const struct plan *plan = sim->plan;
    double to = sim->y[i] + dx;
    if (plan->walls && (to < plan->low || to > plan->low + plan->free_length))
        return false;
    return plan->particles == 1 || (dx <= offset(sim, i, 1, 1) && -dx <= offset(sim, i, 1, -1));
}

/* Energy of rod i with all rods on one side of it that are in range, were it moved by dx. */
static double side_energy(const struct sim *sim, int64_t i, double dx, int side)
{
    const struct plan *plan = sim->plan;
    const struct pair_type *pair = plan->pair;
    const double range = pair->range(plan->pair_par);
    const int64_t last = pair->nearest ? 1 : plan->particles - 1;
    double sum = 0;
    for (int64_t k = 1; k <= last; k++) {
        double distance = offset(sim, i, k, side) - side * dx + (double)k * plan->diameter;
        if (!(distance - plan->diameter <= range))
            break;
        sum += pair->energy(plan->pair_par, fmax(distance, plan->diameter), plan->temperature);
    }
    return sum;
}

static double field_energy(const struct sim *sim, double x)
{
    const struct plan *plan = sim->plan;
    const struct rods one = {.y = &x, .count = 1, .time = sim_time(sim)};
    return plan->potential->energy_sum(plan->potential_par, &one);
}

/* What the move costs: energy, less the work of the drag. */
static double cost(const struct sim *sim, int64_t i, double dx)
{
    const struct plan *plan = sim->plan;
    double sum = -plan->force * dx;
    if (plan->field) {
        double x = sim->y[i] + (double)i * plan->diameter;
        sum += field_energy(sim, x + dx) - field_energy(sim, x);
    }
    if (plan->pair) {
        sum += side_energy(sim, i, dx, 1) - side_energy(sim, i, 0, 1);
        sum += side_energy(sim, i, dx, -1) - side_energy(sim, i, 0, -1);
    }
    return sum;
}

/* The words of the current tick, [N]. */
static const uint32_t *lots_now(const struct sim *sim)
{
    struct lots *lots = &((struct metropolis_work *)sim->work)->lots;
    int64_t batch = sim->clock->tick / lots->span;
    if (batch != lots->batch || sim->noise.realization != lots->realization) {
        struct noise_key key = sim->noise;
        key.stream = STREAM_ACCEPT;
        philox_words(lots->words, 0, lots->span * lots->row / 4, &key, batch);
        lots->batch = batch;
        lots->realization = sim->noise.realization;
    }
    return lots->words + sim->clock->tick % lots->span * lots->row;
}

/* With probability min(1, exp(-exponent)). */
static bool accepted(double exponent, uint32_t lot)
{
    if (exponent <= 0)
        return true;
    return exponent < 100 && ((double)lot + 0.5) * 0x1p-32 < exp_bounded(-exponent);
}

/* ------------------------------------------------------------------- sweep */

static void metropolis_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct metropolis_work *work = sim->work;
    const int64_t n = plan->particles, whole = arena_whole(n);
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    const bool costs = plan->field || plan->pair || plan->force != 0;
    for (int64_t t = 0; t < ticks; t++) {
        for (int64_t i = 0; i < whole; i++)
            work->jump[i] = 0;
        noise_add(&work->noise, &sim->noise, sim->clock->tick, noise, work->jump);
        const uint32_t *lots = costs ? lots_now(sim) : NULL;
        for (int64_t i = 0; i < n; i++) {
            double dx = work->jump[i];
            if (fits(sim, i, dx) &&
                (!costs || accepted(cost(sim, i, dx) / plan->temperature, lots[i])))
                sim->y[i] += dx;
        }
        sim->clock->tick++;
    }
}

const struct method_type method_metropolis = {
    .part = {.name = "metropolis",
             .doc = "Metropolis Monte Carlo, exact equilibrium averages at any time step"},
    .order = 0.5,
    .step_ns = 75,
    .cannot = metropolis_cannot,
    .exact = metropolis_exact,
    .any_step = true,
    .time_step = metropolis_time_step,
    .layout = metropolis_layout,
    .advance = metropolis_advance,
};
