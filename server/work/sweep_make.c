/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_make.h"
#include "job_admit.h"
#include "job_seeds.h"
#include "sweep_faults.h"

#include <pthread.h>
#include <sha2.h>
#include <stdlib.h>
#include <string.h>

enum {
    BUILDERS = 2,
    POINTS_PER_BUILDER = 500,
    BATCH_POINTS = 256,
    BATCHES = 16,
    SEEN = 64,
    SEEN_BYTES = 2048
};

/* A builder's until it is ready, then the taker's until that asks for the next. */
struct batch {
    struct sweep_point_new *points;
    size_t count, number;
    bool ready;
};

struct builder {
    struct sweep_make *make;
    struct sweep_walk *walk;
    struct bcd_scene_cache *cache;
    uint64_t seen[SEEN];     /* hashes of what the theories of late points depend on */
    struct job_seeds *seeds; /* of the last point made from its scene; NULL = not wanted */
    pthread_t thread;
    bool running;
};

/* THREADS  `mutex` guards claimed, taken (which the taker alone changes), stop, status, and of each
 *          batch number and ready. The hash is the taker's, walk, cache and seeds a builder's
 * own. The rest does not change. */
struct sweep_make {
    const struct sweep *sweep;
    struct queue *queue;
    struct sweep_source source;
    size_t points, step, batches; /* the n-th batch: the new ones of the points n * step .. */
    struct batch ring[BATCHES];
    struct builder builders[BUILDERS];
    pthread_mutex_t mutex;
    pthread_cond_t moved;
    size_t claimed, taken; /* batches */
    bool stop;
    enum bcd_status status;
    SHA2_CTX context;
    unsigned char hash[JOB_HASH_SIZE];
};

static bool begin(struct sweep_make *make, size_t points, size_t builders);
static enum store_status take(void *state, const struct sweep_point_new **points, size_t *count);
static bool await(struct sweep_make *make);
static void *build(void *builder);
static void build_batch(struct builder *builder, size_t number);
static enum bcd_status make_point(struct builder *builder, struct sweep_point_new *point);
static enum bcd_status make_job(struct builder *builder, struct job_new *job);
static bool shares_theory(struct builder *builder, const struct bcd_scene *scene);
static void batch_clear(struct batch *batch);

struct sweep_make *sweep_make_create(const struct sweep *sweep, struct queue *queue,
                                     const char *owner)
{
    struct sweep_make *make = calloc(1, sizeof(*make));
    bool large = sweep_points_new(sweep) >= BUILDERS * POINTS_PER_BUILDER;
    if (!make)
        return NULL;
    make->sweep = sweep;
    make->queue = queue;
    make->points = sweep_points(sweep);
    make->source = (struct sweep_source){
        .take = take, .state = make, .count = sweep_points_new(sweep), .hash = make->hash};
    make->step = large ? BATCH_POINTS : make->points + 1;
    make->batches = (make->points + make->step - 1) / make->step;
    pthread_mutex_init(&make->mutex, NULL);
    pthread_cond_init(&make->moved, NULL);
    SHA256Init(&make->context);
    SHA256Update(&make->context, (const uint8_t *)owner, strlen(owner) + 1);
    for (size_t a = 0; sweep_axis(sweep, a); a++)
        SHA256Update(&make->context, (const uint8_t *)sweep_axis(sweep, a),
                     strlen(sweep_axis(sweep, a)) + 1);
    if (!begin(make, large ? BATCH_POINTS : sweep_points_new(sweep), large ? BUILDERS : 1)) {
        sweep_make_free(make);
        return NULL;
    }
    if (make->batches > 0)
        await(make);
    return make;
}

void sweep_make_free(struct sweep_make *make)
{
    if (!make)
        return;
    pthread_mutex_lock(&make->mutex);
    make->stop = true;
    pthread_cond_broadcast(&make->moved);
    pthread_mutex_unlock(&make->mutex);
    for (size_t i = 0; i < BUILDERS; i++) {
        if (make->builders[i].running)
            pthread_join(make->builders[i].thread, NULL);
        job_seeds_free(make->builders[i].seeds);
        sweep_walk_free(make->builders[i].walk);
        bcd_scene_cache_free(make->builders[i].cache);
    }
    for (size_t i = 0; i < BATCHES; i++) {
        batch_clear(&make->ring[i]);
        free(make->ring[i].points);
    }
    pthread_cond_destroy(&make->moved);
    pthread_mutex_destroy(&make->mutex);
    free(make);
}

