/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * run.c - a chunk of realizations in motion: initial configuration, equilibration, measured blocks,
 * one realization after another or, in small rings, a few of them side by side (sim.h), cut
 * anywhere. See bcd.h. Paired realizations make a second pass with twice the time step, each alone;
 * what it measures is tallied as its difference from the first.
 *
 * INVARIANT  Between calls everything due at or before the current tick has happened; what is due
 *            next is a function of the kept memory. So a checkpoint is a copy of the kept arena.
 */
#include "arena.h"
#include "blob.h"
#include "nominal.h"
#include "plan_step.h"
#include "run.h"
#include "scene.h"
#include "status.h"
#include "step_error.h"
#include "tally.h"
#include "watch.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    OBSERVERS_MAX = VIEWS * SCENE_PARTS_MAX,
    RECENTRE_STEPS = 1 << 16,
};

/* Kept in checkpoints. */
struct progress {
    int64_t realization; /* within the chunk; with several lanes the first of them */
    int64_t block;       /* of the pass */
    int64_t second_pass; /* with twice the time step: 1 + lane that makes it; 0 = first pass */
};

struct bcd_run {
    const struct bcd_scene *scene;
    const struct plan *plan;
    int64_t first, count; /* realizations of this chunk */
    int64_t lanes;        /* at most so many side by side */
    struct sim sim;
    struct progress *progress;
    struct observer observers[OBSERVERS_MAX]; /* of the first lane */
    size_t apart[OBSERVERS_MAX];              /* bytes from one lane's memory to the next's */
    int64_t due[OBSERVERS_MAX][LANES_MAX];    /* measured ticks; from kept memory alone */
    size_t first_pass, observer_count; /* those of the second pass follow those of the first */
    struct bcd_tally tally;
    double *values; /* [tally.count] of the block that ends, scratch */
    double *paired; /* [lanes][blocks of a second pass][tally.count] of the first pass, kept */
    struct arena kept, scratch;
    size_t methods_own;      /* where in `kept` that of the method begins: the last of it */
    struct bcd_watch *watch; /* may be NULL */
    double watched_bytes;    /* that it knows of */
    enum bcd_status status;  /* not OK: a realization could not begin */
};

/* ------------------------------------------------------------------ making */

/* How many of the chunk's first `realizations` realizations make a second pass. */
static int64_t paired_among(const struct bcd_run *run, int64_t realizations)
{
    int64_t paired = 0;
    for (int64_t i = 0; i < realizations; i++)
        paired += plan_is_paired(run->plan, run->first + i);
    return paired;
}

/* `count` values, written from `first` on. */
static void add_observer(struct bcd_run *run, const struct scene_part *part,
                         const struct plan *plan, size_t count, size_t first)
{
    const bool alone = plan != run->plan;
    const struct observable_type *type = scene_observable_type(part);
    const void *par = part->group.values;
    struct observer *o = &run->observers[run->observer_count];
    *o = (struct observer){.type = type, .par = par, .plan = plan, .first = first};
    o->view = type->mid_drift ? VIEW_MID_DRIFT : VIEW_MID_NOISE;
    o->count = count;
    const size_t before = run->kept.used, size = type->memory(par, plan);
    o->memory = arena_take(&run->kept, size);
    run->apart[run->observer_count++] = run->kept.used - before;
    for (int64_t lane = 1; lane < run->lanes && !alone; lane++)
        arena_take(&run->kept, size);
}

/* The number of values of a sample, second sections included. */
static size_t lay_out_first_pass(struct bcd_run *run)
{
    size_t values = 0;
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(run->scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        size_t sections = step_error_sections(type, run->plan);
        bool views = step_error_of(type, run->plan) == STEP_ERROR_VIEWS;
        const size_t count = type->count(part->group.values, run->plan);
        for (size_t view = 0; view < (views ? sections : 1); view++) {
            add_observer(run, part, run->plan, count, values + view * count);
            if (views)
                run->observers[run->observer_count - 1].view = (enum view)view;
        }
        values += sections * count;
    }
    return values;
}

/* Observers of the pairs, each writing into the second section of its observable. */
static void lay_out_second_pass(struct bcd_run *run)
{
    size_t values = 0;
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(run->scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        size_t count = type->count(part->group.values, run->plan);
        if (step_error_of(type, run->plan) == STEP_ERROR_PAIR) {
            assert(type->count(part->group.values, &run->scene->coarse) == count);
            add_observer(run, part, &run->scene->coarse, count, values + count);
        }
        values += step_error_sections(type, run->plan) * count;
    }
}

