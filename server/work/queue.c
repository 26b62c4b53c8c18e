/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue.c - handing out chunks; see queue.h for what is promised and queue_internal.h for how.
 */
#include "queue_internal.h"

#include "deadline.h"
#include "log.h"

#include <assert.h>
#include <search.h>
#include <sha2.h>
#include <stdlib.h>
#include <string.h>

enum { USUAL_BYTES = 4096 }; /* of a scene's encoding */

/* ------------------------------------------------------------------- identity */

typedef size_t encoder(const struct bcd_scene *scene, void *bytes, size_t size);

static bool digest(const struct bcd_scene *scene, encoder *encode,
                   unsigned char hash[JOB_HASH_SIZE])
{
    unsigned char usual[USUAL_BYTES], *bytes = usual;
    size_t size = encode(scene, usual, sizeof usual);
    SHA2_CTX context;

    static_assert(SHA256_DIGEST_LENGTH == JOB_HASH_SIZE, "the store keeps SHA-256");
    if (size > sizeof usual) {
        bytes = malloc(size);
        if (!bytes)
            return false;
        encode(scene, bytes, size);
    }
    SHA256Init(&context);
    SHA256Update(&context, bytes, size);
    SHA256Final(hash, &context);
    if (bytes != usual)
        free(bytes);
    return true;
}

bool queue_hash(const struct bcd_scene *scene, unsigned char hash[JOB_HASH_SIZE])
{
    return digest(scene, bcd_scene_encode, hash);
}

bool queue_family(const struct bcd_scene *scene, unsigned char family[JOB_HASH_SIZE])
{
    return digest(scene, bcd_scene_encode_family, family);
}

/* -------------------------------------------------------------------- lifetime */

enum store_status queue_create(struct queue **queue, struct store *store)
{
    struct queue *made = calloc(1, sizeof *made);

    if (!made)
        return STORE_BROKEN;
    made->calibration = calibration_create();
    made->theories = theory_cache_create();
    if (!made->calibration || !made->theories) {
        calibration_free(made->calibration);
        theory_cache_free(made->theories);
        free(made);
        return STORE_BROKEN;
    }
    made->limits = job_limits_usual();
    made->workers = 1;
    made->store = store;
    atomic_init(&made->stopping, false);
    pthread_mutex_init(&made->mutex, NULL);
    deadline_condition(&made->changed);
    *queue = made;
    return STORE_OK;
}

static void keep_node(void *node)
{
    (void)node; /* the entries themselves are freed with their owners */
}

void queue_free(struct queue *queue)
{
    if (!queue)
        return;
    pthread_mutex_lock(&queue->mutex);
    owner_save_usage(queue);
    pthread_mutex_unlock(&queue->mutex);
    calibration_free(queue->calibration);
    theory_cache_free(queue->theories);
    tdestroy(queue->index, keep_node);
    for (struct owner *owner = queue->owners, *next; owner; owner = next) {
        for (struct queued *entry = owner->first, *after; entry; entry = after) {
            after = entry->next;
            entry_free(entry);
        }
        next = owner->next;
        free(owner);
    }
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->mutex);
    free(queue);
}

struct calibration *queue_calibration(struct queue *queue)
{
    return queue->calibration;
}

struct theory_cache *queue_theories(struct queue *queue)
{
    return queue->theories;
}

void queue_set_limits(struct queue *queue, const struct job_limits *limits)
{
    queue->limits = *limits;
}

const struct job_limits *queue_limits(const struct queue *queue)
{
    return &queue->limits;
}

void queue_set_workers(struct queue *queue, size_t count)
{
    queue->workers = count;
}

/* --------------------------------------------------------------------- claiming */

void queue_take(struct queue *queue, const char *name)
{
    struct owner *owner;

    pthread_mutex_lock(&queue->mutex);
    owner = owner_find(queue, name);
    if (owner) {
        if (!owner->waiting && !owner->first)
            owner->greeted = false;
        owner->waiting = true;
        owner->news++;
        owner->head_known = false;
        queue_changed(queue);
    } else {
        log_write(LOG_LEVEL_ERROR, "jobs_not_taken", LOG_FIELDS(log_text("owner", name)));
    }
    pthread_mutex_unlock(&queue->mutex);
}