const struct sweep_source *sweep_make_source(const struct sweep_make *make)
{
    return &make->source;
}

enum bcd_status sweep_make_check(struct sweep_make *make, struct bcd_errors *errors)
{
    pthread_mutex_lock(&make->mutex);
    enum bcd_status status = make->status;
    pthread_mutex_unlock(&make->mutex);
    /* Nothing is wrong with those that were taken. */
    if (status == BCD_INVALID)
        status =
            sweep_faults(make->sweep, queue_limits(make->queue), make->taken * make->step, errors);
    return status;
}

/* The ring, and builders with what they need. Those of a small sweep, and those for whom there is
 * no thread, work when somebody waits: await. */
static bool begin(struct sweep_make *make, size_t points, size_t builders)
{
    for (size_t i = 0; i < BATCHES && i < make->batches; i++) {
        make->ring[i].points = calloc(points + 1, sizeof(*make->ring[i].points));
        if (!make->ring[i].points)
            return false;
    }
    for (size_t i = 0; i < builders; i++) {
        struct builder *builder = &make->builders[i];
        builder->make = make;
        builder->walk = sweep_walk_create(make->sweep, 0, 0);
        if (!builder->walk || bcd_scene_cache_create(&builder->cache) != BCD_OK)
            return false;
    }
    for (size_t i = 0; i < builders && builders > 1; i++)
        make->builders[i].running =
            pthread_create(&make->builders[i].thread, NULL, build, &make->builders[i]) == 0;
    return true;
}

static enum store_status take(void *state, const struct sweep_point_new **points, size_t *count)
{
    struct sweep_make *make = state;
    for (*count = 0; *count == 0 && make->taken < make->batches;) {
        if (!await(make))
            return STORE_CONFLICT;
        const struct batch *batch = &make->ring[make->taken % BATCHES];
        *points = batch->points;
        *count = batch->count;
        pthread_mutex_lock(&make->mutex);
        make->taken++;
        pthread_cond_broadcast(&make->moved);
        pthread_mutex_unlock(&make->mutex);
    }
    for (size_t i = 0; i < *count; i++)
        SHA256Update(&make->context, (*points)[i].job.hash, JOB_HASH_SIZE);
    if (*count == 0)
        SHA256Final(make->hash, &make->context);
    return STORE_OK;
}

/* Until the batch that is taken next is ready; false when there will be none. */
static bool await(struct sweep_make *make)
{
    const struct batch *batch = &make->ring[make->taken % BATCHES];
    bool alone = true;
    for (size_t i = 0; i < BUILDERS; i++)
        alone = alone && !make->builders[i].running;
    pthread_mutex_lock(&make->mutex);
    while (!(batch->ready && batch->number == make->taken) && make->status == BCD_OK) {
        if (!alone) {
            pthread_cond_wait(&make->moved, &make->mutex);
            continue;
        }
        make->claimed = make->taken + 1;
        pthread_mutex_unlock(&make->mutex);
        build_batch(&make->builders[0], make->taken);
        pthread_mutex_lock(&make->mutex);
    }
    bool sound = make->status == BCD_OK;
    pthread_mutex_unlock(&make->mutex);
    return sound;
}

/* Batch after batch. The one that was taken last is being read and not to be written over. */
static void *build(void *context)
{
    struct builder *builder = context;
    struct sweep_make *make = builder->make;
    pthread_mutex_lock(&make->mutex);
    while (!make->stop && make->status == BCD_OK && make->claimed < make->batches) {
        if (make->claimed + 1 >= make->taken + BATCHES) {
            pthread_cond_wait(&make->moved, &make->mutex);
            continue;
        }
        size_t number = make->claimed++;
        make->ring[number % BATCHES].ready = false;
        pthread_mutex_unlock(&make->mutex);
        build_batch(builder, number);
        pthread_mutex_lock(&make->mutex);
    }
    pthread_mutex_unlock(&make->mutex);
    return NULL;
}