static void lay_out(struct bcd_run *run)
{
    const struct plan *plan = run->plan;
    run->kept.used = run->scratch.used = 0;
    run->progress = arena_take(&run->kept, sizeof *run->progress);
    run->lanes = run_lanes(plan, run->count);
    sim_layout_lanes(&run->sim, plan, run->lanes, &run->kept, &run->scratch);
    run->observer_count = 0;
    size_t values = lay_out_first_pass(run);
    run->first_pass = run->observer_count;
    if (paired_among(run, run->count) > 0) {
        lay_out_second_pass(run);
        run->paired = arena_take(&run->kept, (size_t)(run->lanes * run->scene->coarse.blocks) *
                                                 values * sizeof *run->paired);
    }
    tally_layout(&run->tally, run->scene, values, &run->kept);
    run->values = arena_take(&run->scratch, values * sizeof *run->values);
    run->methods_own = run->kept.used;
    plan->method->layout(&run->sim, &run->kept, &run->scratch);
}

static enum bcd_status begin_realization(struct bcd_run *run, struct bcd_error *error);

enum bcd_status bcd_run_create(struct bcd_run **out, const struct bcd_scene *scene, int64_t chunk,
                               struct bcd_error *error)
{
    return bcd_run_create_watched(out, scene, chunk, NULL, error);
}

enum bcd_status bcd_run_create_watched(struct bcd_run **out, const struct bcd_scene *scene,
                                       int64_t chunk, struct bcd_watch *watch,
                                       struct bcd_error *error)
{
    const struct plan *plan = &scene->plan;
    assert(scene->complete && chunk >= 0 && chunk < plan->chunks);
    assert(plan->initial != INITIAL_EQUILIBRIUM || plan->sampler); /* prepared */
    struct bcd_run *run = calloc(1, sizeof *run);
    if (!run)
        return error_set(error, BCD_NO_MEMORY, "", "no memory for a run");
    run->scene = scene;
    run->plan = plan;
    run->first = chunk * plan->per_chunk;
    int64_t left = plan->realizations - run->first;
    run->count = left < plan->per_chunk ? left : plan->per_chunk;
    run->watch = run->sim.watch = watch;
    lay_out(run); /* counts */
    size_t kept = run->kept.used, scratch = run->scratch.used;
    run->watched_bytes = (double)kept + (double)scratch;
    if (!watch_take(watch, run->watched_bytes)) {
        bcd_run_free(run);
        return watch_stopped(watch, error);
    }
    run->kept.bytes = aligned_alloc(ARENA_ALIGNMENT, kept);
    run->scratch.bytes = aligned_alloc(ARENA_ALIGNMENT, scratch);
    if (!run->kept.bytes || !run->scratch.bytes) {
        bcd_run_free(run);
        return error_set(error, BCD_NO_MEMORY, "", "a run of %zu bytes does not fit in memory",
                         kept + scratch);
    }
    memset(run->kept.bytes, 0, kept);
    lay_out(run);
    enum bcd_status status = begin_realization(run, error);
    if (status) {
        bcd_run_free(run);
        return status;
    }
    *out = run;
    return BCD_OK;
}

void bcd_run_free(struct bcd_run *run)
{
    if (!run)
        return;
    watch_take(run->watch, -run->watched_bytes);
    free(run->kept.bytes);
    free(run->scratch.bytes);
    free(run);
}

/* --------------------------------------------------------------- advancing */

static int64_t ticks_of_pass(const struct plan *plan)
{
    return plan->equilibration_steps + plan->steps;
}

/* Ticks of the chunk's first `realizations` realizations, second passes included. */
static int64_t ticks_of(const struct bcd_run *run, int64_t realizations)
{
    int64_t paired = paired_among(run, realizations);
    return realizations * ticks_of_pass(run->plan) +
           (paired > 0 ? paired * ticks_of_pass(&run->scene->coarse) : 0);
}

/* The observers of the pass in motion: from *first up to the number returned. */
static size_t pass_observers(const struct bcd_run *run, size_t *first)
{
    *first = run->progress->second_pass ? run->first_pass : 0;
    return run->progress->second_pass ? run->observer_count : run->first_pass;
}

static bool finished(const struct bcd_run *run)
{
    return run->progress->realization == run->count;
}

/* How many realizations make their first pass together: as many lanes as there are, or of what is
 * left a power of two. */
static int64_t group(const struct bcd_run *run)
{
    int64_t lanes = run->lanes;
    while (lanes > run->count - run->progress->realization)
        lanes /= 2;
    return lanes;
}

/* The realization of the job that the first lane is about. */
static int64_t leading(const struct bcd_run *run)
{
    const struct progress *progress = run->progress;
    return run->first + progress->realization +
           (progress->second_pass ? progress->second_pass - 1 : 0);
}

