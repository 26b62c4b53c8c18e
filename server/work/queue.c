/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue.c - see queue.h.
 *
 * THREADS  `mutex` guards everything but what is atomic. It is never held while the store works.
 * `changed` is broadcast whenever a waiting worker might go on. An entry is freed by whoever takes
 * away the last reason to keep it (release_entry), always under the mutex.
 */
#include "queue.h"

#include "log.h"
#include "scene_json.h"
#include "store_results.h"

#include <assert.h>
#include <pthread.h>
#include <search.h>
#include <sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { USUAL_BYTES = 4096 }; /* of a scene's encoding */
enum { RETRY_MS = 1000 }; /* until a store that cannot mark a job running is asked again */

enum chunk_state { CHUNK_FREE, CHUNK_CLAIMED, CHUNK_DONE };

enum phase {
    PHASE_QUEUED,   /* the store says queued */
    PHASE_STARTING, /* a worker is telling the store */
    PHASE_RUNNING,  /* the store says running */
};

/* A chunk in motion. */
struct claim {
    struct queued *entry;
    struct claim *previous, *next;
    int64_t chunk;
    _Atomic int64_t ticks_done, ticks_total;
};

/* A job. Chunks below `first_free` are claimed or done. */
struct queued {
    char id[JOB_ID_SIZE]; /* first: the index compares entries by it */
    struct queued *previous, *next;
    struct bcd_scene *scene;
    enum phase phase;
    int64_t chunks, chunks_done, first_free;
    unsigned char *chunk_state;
    struct claim *claims;
    bool pinned; /* a worker is starting or finishing it */
    bool ended;  /* forgotten or cancelled: to be freed as soon as nobody holds it */
    atomic_bool cancelled;
};

struct queue {
    struct store *store;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct queued *first, *last; /* in order of submission */
    void *index;                 /* tsearch tree of the same entries by id */
    atomic_bool stopping;
};

/* ------------------------------------------------------------------- identity */

bool queue_hash(const struct bcd_scene *scene, unsigned char hash[JOB_HASH_SIZE])
{
    unsigned char usual[USUAL_BYTES], *bytes = usual;
    size_t size = bcd_scene_encode(scene, usual, sizeof usual);
    SHA2_CTX context;

    static_assert(SHA256_DIGEST_LENGTH == JOB_HASH_SIZE, "the store keeps SHA-256");
    if (size > sizeof usual) {
        bytes = malloc(size);
        if (!bytes)
            return false;
        bcd_scene_encode(scene, bytes, size);
    }
    SHA256Init(&context);
    SHA256Update(&context, bytes, size);
    SHA256Final(hash, &context);
    if (bytes != usual)
        free(bytes);
    return true;
}

/* -------------------------------------------------------------------- entries */

static int compare_ids(const void *a, const void *b)
{
    return strcmp(a, b);
}

static struct queued *find(struct queue *queue, const char *id)
{
    struct queued *const *node = tfind(id, &queue->index, compare_ids);

    return node ? *node : NULL;
}

static void free_entry(struct queued *entry)
{
    if (!entry)
        return;
    assert(!entry->claims);
    bcd_scene_free(entry->scene);
    free(entry->chunk_state);
    free(entry);
}

/* Owns the scene from here on, whatever it returns. */
static struct queued *create_entry(const char *id, struct bcd_scene *scene)
{
    struct queued *entry = calloc(1, sizeof *entry);

    if (!entry) {
        bcd_scene_free(scene);
        return NULL;
    }
    snprintf(entry->id, sizeof entry->id, "%s", id);
    entry->scene = scene;
    entry->chunks = bcd_scene_chunks(scene);
    entry->chunk_state = calloc((size_t)entry->chunks + 1, 1); /* CHUNK_FREE */
    atomic_init(&entry->cancelled, false);
    if (!entry->chunk_state) {
        free_entry(entry);
        return NULL;
    }
    return entry;
}

/* Appends an entry to list and index; false when there is no memory or the job is here already. */
static bool append(struct queue *queue, struct queued *entry)
{
    struct queued *const *node = tsearch(entry, &queue->index, compare_ids);

    if (!node || *node != entry)
        return false;
    entry->previous = queue->last;
    if (queue->last)
        queue->last->next = entry;
    else
        queue->first = entry;
    queue->last = entry;
    return true;
}

