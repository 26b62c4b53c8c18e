/* SPDX-License-Identifier: GPL-3.0-or-later
 * sim.c - see sim.h. */
#include "sim.h"
#include "sharing.h"
#include "kernels/elementary.h"
#include "theory/sampler.h"

#include <math.h>

enum { UNIFORMS_AT_ONCE = 64 };

void sim_layout_lanes(struct sim *sim, const struct plan *plan, int64_t lanes, struct arena *kept,
                      struct arena *scratch)
{
    const int64_t whole = arena_whole(plan->particles);
    sim->plan = plan;
    sim->lanes = lanes;
    sim->clock = arena_take(kept, (size_t)lanes * sizeof *sim->clock);
    sim->y = sim_take_rods(sim, kept);
    sim->offset = NULL;
    sim->parts = NULL;
    if (lanes == 1) {
        if (scratch && sharing_pays(plan))
            sharing_layout(sim, scratch);
        return;
    }
    double *offset = sim_take_rods(sim, scratch);
    for (int64_t i = 0; i < whole * lanes && offset; i++)
        offset[i] = (double)(i % whole) * plan->diameter;
    sim->offset = offset;
}

void sim_layout(struct sim *sim, const struct plan *plan, struct arena *kept)
{
    sim_layout_lanes(sim, plan, 1, kept, NULL);
}

/* The uniform numbers in (0, 1) of a realization's initial configuration, one after another. */
struct uniform_stream {
    const struct sim *sim;
    int64_t next;
    uint32_t words[4 * UNIFORMS_AT_ONCE];
};

static double next_uniform(void *ctx)
{
    struct uniform_stream *stream = ctx;
    int64_t at = stream->next % UNIFORMS_AT_ONCE;
    if (at == 0) {
        struct noise_key key = stream->sim->noise;
        key.stream = STREAM_INITIAL;
        philox_words(stream->words, stream->next, UNIFORMS_AT_ONCE, &key, 0);
    }
    stream->next++;
    const uint32_t *words = stream->words + 4 * at;
    uint64_t bits = (uint64_t)words[0] << 20 | words[1] >> 12; /* 52 bits */
    return ((double)bits + 0.5) * 0x1p-52;
}

/* Exactly uniform over all rings without overlap: rod 0 anywhere in [0, L), the N gaps uniform on
 * the simplex of sum ell (independent exponential numbers over their sum). */
static void place_uniform(struct sim *sim)
{
    const struct plan *plan = sim->plan;
    struct uniform_stream stream = {.sim = sim};
    int64_t n = plan->particles;
    double first = plan->length * next_uniform(&stream), sum = 0;
    for (int64_t i = 0; i < n; i++) {
        sum -= log_normal(next_uniform(&stream));
        sim->y[i] = sum; /* gaps 0 .. i */
    }
    double unit = plan->free_length / sum;
    for (int64_t i = n - 1; i > 0; i--)
        sim->y[i] = first + fmin(unit * sim->y[i - 1], plan->free_length);
    sim->y[0] = first;
}

/* The same between walls: N + 1 gaps, the first and the last to the walls. */
static void place_uniform_in_walls(struct sim *sim)
{
    const struct plan *plan = sim->plan;
    struct uniform_stream stream = {.sim = sim};
    int64_t n = plan->particles;
    double sum = 0;
    for (int64_t i = 0; i < n; i++) {
        sum -= log_normal(next_uniform(&stream));
        sim->y[i] = sum;
    }
    double unit = plan->free_length / (sum - log_normal(next_uniform(&stream)));
    for (int64_t i = 0; i < n; i++)
        sim->y[i] = plan->low + fmin(unit * sim->y[i], plan->free_length);
}

/* x[i] = (i + 1/2) L / N. */
static void place_lattice(struct sim *sim)
{
    const struct plan *plan = sim->plan;
    double gap = plan->free_length / (double)plan->particles;
    double first = 0.5 * plan->length / (double)plan->particles;
    for (int64_t i = 0; i < plan->particles; i++)
        sim->y[i] = first + gap * (double)i;
}

static enum bcd_status place_equilibrium(struct sim *sim, struct bcd_error *error)
{
    struct uniform_stream stream = {.sim = sim};
    const struct theory_uniforms uniforms = {
        .next = next_uniform, .ctx = &stream, .watch = sim->watch};
    return theory_sampler_draw(sim->plan->sampler, sim->y, &uniforms, error);
}

static enum bcd_status place(struct sim *sim, struct bcd_error *error)
{
    *sim->clock = (struct sim_clock){0, 0};
    if (sim->plan->initial == INITIAL_EQUILIBRIUM)
        return place_equilibrium(sim, error);
    if (sim->plan->initial == INITIAL_LATTICE)
        place_lattice(sim);
    else if (sim->plan->walls)
        place_uniform_in_walls(sim);
    else
        place_uniform(sim);
    return BCD_OK;
}

void sim_aim(struct sim *sim, int64_t realization)
{
    sim->noise = (struct noise_key){.seed = sim->plan->seed, .stream = STREAM_STEPS};
    sim->noise.realization = (uint32_t)realization;
    sim->noise.doubled = plan_ticks_per_step(sim->plan) > 1;
    sim->noise.all = true;
    while (INT64_C(1) << sim->noise.side < sim->lanes)
        sim->noise.side++;
}

enum bcd_status sim_begin(struct sim *sim, int64_t realization, struct bcd_error *error)
{
    enum bcd_status status = BCD_OK;
    sim_aim(sim, realization);
    for (int64_t i = 0; i < sim->lanes && status == BCD_OK; i++) {
        struct sim lane = sim_lane(sim, i);
        status = place(&lane, error);
    }
    return status;
}

static void recentre(const struct sim *sim)
{
    const double far = 64; /* lengths L: 6 of 53 bits are spent before we act */
    double length = sim->plan->length, turns = trunc(sim->y[0] / length);
    if (fabs(turns) < far || sim->plan->walls)
        return;
    for (int64_t i = 0; i < sim->plan->particles; i++)
        sim->y[i] -= turns * length;
    sim->clock->turns += (int64_t)turns;
}

void sim_recentre(struct sim *sim)
{
    for (int64_t i = 0; i < sim->lanes; i++) {
        struct sim lane = sim_lane(sim, i);
        recentre(&lane);
    }
}