static void choose_pass(struct bcd_run *run)
{
    const bool second = run->progress->second_pass != 0;
    run->sim.plan = second ? &run->scene->coarse : run->plan;
    run->sim.lanes = second ? 1 : group(run);
    sim_aim(&run->sim, leading(run));
}

static struct observer observer_of(const struct bcd_run *run, size_t i, int64_t lane)
{
    struct observer o = run->observers[i];
    o.memory = (char *)o.memory + (size_t)lane * run->apart[i];
    return o;
}

/* The next measured tick > after at which the observer looks. */
static int64_t next_look(const struct bcd_run *run, const struct observer *o, int64_t after)
{
    if (!o->type->sample)
        return INT64_MAX;
    if (o->type->next)
        return o->type->next(o, after);
    int64_t every = run->sim.plan->sample_steps;
    return (after / every + 1) * every;
}

static void schedule(struct bcd_run *run)
{
    int64_t now = sim_measured(&run->sim);
    size_t first, end = pass_observers(run, &first);
    for (size_t i = first; i < end; i++)
        for (int64_t lane = 0; lane < run->sim.lanes; lane++) {
            const struct observer o = observer_of(run, i, lane);
            run->due[i][lane] = now < 0 ? INT64_MAX : next_look(run, &o, now);
        }
}

static void begin_measurement(struct bcd_run *run)
{
    run->progress->block = 0;
    size_t first, end = pass_observers(run, &first);
    for (int64_t lane = 0; lane < run->sim.lanes; lane++) {
        struct sim sim = sim_lane(&run->sim, lane);
        for (size_t i = first; i < end; i++) {
            struct observer o = observer_of(run, i, lane);
            sim.seen = o.type->mid_drift && step_error_views_used(run->plan)
                           ? run->plan->method->view(&sim, VIEW_MID_DRIFT)
                           : sim.y;
            o.type->begin(&o, &sim);
        }
    }
    schedule(run);
}

static enum bcd_status begin_realization(struct bcd_run *run, struct bcd_error *error)
{
    choose_pass(run);
    enum bcd_status status = sim_begin(&run->sim, leading(run), error);
    if (status)
        return status;
    if (run->plan->method->begin)
        run->plan->method->begin(&run->sim);
    if (run->sim.plan->equilibration_steps == 0)
        begin_measurement(run);
    else
        schedule(run);
    return BCD_OK;
}

/* What the first pass of a lane measured in the block. */
static double *first_values(const struct bcd_run *run, int64_t lane)
{
    int64_t row = lane * run->scene->coarse.blocks + run->progress->block;
    return run->paired + (size_t)row * run->tally.count;
}

/* Takes off what the first pass of the same realization measured in this block. */
static void subtract_first_pass(const struct bcd_run *run, const struct observer *o)
{
    const double *before = first_values(run, run->progress->second_pass - 1);
    for (size_t i = o->first; i < o->first + o->count; i++)
        run->values[i] -= before[i - o->count];
}

static void end_block_of(struct bcd_run *run, int64_t lane)
{
    const size_t count = run->tally.count;
    const struct sim sim = sim_lane(&run->sim, lane);
    for (size_t i = 0; i < count; i++)
        run->values[i] = NAN;
    size_t first, end = pass_observers(run, &first);
    for (size_t i = first; i < end; i++) {
        struct observer o = observer_of(run, i, lane);
        o.type->end_block(&o, &sim, run->values + o.first);
        if (run->progress->second_pass)
            subtract_first_pass(run, &o);
    }
    tally_add(&run->tally, run->values);
    if (run->paired && !run->progress->second_pass &&
        run->progress->block < run->scene->coarse.blocks)
        memcpy(first_values(run, lane), run->values, count * sizeof *run->values);
}

static void end_block(struct bcd_run *run)
{
    for (int64_t lane = 0; lane < run->sim.lanes; lane++)
        end_block_of(run, lane);
    run->progress->block++;
}

int64_t run_next_stop(const struct bcd_run *run)
{
    const struct plan *plan = run->sim.plan;
    int64_t tick = run->sim.clock->tick;
    int64_t stop = (tick / RECENTRE_STEPS + 1) * RECENTRE_STEPS;
    if (tick < plan->equilibration_steps)
        return stop < plan->equilibration_steps ? stop : plan->equilibration_steps;
    int64_t measured = plan_block_end(plan, run->progress->block);
    size_t first, end = pass_observers(run, &first);
    for (size_t i = first; i < end; i++)
        for (int64_t lane = 0; lane < run->sim.lanes; lane++)
            measured = run->due[i][lane] < measured ? run->due[i][lane] : measured;
    return stop < plan->equilibration_steps + measured ? stop
                                                       : plan->equilibration_steps + measured;
}