/* Frees an entry that has ended and is in nobody's hands. */
static void release_entry(struct queue *queue, struct queued *entry)
{
    if (!entry->ended || entry->pinned || entry->claims)
        return;
    tdelete(entry, &queue->index, compare_ids);
    if (entry->previous)
        entry->previous->next = entry->next;
    else
        queue->first = entry->next;
    if (entry->next)
        entry->next->previous = entry->previous;
    else
        queue->last = entry->previous;
    free_entry(entry);
}

/* -------------------------------------------------------------------- lifetime */

enum store_status queue_create(struct queue **queue, struct store *store)
{
    struct queue *made = calloc(1, sizeof *made);
    pthread_condattr_t attributes;

    if (!made)
        return STORE_BROKEN;
    made->store = store;
    atomic_init(&made->stopping, false);
    pthread_mutex_init(&made->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&made->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    *queue = made;
    return STORE_OK;
}

static void keep_node(void *node)
{
    (void)node; /* the entries themselves are freed from the list */
}

void queue_free(struct queue *queue)
{
    if (!queue)
        return;
    tdestroy(queue->index, keep_node);
    for (struct queued *entry = queue->first, *next; entry; entry = next) {
        next = entry->next;
        free_entry(entry);
    }
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->mutex);
    free(queue);
}

static void fail_job(struct queue *queue, const struct job_record *record, const char *reason)
{
    log_write(LOG_LEVEL_ERROR, "job_not_recovered",
              LOG_FIELDS(log_text("job", record->id), log_text("reason", reason)));
    /* If this fails too, the store has logged why; the job is looked at again at the next start. */
    store_jobs_fail(queue->store, record->id, reason);
}

/* The scene of a job of the store: NULL with STORE_OK if the job had to be failed. */
static enum store_status recover_scene(struct queue *queue, const struct job_record *record,
                                       struct bcd_scene **scene)
{
    struct bcd_errors errors = {0};
    unsigned char hash[JOB_HASH_SIZE];
    char reason[512];
    enum bcd_status status = scene_json_parse(record->job, strlen(record->job), scene, &errors);

    if (status == BCD_NO_MEMORY)
        return STORE_BROKEN;
    if (status) {
        *scene = NULL;
        snprintf(reason, sizeof reason, "this version cannot run the job any more: %s: %s",
                 errors.count ? errors.items[0].field : "",
                 errors.count ? errors.items[0].text : bcd_status_text(status));
        fail_job(queue, record, reason);
        return STORE_OK;
    }
    if (!queue_hash(*scene, hash)) {
        bcd_scene_free(*scene);
        return STORE_BROKEN;
    }
    /* Chunks already finished must not be mixed with others of a different meaning. */
    if (memcmp(hash, record->hash, sizeof hash) != 0 ||
        bcd_scene_chunks(*scene) != record->chunks) {
        bcd_scene_free(*scene);
        *scene = NULL;
        fail_job(queue, record,
                 "accepted by a version whose results differ from this one's; "
                 "submit it again");
    }
    return STORE_OK;
}

static enum store_status recover_chunks(struct queue *queue, struct queued *entry)
{
    bool *done = calloc((size_t)entry->chunks + 1, sizeof *done);
    enum store_status status = STORE_BROKEN;

    if (done)
        status = store_results_chunks(queue->store, entry->id, done, entry->chunks);
    for (int64_t i = 0; status == STORE_OK && i < entry->chunks; i++) {
        if (done[i]) {
            entry->chunk_state[i] = CHUNK_DONE;
            entry->chunks_done++;
        }
    }
    free(done);
    return status;
}

static enum store_status recover_job(struct queue *queue, const struct job_record *record)
{
    struct bcd_scene *scene = NULL;
    struct queued *entry;
    enum store_status status = recover_scene(queue, record, &scene);

    if (status || !scene)
        return status;
    entry = create_entry(record->id, scene);
    if (!entry)
        return STORE_BROKEN;
    entry->phase = record->state == JOB_RUNNING ? PHASE_RUNNING : PHASE_QUEUED;
    status = recover_chunks(queue, entry);
    if (status) {
        free_entry(entry);
        return status;
    }
    log_write(LOG_LEVEL_INFO, "job_recovered",
              LOG_FIELDS(log_text("job", record->id),
                         log_text("state", job_state_name(record->state)),
                         log_integer("chunks_done", entry->chunks_done),
                         log_integer("chunks", entry->chunks)));
    pthread_mutex_lock(&queue->mutex);
    if (!append(queue, entry)) {
        free_entry(entry);
        status = STORE_BROKEN;
    }
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->mutex);
    return status;
}

