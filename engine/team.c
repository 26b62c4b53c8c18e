/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * team.c - runs side by side, see bcd.h. Each run is whole by itself: between calls, and whenever
 * it looks at its rods, it has them in its own memory, so that its checkpoint and its tally are
 * those of a run alone. Only for the steps in between do the rods of all of them stand in the lanes
 * of one simulation (sim.h).
 *
 * Runs go together while all of them make their first pass and are at one tick; else one that is
 * behind goes alone.
 */
#include "arena.h"
#include "part.h"
#include "run.h"
#include "scene.h"
#include "status.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double team_bytes = 32e6; /* of all its runs, so that many are no burden */
enum { LANES_RODS = 128 };             /* of all lanes together, at most */

struct bcd_team {
    int64_t count;
    struct bcd_run *run[LANES_MAX];
    /* Of more than one: */
    struct sim sim; /* a lane for each */
    struct arena rods, methods_own, scratch;
    bool taken; /* the rods stand in the lanes */
};

int64_t run_lanes(const struct plan *plan, int64_t count)
{
    int64_t lanes = 1;
    if (!plan->method->lanes)
        return 1;
    while (2 * lanes <= count && 2 * lanes <= LANES_MAX &&
           2 * lanes * arena_whole(plan->particles) <= LANES_RODS)
        lanes *= 2;
    return lanes;
}

int64_t bcd_scene_team(const struct bcd_scene *scene)
{
    const struct plan *plan = &scene->plan;
    int64_t count = plan->per_chunk == 1 ? run_lanes(plan, plan->chunks) : 1;
    struct bcd_estimate estimate;
    if (count == 1)
        return 1;
    bcd_scene_estimate(scene, &estimate);
    while (count > 1 && (double)count * estimate.run_bytes > team_bytes)
        count /= 2;
    return count;
}

/* ------------------------------------------------------------------ making */

static void lay_out(struct bcd_team *team, const struct plan *plan)
{
    team->rods.used = team->methods_own.used = team->scratch.used = 0;
    sim_layout_lanes(&team->sim, plan, team->count, &team->rods, &team->scratch);
    plan->method->layout(&team->sim, &team->methods_own, &team->scratch);
}

static bool allocate(struct arena *arena)
{
    if (arena->used == 0)
        return true;
    arena->bytes = aligned_alloc(ARENA_ALIGNMENT, arena->used);
    if (arena->bytes)
        memset(arena->bytes, 0, arena->used);
    return arena->bytes != NULL;
}

static enum bcd_status make_lanes(struct bcd_team *team, const struct plan *plan, int64_t first,
                                  struct bcd_error *error)
{
    lay_out(team, plan); /* counts */
    if (!allocate(&team->rods) || !allocate(&team->methods_own) || !allocate(&team->scratch))
        return error_set(error, BCD_NO_MEMORY, "", "no memory for a team of runs");
    lay_out(team, plan);
    sim_aim(&team->sim, first);
    return BCD_OK;
}

enum bcd_status bcd_team_create(struct bcd_team **out, const struct bcd_team_wanted *wanted,
                                struct bcd_error *error)
{
    const struct bcd_scene *scene = wanted->scene;
    const int64_t count = wanted->count;
    assert(count >= 1 && count <= bcd_scene_team(scene) && (count & (count - 1)) == 0);
    struct bcd_team *team = calloc(1, sizeof *team);
    if (!team)
        return error_set(error, BCD_NO_MEMORY, "", "no memory for a team of runs");
    enum bcd_status status = BCD_OK;
    while (status == BCD_OK && team->count < count) {
        status = bcd_run_create_watched(&team->run[team->count], scene, wanted->first + team->count,
                                        wanted->watch, error);
        team->count += status == BCD_OK;
    }
    if (status == BCD_OK && count > 1)
        status = make_lanes(team, &scene->plan, wanted->first, error);
    if (status) {
        bcd_team_free(team);
        return status;
    }
    *out = team;
    return BCD_OK;
}

void bcd_team_free(struct bcd_team *team)
{
    if (!team)
        return;
    for (int64_t i = 0; i < team->count; i++)
        bcd_run_free(team->run[i]);
    free(team->rods.bytes);
    free(team->methods_own.bytes);
    free(team->scratch.bytes);
    free(team);
}

struct bcd_run *bcd_team_run(const struct bcd_team *team, int64_t index)
{
    assert(index >= 0 && index < team->count);
    return team->run[index];
}

int64_t bcd_team_count(const struct bcd_team *team)
{
    return team->count;
}