static void build_batch(struct builder *builder, size_t number)
{
    struct sweep_make *make = builder->make;
    struct batch *batch = &make->ring[number % BATCHES];
    size_t first = number * make->step, end = first + make->step, point;
    enum bcd_status status = BCD_OK;
    batch_clear(batch);
    sweep_walk_move(builder->walk, first, end < make->points ? end : make->points);
    while (status == BCD_OK && sweep_walk_next(builder->walk, &point)) {
        status = make_point(builder, &batch->points[batch->count]);
        batch->count += status == BCD_OK;
    }
    pthread_mutex_lock(&make->mutex);
    batch->number = number;
    batch->ready = status == BCD_OK;
    make->status = make->status ? make->status : status;
    pthread_cond_broadcast(&make->moved);
    pthread_mutex_unlock(&make->mutex);
}

static enum bcd_status make_point(struct builder *builder, struct sweep_point_new *point)
{
    struct text place = {0};
    int64_t seed;
    bool alike = builder->seeds && sweep_walk_seed(builder->walk, &seed) &&
                 job_seeds_fit(builder->seeds, seed);
    enum bcd_status status = BCD_OK;
    if (!alike)
        status = make_job(builder, &point->job);
    else if (!job_seeds_fill(builder->seeds, seed, &point->job))
        status = BCD_NO_MEMORY;
    if (status != BCD_OK)
        return status;
    sweep_walk_add_place(builder->walk, &place);
    point->place = text_take(&place);
    if (point->place)
        return BCD_OK;
    free((char *)point->job.job);
    free((char *)point->job.derived);
    return BCD_NO_MEMORY;
}

/* From the scene, and remembers it where the next points have other seeds and nothing more. */
static enum bcd_status make_job(struct builder *builder, struct job_new *job)
{
    struct bcd_errors faults = {.count = 0};
    struct bcd_estimate estimate;
    struct bcd_scene *scene = NULL;
    job_seeds_free(builder->seeds);
    builder->seeds = NULL;
    struct queue *queue = builder->make->queue;
    const struct sweep_look look = {builder->walk, builder->cache, queue_limits(queue)};
    enum bcd_status status = sweep_faults_point(&look, &scene, &estimate, &faults);
    if (status != BCD_OK)
        goto cleanup;
    calibration_apply(queue_calibration(queue), scene, &estimate);
    double without_theory = estimate.core_seconds - estimate.theory_seconds;
    if (shares_theory(builder, scene))
        estimate.core_seconds = without_theory;
    if (!job_admit_fill(scene, &estimate, job)) {
        status = BCD_NO_MEMORY;
    } else if (sweep_walk_seeds(builder->walk)) {
        struct job_new next = *job; /* with the same theory */
        next.core_seconds = without_theory;
        builder->seeds = job_seeds_create(scene, &next);
    }
cleanup:
    bcd_scene_free(scene);
    return status;
}

/* Whether the theory of a point before is this one's, too (theory_cache.h). */
static bool shares_theory(struct builder *builder, const struct bcd_scene *scene)
{
    unsigned char bytes[SEEN_BYTES];
    size_t size = bcd_scene_encode_equilibrium(scene, bytes, sizeof(bytes));
    uint64_t hash = 0xcbf29ce484222325u;
    if (size > sizeof(bytes))
        return false;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ bytes[i]) * 0x100000001b3u;
    uint64_t *place = &builder->seen[(hash ^ hash >> 32) % SEEN];
    bool seen = *place == hash;
    *place = hash;
    return seen;
}

static void batch_clear(struct batch *batch)
{
    for (size_t i = 0; i < batch->count; i++) {
        free((char *)batch->points[i].job.job);
        free((char *)batch->points[i].job.derived);
        free((char *)batch->points[i].place);
    }
    batch->count = 0;
}