enum store_status queue_recover(struct queue *queue)
{
    struct job_record *records = NULL;
    size_t count = 0;
    enum store_status status = store_jobs_unfinished(queue->store, &records, &count);

    for (size_t i = 0; status == STORE_OK && i < count; i++)
        status = recover_job(queue, &records[i]);
    job_records_free(records, count);
    return status;
}

void queue_take(struct queue *queue, const char *id, struct bcd_scene *scene)
{
    struct queued *entry = create_entry(id, scene);
    bool taken = false;

    if (entry) {
        pthread_mutex_lock(&queue->mutex);
        taken = append(queue, entry);
        if (taken)
            pthread_cond_broadcast(&queue->changed);
        pthread_mutex_unlock(&queue->mutex);
    }
    if (!taken) {
        log_write(LOG_LEVEL_ERROR, "job_not_taken", LOG_FIELDS(log_text("job", id)));
        free_entry(entry);
    }
}

/* --------------------------------------------------------------------- claiming */

/* The next chunk to hand out: a free one, QUEUE_FINISH, or chunks = none. */
static int64_t next_chunk(struct queued *entry)
{
    while (entry->first_free < entry->chunks && entry->chunk_state[entry->first_free] != CHUNK_FREE)
        entry->first_free++;
    if (entry->first_free == entry->chunks && entry->chunks_done == entry->chunks && !entry->pinned)
        return QUEUE_FINISH;
    return entry->first_free;
}

/* The oldest job that has something to be done. */
static struct queued *find_work(struct queue *queue)
{
    for (struct queued *entry = queue->first; entry; entry = entry->next)
        if (!entry->ended && next_chunk(entry) != entry->chunks)
            return entry;
    return NULL;
}

/* Waits for RETRY_MS, or less when the queue stops. */
static void wait_retry(struct queue *queue)
{
    struct timespec until;
    int code = 0;

    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += RETRY_MS / 1000;
    while (code == 0 && !atomic_load(&queue->stopping))
        code = pthread_cond_timedwait(&queue->changed, &queue->mutex, &until);
}

/* Tells the store that the job runs now, with the mutex let go meanwhile. Others wait for it. */
static void start_entry(struct queue *queue, struct queued *entry)
{
    enum store_status status;

    entry->phase = PHASE_STARTING;
    entry->pinned = true;
    pthread_mutex_unlock(&queue->mutex);
    status = store_jobs_start(queue->store, entry->id);
    if (status == STORE_OK)
        log_write(LOG_LEVEL_INFO, "job_started", LOG_FIELDS(log_text("job", entry->id)));
    pthread_mutex_lock(&queue->mutex);
    if (status == STORE_FULL || status == STORE_BROKEN)
        wait_retry(queue);
    entry->pinned = false;
    entry->phase = status == STORE_OK ? PHASE_RUNNING : PHASE_QUEUED;
    /* Cancelled before it began, and possibly before it came here. */
    if (status == STORE_CONFLICT || status == STORE_NOT_FOUND)
        entry->ended = true;
    release_entry(queue, entry);
    pthread_cond_broadcast(&queue->changed);
}

/* False = no memory. */
static bool claim_chunk(struct queued *entry, struct task *task)
{
    int64_t chunk = next_chunk(entry);
    struct claim *claim = NULL;

    if (chunk == QUEUE_FINISH) {
        entry->pinned = true;
    } else {
        claim = calloc(1, sizeof *claim);
        if (!claim)
            return false;
        claim->entry = entry;
        claim->chunk = chunk;
        atomic_init(&claim->ticks_done, 0);
        atomic_init(&claim->ticks_total, 0);
        claim->next = entry->claims;
        if (entry->claims)
            entry->claims->previous = claim;
        entry->claims = claim;
        entry->chunk_state[chunk] = CHUNK_CLAIMED;
    }
    *task = (struct task){
        .id = entry->id,
        .scene = entry->scene,
        .chunk = chunk,
        .cancelled = &entry->cancelled,
        .ticks_done = claim ? &claim->ticks_done : NULL,
        .ticks_total = claim ? &claim->ticks_total : NULL,
        .claim = claim,
    };
    return true;
}