int64_t bcd_team_ticks_done(const struct bcd_team *team)
{
    int64_t ticks = 0;
    for (int64_t i = 0; i < team->count; i++)
        ticks += bcd_run_ticks_done(team->run[i]);
    return ticks;
}

int64_t bcd_team_ticks_total(const struct bcd_team *team)
{
    int64_t ticks = 0;
    for (int64_t i = 0; i < team->count; i++)
        ticks += bcd_run_ticks_total(team->run[i]);
    return ticks;
}

/* ---------------------------------------------------------------- together */

static void copy(void *to, void *from, size_t size, bool back)
{
    memcpy(back ? from : to, back ? to : from, size);
}

/* The rods into the lanes, or back from there. What a method with lanes keeps are numbers for rods
 * (part.h): of all lanes in the team's memory, of one in the run's. */
static void exchange(struct bcd_team *team, bool back)
{
    const int64_t whole = arena_whole(team->sim.plan->particles);
    const size_t bytes = (size_t)whole * sizeof(double), all = bytes * (size_t)team->count;
    for (int64_t lane = 0; lane < team->count; lane++) {
        size_t size;
        unsigned char *own = run_methods_own(team->run[lane], &size);
        copy(team->sim.y + lane * whole, run_sim(team->run[lane])->y, bytes, back);
        for (size_t at = 0, from = 0; at < size;
             at += arena_rounded(bytes), from += arena_rounded(all))
            copy(team->methods_own.bytes + from + (size_t)lane * bytes, own + at, bytes, back);
    }
    team->taken = !back;
}

/* All at one tick of their first pass? */
static bool abreast(const struct bcd_team *team)
{
    const int64_t tick = run_sim(team->run[0])->clock->tick;
    for (int64_t i = 0; i < team->count; i++)
        if (!run_in_first_pass(team->run[i]) || run_sim(team->run[i])->clock->tick != tick)
            return false;
    return team->count > 1;
}

/* Up to the next tick at which one of them looks, or about `most` ticks of all of them. */
static enum bcd_status advance_all(struct bcd_team *team, int64_t most, int64_t *gone,
                                   struct bcd_error *error)
{
    const int64_t tick = run_sim(team->run[0])->clock->tick;
    int64_t next[LANES_MAX], stop = tick + (most + team->count - 1) / team->count;
    enum bcd_status status = BCD_OK;
    for (int64_t i = 0; i < team->count; i++) {
        next[i] = run_next_stop(team->run[i]);
        stop = next[i] < stop ? next[i] : stop;
    }
    if (!team->taken)
        exchange(team, false);
    team->sim.clock->tick = tick;
    team->sim.plan->method->advance(&team->sim, stop - tick);
    *gone = (stop - tick) * team->count;
    for (int64_t i = 0; i < team->count; i++)
        run_sim(team->run[i])->clock->tick = stop;
    for (int64_t i = 0; status == BCD_OK && i < team->count; i++) {
        if (next[i] != stop)
            continue;
        if (team->taken)
            exchange(team, true);
        status = run_arrive(team->run[i], error);
    }
    return status;
}

/* --------------------------------------------------------------- and apart */

/* The one that is furthest behind, up to where the next one is, or `most` ticks. */
static enum bcd_status advance_one(struct bcd_team *team, int64_t most, int64_t *gone,
                                   struct bcd_error *error)
{
    struct bcd_run *last = NULL;
    int64_t least = INT64_MAX, next = INT64_MAX;
    for (int64_t i = 0; i < team->count; i++) {
        int64_t done = bcd_run_ticks_done(team->run[i]);
        if (done == bcd_run_ticks_total(team->run[i]))
            continue;
        if (done < least) {
            next = least;
            least = done;
            last = team->run[i];
        } else if (done > least && done < next) {
            next = done;
        }
    }
    assert(last);
    most = next - least < most ? next - least : most;
    enum bcd_status status = bcd_run_advance(last, most, error);
    *gone = bcd_run_ticks_done(last) - least;
    return status;
}

enum bcd_status bcd_team_advance(struct bcd_team *team, int64_t ticks, struct bcd_error *error)
{
    enum bcd_status status = BCD_OK;
    while (status == BCD_OK && ticks > 0 &&
           bcd_team_ticks_done(team) < bcd_team_ticks_total(team)) {
        int64_t gone = 0;
        status = abreast(team) ? advance_all(team, ticks, &gone, error)
                               : advance_one(team, ticks, &gone, error);
        ticks -= gone;
    }
    if (team->taken)
        exchange(team, true);
    return status;
}