/* One step towards a chunk of the owner whose turn it is; true when the task is filled. */
static bool work_on(struct queue *queue, struct owner *owner, bool jumps, struct task *task)
{
    struct queued *entry = owner_entry(owner);

    if (owner_may_start(owner) && !owner->head_known) {
        start_ask(queue, owner);
    } else if (owner_may_start(owner) && (!entry || owner->head.priority > entry->priority)) {
        start_head(queue, owner);
    } else if (entry->resumes) {
        start_again(queue, entry);
    } else if (entry_claim(queue, entry, task)) {
        owner->greeted = true;
        queue->jumped = jumps;
        return true;
    } else {
        start_wait(queue);
    }
    return false;
}

void queue_set_idle(struct queue *queue, bool (*idle)(void *context, unsigned news), void *context)
{
    queue->idle = idle;
    queue->idle_context = context;
}

unsigned queue_news(const struct queue *queue)
{
    return atomic_load(&queue->news);
}

void queue_tell_idle(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    queue_changed(queue);
    pthread_mutex_unlock(&queue->mutex);
}

/* There is nothing to claim: whether the worker had something else to do. Jobs that rest are not
 * news when they have rested: then it waits. */
static bool spend_time(struct queue *queue)
{
    const unsigned news = atomic_load(&queue->news);
    bool spent;

    if (!queue->idle || owner_resting(queue))
        return false;
    pthread_mutex_unlock(&queue->mutex);
    spent = queue->idle(queue->idle_context, news);
    pthread_mutex_lock(&queue->mutex);
    return spent || atomic_load(&queue->news) != news;
}

bool queue_claim(struct queue *queue, struct task *task)
{
    bool claimed = false;

    pthread_mutex_lock(&queue->mutex);
    while (!claimed && !atomic_load(&queue->stopping)) {
        bool jumps = false;
        struct owner *owner = owner_choose(queue, &jumps);

        if (!owner && !spend_time(queue))
            start_rested(queue);
        else if (!owner)
            continue;
        else if (owner->asking)
            pthread_cond_wait(&queue->changed, &queue->mutex);
        else
            claimed = work_on(queue, owner, jumps, task);
    }
    pthread_mutex_unlock(&queue->mutex);
    return claimed;
}

void queue_put_off(struct queue *queue, struct task *task)
{
    struct queued *entry = task->entry;

    pthread_mutex_lock(&queue->mutex);
    entry->aside = true;
    entry->pinned = false;
    task->entry = NULL;
    entry_release(queue, entry);
    queue_changed(queue);
    pthread_mutex_unlock(&queue->mutex);
}

bool queue_claim_finish(struct queue *queue, size_t threads, struct task *task)
{
    struct queued *entry = NULL;

    pthread_mutex_lock(&queue->mutex);
    while (!atomic_load(&queue->stopping) && !(entry = owner_finish(queue, threads)))
        pthread_cond_wait(&queue->changed, &queue->mutex);
    if (entry) {
        entry_claim(queue, entry, task); /* of all chunks: it needs no memory */
        queue_changed(queue);            /* another job may be begun */
    }
    pthread_mutex_unlock(&queue->mutex);
    return entry != NULL;
}

void queue_done(struct queue *queue, struct task *task, bool *last)
{
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = entry_drop_claim(task, CHUNK_DONE);
    *last = entry->chunks_done == entry->chunks && !entry->ended;
    if (*last)
        entry->pinned = true; /* until queue_forget */
    else
        task->entry = NULL;
    entry_release(queue, entry);
    queue_changed(queue); /* there may be room for finishing a job */
    pthread_mutex_unlock(&queue->mutex);
}

