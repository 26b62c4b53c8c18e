/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * tao - contacts within a step in order of time, noise drawn anew after each (Tao, den Otter,
 * Dhont, Briels, doi 10.1063/1.2180251; compared in doi 10.1063/1.2719190). Read for rods on a line
 * as follows:
 *
 *   - Within a step every rod moves with constant velocity, its Euler displacement over h.
 *   - Where two neighbours meet at t < h, both get new displacements for the rest of the step, mu F
 *     (h - t) + sqrt(2 D (h - t)) n with fresh n; the rod on the right takes the larger of the two,
 *     so that they separate. At a wall: one new displacement, mirrored if it points into the wall.
 *   - After REDRAWS_MAX contacts of a pair in one step it is let through; what overlaps at the end
 *     of the step is reflected (resolve.h). Rods that jump over many others end like that.
 *
 * The time at which straight paths meet is not that at which Brownian paths do: unlike "elastic"
 * the scheme is not exact even for free rods.
 */
#include "part.h"
#include "proposal.h"
#include "resolve.h"
#include "step_limit.h"
#include "kernels/contact_queue.h"
#include "kernels/elementary.h"

#include <math.h>

enum { REDRAWS_MAX = 16, DRAWS_AT_ONCE = 64 };

/* Times count from 0 to 1 within a step. */
struct tao_work {
    struct noise noise;
    double *drift;   /* [N], mu F h */
    double *pace;    /* [N], displacement in a whole step at the present velocity */
    double *since;   /* [N], time at which y is meant: of the rod's last contact */
    double *scratch; /* [N] */
    int8_t *redraws; /* [pairs], contacts in this step */
    struct contact_queue queue;
    uint32_t words[4 * DRAWS_AT_ONCE]; /* of the redraws of one tick, in order */
    int64_t draws;
};

static const char *tao_cannot(const struct plan *plan)
{
    return plan->temperature == 0 ? "makes no contacts, which the limit without noise consists of"
                                  : NULL;
}

static struct step_limit tao_time_step(const struct plan *plan)
{
    struct step_limit limit = {INFINITY, "nothing"};
    step_limit_rates(&limit, plan, fmin(0.018 * tolerance_share(plan, 1), 0.5), 0.1);
    return limit;
}

/* Pair p: rods p - 1 and p. On a ring pair 0 lies across the seam; between walls pairs 0 and N are
 * a rod and a wall. */
static int64_t pairs_of(const struct plan *plan)
{
    return plan->walls ? plan->particles + 1 : plan->particles;
}

static void tao_layout(struct sim *sim, struct arena *kept, struct arena *scratch)
{
    struct tao_work work = {.draws = 0}, *own = arena_take(scratch, sizeof *own);
    size_t n = (size_t)sim->plan->particles, pairs = (size_t)pairs_of(sim->plan);
    (void)kept;
    noise_layout(&work.noise, sim->plan->particles, 1, scratch);
    work.drift = sim_take_rods(sim, scratch);
    work.pace = sim_take_rods(sim, scratch);
    work.since = sim_take_rods(sim, scratch);
    work.scratch = arena_take(scratch, n * sizeof *work.scratch);
    work.redraws = arena_take(scratch, pairs * sizeof *work.redraws);
    work.queue.time = arena_take(scratch, pairs * sizeof *work.queue.time);
    work.queue.heap = arena_take(scratch, pairs * sizeof *work.queue.heap);
    work.queue.place = arena_take(scratch, pairs * sizeof *work.queue.place);
    if (own)
        *own = work;
    sim->work = own;
}

/* ---------------------------------------------------------------- contacts */

/* One side of a pair: a rod, or a wall, which never moves. */
struct side {
    int64_t rod;  /* -1 = wall */
    double shift; /* added to the rod's y: ell across the seam */
    double at, pace;
};

static struct side side_at(const struct sim *sim, int64_t rod, double now)
{
    const struct plan *plan = sim->plan;
    const struct tao_work *work = sim->work;
    const int64_t n = plan->particles;
    struct side side = {.rod = rod};
    if (plan->walls && (rod < 0 || rod == n)) {
        side.rod = -1;
        side.at = rod < 0 ? plan->low : plan->low + plan->free_length;
        return side;
    }
    if (rod < 0) {
        side.rod = n - 1;
        side.shift = -plan->free_length;
    }
    side.pace = work->pace[side.rod];
    side.at = sim->y[side.rod] + side.pace * (now - work->since[side.rod]) + side.shift;
    return side;
}