/* All observers of one view and lane that are due look. */
static void look(struct bcd_run *run, enum view view, int64_t lane, int64_t measured)
{
    struct sim sim = sim_lane(&run->sim, lane);
    sim.seen = step_error_views_used(run->plan) ? NULL : sim.y;
    size_t first, end = pass_observers(run, &first);
    for (size_t i = first; i < end; i++) {
        struct observer o = observer_of(run, i, lane);
        if (o.view != view || run->due[i][lane] != measured)
            continue;
        if (!sim.seen && (o.type->sample_ns || o.type->mid_drift))
            sim.seen = run->plan->method->view(&sim, view);
        o.type->sample(&o, &sim);
        run->due[i][lane] = next_look(run, &o, measured);
    }
}

/* After the last tick of a pass: the second pass of the first lane on that makes one, or the next
 * realizations. */
static enum bcd_status next_pass(struct bcd_run *run, struct bcd_error *error)
{
    struct progress *progress = run->progress;
    const int64_t lanes = group(run);
    int64_t lane = progress->second_pass;
    while (lane < lanes && !plan_is_paired(run->plan, run->first + progress->realization + lane))
        lane++;
    progress->second_pass = lane < lanes ? lane + 1 : 0;
    if (!progress->second_pass) {
        progress->realization += lanes;
        *run->tally.realizations += (double)lanes;
    }
    return finished(run) ? BCD_OK : begin_realization(run, error);
}

/* Does what is due at the current tick: looks, ends of blocks and realizations. */
static enum bcd_status attend(struct bcd_run *run, struct bcd_error *error)
{
    const struct plan *plan = run->sim.plan;
    int64_t measured = sim_measured(&run->sim);
    if (measured < 0)
        return BCD_OK;
    if (measured == 0) {
        begin_measurement(run);
        return BCD_OK;
    }
    for (int view = 0; view < VIEWS; view++)
        for (int64_t lane = 0; lane < run->sim.lanes; lane++)
            look(run, (enum view)view, lane, measured);
    if (measured == plan_block_end(plan, run->progress->block))
        end_block(run);
    return measured == plan->steps ? next_pass(run, error) : BCD_OK;
}

enum bcd_status run_arrive(struct bcd_run *run, struct bcd_error *error)
{
    run->status = attend(run, error);
    /* Last, so that looks see contacts across the seam as the method left them. */
    if (run->sim.clock->tick % RECENTRE_STEPS == 0)
        sim_recentre(&run->sim);
    return run->status;
}

enum bcd_status bcd_run_advance(struct bcd_run *run, int64_t ticks, struct bcd_error *error)
{
    while (ticks > 0 && !finished(run) && !run->status) {
        const int64_t lanes = run->sim.lanes, most = (ticks + lanes - 1) / lanes;
        int64_t go = run_next_stop(run) - run->sim.clock->tick;
        bool arrive = go <= most;
        go = arrive ? go : most;
        run->plan->method->advance(&run->sim, go);
        for (int64_t lane = 1; lane < lanes; lane++)
            run->sim.clock[lane].tick = run->sim.clock->tick;
        ticks -= go * lanes;
        if (arrive)
            run_arrive(run, error);
    }
    return run->status;
}

void bcd_run_lend_hands(struct bcd_run *run, const struct bcd_hands *hands)
{
    run->sim.hands = hands;
}

struct sim *run_sim(struct bcd_run *run)
{
    return &run->sim;
}

bool run_in_first_pass(const struct bcd_run *run)
{
    return !finished(run) && !run->progress->second_pass;
}

void *run_methods_own(const struct bcd_run *run, size_t *size)
{
    *size = run->kept.used - run->methods_own;
    return run->kept.bytes + run->methods_own;
}

int64_t bcd_run_ticks_done(const struct bcd_run *run)
{
    const struct progress *progress = run->progress;
    int64_t whole = ticks_of(run, progress->realization), tick = run->sim.clock->tick;
    if (finished(run))
        return whole;
    if (!progress->second_pass)
        return whole + group(run) * tick;
    whole += group(run) * ticks_of_pass(run->plan);
    for (int64_t lane = 0; lane + 1 < progress->second_pass; lane++)
        if (plan_is_paired(run->plan, run->first + progress->realization + lane))
            whole += ticks_of_pass(&run->scene->coarse);
    return whole + tick;
}