void queue_forget(struct queue *queue, const char *id)
{
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = entry_find(queue, id);
    if (entry) {
        entry->pinned = false;
        entry->ended = true;
        if (entry->aside) /* another may be finished, or begun */
            queue_changed(queue);
        entry_release(queue, entry);
    }
    pthread_mutex_unlock(&queue->mutex);
}

enum store_status queue_again(struct queue *queue, struct task *task, int64_t least,
                              double expected)
{
    struct queued *entry = task->entry;
    double progress, from;
    enum store_status status;

    pthread_mutex_lock(&queue->mutex);
    assert(entry && entry->pinned && !entry->claims);
    progress = entry_progress(entry);
    from = (double)entry->chunks_done;
    pthread_mutex_unlock(&queue->mutex);
    status = entry_read_goal(queue, entry, least);
    if (status)
        return status;
    pthread_mutex_lock(&queue->mutex);
    if (expected > 0) {
        entry->progress = progress;
        entry->from = from;
        entry->to = expected > from + 1 ? expected : from + 1;
    }
    entry->pinned = entry->aside = false;
    task->entry = NULL;
    entry_release(queue, entry);
    queue_changed(queue);
    pthread_mutex_unlock(&queue->mutex);
    return STORE_OK;
}

void queue_release(struct queue *queue, struct task *task)
{
    pthread_mutex_lock(&queue->mutex);
    task->entry = NULL;
    entry_release(queue, entry_drop_claim(task, CHUNK_FREE));
    queue_changed(queue);
    pthread_mutex_unlock(&queue->mutex);
}

bool queue_gives_way(struct queue *queue, const struct task *task)
{
    bool gives_way;

    if (task->count == 1)
        return false;
    pthread_mutex_lock(&queue->mutex);
    gives_way = owner_gives_way(queue, task->owner);
    pthread_mutex_unlock(&queue->mutex);
    return gives_way;
}

void queue_cancel(struct queue *queue, const char *id)
{
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = entry_find(queue, id);
    if (entry) {
        atomic_store(&entry->cancelled, true);
        entry->ended = true;
        entry_release(queue, entry);
        /* Those who wait for it to start can turn to the next one. */
        queue_changed(queue);
    }
    pthread_mutex_unlock(&queue->mutex);
}

/* -------------------------------------------------------------------- looking */

double queue_progress(struct queue *queue, const char *id)
{
    double progress = -1.0;
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = entry_find(queue, id);
    if (entry && !entry->ended && entry->started)
        progress = entry_progress(entry);
    pthread_mutex_unlock(&queue->mutex);
    return progress;
}

size_t queue_running(struct queue *queue, struct queue_running *jobs, size_t room)
{
    size_t count = 0;

    pthread_mutex_lock(&queue->mutex);
    for (struct owner *owner = queue->owners; owner; owner = owner->next) {
        for (struct queued *entry = owner->first; entry && count < room; entry = entry->next) {
            if (!entry->started || entry->ended)
                continue;
            memcpy(jobs[count].id, entry->id, sizeof entry->id);
            jobs[count++].progress = entry_progress(entry);
        }
    }
    pthread_mutex_unlock(&queue->mutex);
    return count;
}

int64_t queue_preparing_ms(struct queue *queue)
{
    int64_t now_ms = owner_steady_ms(), longest = 0;

    pthread_mutex_lock(&queue->mutex);
    for (struct owner *owner = queue->owners; owner; owner = owner->next)
        for (struct queued *entry = owner->first; entry; entry = entry->next)
            if (entry->prepared_ms > 0 && now_ms - entry->prepared_ms > longest)
                longest = now_ms - entry->prepared_ms;
    pthread_mutex_unlock(&queue->mutex);
    return longest;
}

char *queue_crash_path(const struct queue *queue)
{
    return store_beside(queue->store, "bcd.crashed");
}

void queue_stop(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    atomic_store(&queue->stopping, true);
    queue_changed(queue);
    pthread_mutex_unlock(&queue->mutex);
}

bool queue_stopping(const struct queue *queue)
{
    return atomic_load(&queue->stopping);
}