bool queue_claim(struct queue *queue, struct task *task)
{
    bool claimed = false;

    pthread_mutex_lock(&queue->mutex);
    while (!claimed && !atomic_load(&queue->stopping)) {
        struct queued *entry = find_work(queue);

        if (!entry || entry->phase == PHASE_STARTING)
            pthread_cond_wait(&queue->changed, &queue->mutex);
        else if (entry->phase == PHASE_QUEUED)
            start_entry(queue, entry);
        else if (claim_chunk(entry, task))
            claimed = true;
        else
            wait_retry(queue);
    }
    pthread_mutex_unlock(&queue->mutex);
    return claimed;
}

/* Takes the claim away from its entry and frees it. */
static struct queued *drop_claim(struct task *task, enum chunk_state becomes)
{
    struct claim *claim = task->claim;
    struct queued *entry = claim->entry;

    if (claim->previous)
        claim->previous->next = claim->next;
    else
        entry->claims = claim->next;
    if (claim->next)
        claim->next->previous = claim->previous;
    assert(entry->chunk_state[claim->chunk] == CHUNK_CLAIMED);
    entry->chunk_state[claim->chunk] = (unsigned char)becomes;
    if (becomes == CHUNK_DONE)
        entry->chunks_done++;
    else if (claim->chunk < entry->first_free)
        entry->first_free = claim->chunk;
    task->claim = NULL;
    task->ticks_done = task->ticks_total = NULL;
    free(claim);
    return entry;
}

void queue_done(struct queue *queue, struct task *task, bool *last)
{
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = drop_claim(task, CHUNK_DONE);
    *last = entry->chunks_done == entry->chunks && !entry->ended;
    if (*last)
        entry->pinned = true; /* until queue_forget */
    release_entry(queue, entry);
    pthread_mutex_unlock(&queue->mutex);
}

void queue_forget(struct queue *queue, const char *id)
{
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = find(queue, id);
    if (entry) {
        entry->pinned = false;
        entry->ended = true;
        release_entry(queue, entry);
    }
    pthread_mutex_unlock(&queue->mutex);
}

void queue_release(struct queue *queue, struct task *task)
{
    pthread_mutex_lock(&queue->mutex);
    release_entry(queue, drop_claim(task, CHUNK_FREE));
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->mutex);
}

void queue_cancel(struct queue *queue, const char *id)
{
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = find(queue, id);
    if (entry) {
        atomic_store(&entry->cancelled, true);
        entry->ended = true;
        release_entry(queue, entry);
        /* Those who wait for it to start can turn to the next one. */
        pthread_cond_broadcast(&queue->changed);
    }
    pthread_mutex_unlock(&queue->mutex);
}

/* -------------------------------------------------------------------- looking */

/* Mutex held. */
static double progress_of(const struct queued *entry)
{
    double progress = (double)entry->chunks_done;

    for (const struct claim *claim = entry->claims; claim; claim = claim->next) {
        int64_t total = atomic_load(&claim->ticks_total);

        if (total > 0)
            progress += (double)atomic_load(&claim->ticks_done) / (double)total;
    }
    progress /= (double)entry->chunks;
    return progress > 1.0 ? 1.0 : progress;
}

double queue_progress(struct queue *queue, const char *id)
{
    double progress = -1.0;
    struct queued *entry;

    pthread_mutex_lock(&queue->mutex);
    entry = find(queue, id);
    if (entry && !entry->ended)
        progress = progress_of(entry);
    pthread_mutex_unlock(&queue->mutex);
    return progress;
}

size_t queue_running(struct queue *queue, struct queue_running *jobs, size_t room)
{
    size_t count = 0;

    pthread_mutex_lock(&queue->mutex);
    for (struct queued *entry = queue->first; entry && count < room; entry = entry->next) {
        if (entry->phase != PHASE_RUNNING || entry->ended)
            continue;
        memcpy(jobs[count].id, entry->id, sizeof entry->id);
        jobs[count++].progress = progress_of(entry);
    }
    pthread_mutex_unlock(&queue->mutex);
    return count;
}

void queue_stop(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    atomic_store(&queue->stopping, true);
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->mutex);
}

bool queue_stopping(const struct queue *queue)
{
    return atomic_load(&queue->stopping);
}