int64_t bcd_run_ticks_total(const struct bcd_run *run)
{
    return ticks_of(run, run->count);
}

const struct bcd_tally *bcd_run_tally(const struct bcd_run *run)
{
    assert(finished(run));
    return &run->tally;
}

enum bcd_status bcd_run_continue(struct bcd_run *run, const struct bcd_tally *tally,
                                 struct bcd_error *error)
{
    double done = *tally->realizations;
    if (tally->identity != run->tally.identity)
        return error_set(error, BCD_CORRUPT, "", "the tally belongs to another job");
    if (run->plan->realizations < 2 || !(done >= 0 && done <= (double)run->count))
        return error_set(error, BCD_CORRUPT, "",
                         "a tally of %.17g realizations is not how a run of %lld begins", done,
                         (long long)run->count);
    tally_copy(&run->tally, tally);
    *run->progress = (struct progress){.realization = (int64_t)done};
    return finished(run) ? BCD_OK : begin_realization(run, error);
}

/* -------------------------------------------------------------- checkpoint */

static uint64_t checkpoint_identity(const struct bcd_run *run)
{
    return blob_hash(&run->first, sizeof run->first, scene_identity(run->scene));
}

_Static_assert((int)BCD_CHECKPOINT_HEAD == (int)BLOB_HEADER_SIZE, "a checkpoint is a blob");

size_t bcd_run_checkpoint_size(const struct bcd_run *run)
{
    return BLOB_HEADER_SIZE + run->kept.used;
}

void bcd_run_save(const struct bcd_run *run, void *bytes)
{
    memcpy((char *)bytes + BLOB_HEADER_SIZE, run->kept.bytes, run->kept.used);
    blob_seal(bytes, BLOB_CHECKPOINT, checkpoint_identity(run), bcd_run_checkpoint_size(run));
}

size_t bcd_run_checkpoint_pieces(const struct bcd_run *run)
{
    return blob_pieces(bcd_run_checkpoint_size(run));
}

const void *bcd_run_checkpoint_piece(const struct bcd_run *run, size_t piece, size_t *size)
{
    size_t from = piece * BLOB_PIECE_SIZE, left = run->kept.used - from;
    assert(from < run->kept.used);
    *size = left < BLOB_PIECE_SIZE ? left : BLOB_PIECE_SIZE;
    return run->kept.bytes + from;
}

void bcd_run_checkpoint_head(const struct bcd_run *run, void *head, uint64_t *sums)
{
    const struct blob_pieces pieces = {.kind = BLOB_CHECKPOINT,
                                       .identity = checkpoint_identity(run),
                                       .size = bcd_run_checkpoint_size(run),
                                       .sums = sums};
    for (size_t i = 0; i < blob_pieces(pieces.size); i++) {
        size_t size;
        const void *piece = bcd_run_checkpoint_piece(run, i, &size);
        sums[i] = blob_piece_sum(piece, size);
    }
    blob_seal_pieces(head, &pieces);
}

enum bcd_status bcd_run_restore(struct bcd_run *run, const void *bytes, size_t size,
                                struct bcd_error *error)
{
    enum bcd_status status =
        blob_check(bytes, BLOB_CHECKPOINT, checkpoint_identity(run), size, error);
    if (status)
        return status;
    if (size != bcd_run_checkpoint_size(run))
        return error_set(error, BCD_CORRUPT, "", "a checkpoint of %zu bytes, %zu expected", size,
                         bcd_run_checkpoint_size(run));
    memcpy(run->kept.bytes, (const char *)bytes + BLOB_HEADER_SIZE, run->kept.used);
    if (!finished(run))
        choose_pass(run);
    schedule(run);
    return BCD_OK;
}

/* ---------------------------------------------------------------- estimate */

void bcd_scene_estimate(const struct bcd_scene *scene, struct bcd_estimate *estimate)
{
    const struct plan *plan = &scene->plan;
    struct bcd_run run = {.scene = scene, .plan = plan, .count = plan->per_chunk};
    lay_out(&run); /* counts only */
    double rod_steps = plan_rod_steps(scene, plan->realizations);
    double steps = rod_steps / (double)plan->particles, values = (double)run.tally.count;
    *estimate = (struct bcd_estimate){
        .run_bytes = 2.0 * (double)run.kept.used + (double)run.scratch.used,
        .result_bytes = 6.0 * sizeof(double) * values,
        .tally_bytes =
            (sizeof(double) * (3.0 * values + 1) + BLOB_HEADER_SIZE) * (double)plan->chunks,
        .steps = steps,
        .rod_steps = rod_steps,
        .core_seconds = nominal_seconds(scene, rod_steps),
    };
}