/* When the pair meets next, as things stand `now`. */
static void foresee(struct sim *sim, int64_t pair, double now)
{
    struct tao_work *work = sim->work;
    double time = INFINITY;
    if (work->redraws[pair] < REDRAWS_MAX) {
        struct side left = side_at(sim, pair - 1, now), right = side_at(sim, pair, now);
        double gap = fmax(right.at - left.at, 0), closing = left.pace - right.pace;
        if (gap < closing * (1 - now))
            time = now + gap / closing;
    }
    contact_queue_set(&work->queue, pair, time < 1 ? time : INFINITY);
}

/* Two fresh normals of this tick. */
static void redraw(struct sim *sim, double normals[2])
{
    struct tao_work *work = sim->work;
    int64_t at = work->draws % DRAWS_AT_ONCE;
    if (at == 0) {
        struct noise_key key = sim->noise;
        key.stream = STREAM_REDRAW;
        philox_words(work->words, work->draws, DRAWS_AT_ONCE, &key, sim->clock->tick);
    }
    work->draws++;
    const uint32_t *words = work->words + 4 * at;
    double radius = sqrt(-2 * log_normal(((double)words[0] + 0.5) * 0x1p-32));
    double turn = (double)words[1] * 0x1p-32 - 0.5;
    normals[0] = radius * sin_half(turn);
    normals[1] = radius * cos_half(turn);
}

static void depart(struct sim *sim, const struct side *side, double from, double now)
{
    struct tao_work *work = sim->work;
    if (side->rod < 0)
        return;
    sim->y[side->rod] = from - side->shift;
    work->pace[side->rod] = side->pace;
    work->since[side->rod] = now;
}

/* The pair is in contact `now`: both go on from there with displacements drawn anew. */
static void meet(struct sim *sim, int64_t pair, double now)
{
    const struct plan *plan = sim->plan;
    struct tao_work *work = sim->work;
    struct side left = side_at(sim, pair - 1, now), right = side_at(sim, pair, now);
    const double noise = sqrt(2 * plan->diffusion * plan->time_step / (1 - now));
    double normals[2];
    redraw(sim, normals);
    double a = left.rod < 0 ? 0 : work->drift[left.rod] + noise * normals[0];
    double b = right.rod < 0 ? 0 : work->drift[right.rod] + noise * normals[1];
    left.pace = left.rod < 0 ? 0 : right.rod < 0 ? -fabs(a) : fmin(a, b);
    right.pace = right.rod < 0 ? 0 : left.rod < 0 ? fabs(b) : fmax(a, b);
    double where = right.rod < 0 ? right.at : left.at;
    depart(sim, &left, where, now);
    depart(sim, &right, where, now);
    work->redraws[pair]++;
}

/* All contacts within the step, in order of time. */
static void follow_contacts(struct sim *sim)
{
    const struct plan *plan = sim->plan;
    struct tao_work *work = sim->work;
    const int64_t pairs = pairs_of(plan);
    work->draws = 0;
    contact_queue_clear(&work->queue, pairs);
    for (int64_t p = 0; p < pairs; p++)
        work->redraws[p] = 0;
    for (int64_t p = 0; p < pairs; p++)
        foresee(sim, p, 0);
    for (int64_t p; (p = contact_queue_first(&work->queue)) >= 0;) {
        double now = work->queue.time[p];
        meet(sim, p, now);
        int64_t before = p > 0 ? p - 1 : plan->walls ? p : pairs - 1;
        int64_t after = p < pairs - 1 ? p + 1 : plan->walls ? p : 0;
        foresee(sim, before, now);
        foresee(sim, p, now);
        foresee(sim, after, now);
    }
}

/* -------------------------------------------------------------------- step */

static void tao_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct tao_work *work = sim->work;
    const int64_t n = plan->particles, whole = arena_whole(n);
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    const bool meets = plan->free_length > 0 && (n > 1 || plan->walls);
    for (int64_t t = 0; t < ticks; t++) {
        for (int64_t i = 0; i < whole; i++)
            work->drift[i] = work->since[i] = 0;
        proposal_add_forces(sim, sim->y, plan->mobility * plan->time_step, work->drift);
        sim_copy_rods(sim, work->pace, work->drift);
        noise_add(&work->noise, &sim->noise, sim->clock->tick, noise, work->pace);
        if (meets)
            follow_contacts(sim);
        for (int64_t i = 0; i < n; i++)
            sim->y[i] += work->pace[i] * (1 - work->since[i]);
        resolve_reflecting(sim, sim->y, work->scratch);
        sim->clock->tick++;
    }
}

const struct method_type method_tao = {
    .part = {.name = "tao", .doc = "contacts in order of time, noise drawn anew after each"},
    .order = 1,
    .step_ns = 20,
    .cannot = tao_cannot,
    .time_step = tao_time_step,
    .layout = tao_layout,
    .advance = tao_advance,
};
