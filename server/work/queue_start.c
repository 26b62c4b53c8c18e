/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue_start.c - how a job comes into motion, from the store when a worker wants it: a queued one,
 * or one that was in motion before the daemon's start; see queue_internal.h.
 */
#include "queue_internal.h"

#include "crash.h"
#include "limits.h"
#include "log.h"
#include "scene_json.h"
#include "store_attempts.h"
#include "store_owners.h"
#include "store_pieces.h"
#include "store_results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    RETRY_MS = 1000, /* until a store that cannot say, or mark a job running, is asked again */
    REST_MS = 1000,  /* the shortest rest; then twice as long each time */
};

void start_wait(struct queue *queue)
{
    struct timespec until;
    int code = 0;

    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += RETRY_MS / 1000;
    while (code == 0 && !atomic_load(&queue->stopping))
        code = pthread_cond_timedwait(&queue->changed, &queue->mutex, &until);
}

static double cpu_seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---------------------------------------------------------------------- rests */

static bool anything_moves(const struct queue *queue)
{
    for (const struct owner *owner = queue->owners; owner; owner = owner->next)
        for (const struct queued *entry = owner->first; entry; entry = entry->next)
            if (entry->claims || entry->pinned)
                return true;
    return false;
}

void start_rested(struct queue *queue)
{
    struct queued *entry = owner_resting(queue);
    struct timespec until;

    if (!entry) {
        pthread_cond_wait(&queue->changed, &queue->mutex);
    } else if (!anything_moves(queue)) {
        entry->rests_until_ms = 0; /* there is nobody to be disturbed */
    } else {
        until.tv_sec = entry->rests_until_ms / 1000;
        until.tv_nsec = entry->rests_until_ms % 1000 * 1000000;
        pthread_cond_timedwait(&queue->changed, &queue->mutex, &until);
    }
}

/* How long a job rests after what became of its latest attempts. */
static enum store_status read_rest(struct queue *queue, struct queued *entry)
{
    struct attempts_barren barren;
    enum store_status status = store_attempts_barren(queue->store, entry->id, &barren);
    int64_t rest_ms = REST_MS;

    if (status || (barren.crashed == 0 && barren.lost < LIMIT_LOST_BARREN))
        return status;
    for (int64_t i = 1; i < barren.crashed + barren.lost && rest_ms < LIMIT_REST_MS_MAX; i++)
        rest_ms *= 2;
    rest_ms = rest_ms < LIMIT_REST_MS_MAX ? rest_ms : LIMIT_REST_MS_MAX;
    entry->rests_until_ms = owner_steady_ms() + rest_ms;
    log_write(LOG_LEVEL_WARNING, "job_rests",
              LOG_FIELDS(log_text("job", entry->id), log_integer("crashed", barren.crashed),
                         log_integer("lost", barren.lost), log_integer("rest_ms", rest_ms)));
    return STORE_OK;
}

/* ----------------------------------------------------------------- the scene */

static void fail_job(struct queue *queue, const struct job_record *record, const char *reason)
{
    log_write(LOG_LEVEL_ERROR, "job_not_started",
              LOG_FIELDS(log_text("job", record->id), log_text("reason", reason)));
    /* If this fails too, the store has logged why; the job is looked at again at the next start. */
    store_jobs_fail(queue->store, record->id, reason);
}

/* Whose preparation a watch is over. */
struct preparation {
    const struct queue *queue;
    const atomic_bool *cancelled;
};

static bool should_stop(void *context)
{
    const struct preparation *preparation = context;

    return queue_stopping(preparation->queue) || atomic_load(preparation->cancelled);
}

/* A scene ready for runs. */
static enum bcd_status read_scene(const struct job_record *record, struct bcd_watch *watch,
                                  struct bcd_scene **scene, struct bcd_errors *errors)
{
    enum bcd_status status =
        scene_json_complete(record->job, strlen(record->job), NULL, scene, errors);

    if (status)
        return status;
    status = bcd_scene_prepare(*scene, watch, errors);
    if (status)
        bcd_scene_free(*scene);
    return status;
}

/* The scene of a job of the store: NULL with STORE_OK if the job had to be failed. */
static enum store_status load_scene(struct queue *queue, const struct job_record *record,
                                    const atomic_bool *cancelled, struct bcd_scene **scene)
{
    struct bcd_errors errors = {0};
    unsigned char hash[JOB_HASH_SIZE];
    char reason[512];
    struct preparation preparation = {queue, cancelled};
    struct bcd_watch watch = {.should_stop = should_stop,
                              .context = &preparation,
                              .seconds_max = LIMIT_START_SECONDS_MAX,
                              .bytes_max = queue->limits.run_bytes};
    enum bcd_status status = read_scene(record, &watch, scene, &errors);

    if (status)
        *scene = NULL;
    if (status == BCD_NO_MEMORY)
        return STORE_BROKEN;
    if (watch.end == BCD_WATCH_TOLD) /* cancelled: no longer queued; or the daemon stops */
        return queue_stopping(queue) ? STORE_BROKEN : STORE_CONFLICT;
    if (status) {
        snprintf(reason, sizeof reason, "%s%s: %s",
                 status == BCD_STOPPED ? "" : "this version cannot run the job any more: ",
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
        fail_job(queue, record, JOB_OUTDATED " from this one's; submit it again");
    }
    return STORE_OK;
}

/* ------------------------------------------------------------------ the head */

/* Asks the store which queued job of this owner comes next, and whether it is the last. Those that
 * are just being started are queued there too. */
void start_ask(struct queue *queue, struct owner *owner)
{
    size_t room = owner->starting + 2, count = 0, found = 0;
    struct job_waiting *waiting = calloc(room, sizeof *waiting);
    unsigned news = owner->news;
    enum store_status status = STORE_BROKEN;

    owner->asking = true;
    pthread_mutex_unlock(&queue->mutex);
    if (waiting)
        status = store_jobs_waiting(queue->store, owner->name, waiting, room, &count);
    pthread_mutex_lock(&queue->mutex);
    if (status)
        start_wait(queue);
    owner->asking = false;
    for (size_t i = 0; i < count && found < 2; i++)
        if (!entry_find(queue, waiting[i].id) && ++found == 1)
            owner->head = waiting[i];
    owner->head_known = found > 0 && owner->news == news; /* the news may want to be the head */
    owner->more = found > 1 || count == room;
    if (status == STORE_OK && found == 0 && count < room && owner->news == news)
        owner->waiting = false;
    free(waiting);
    queue_changed(queue);
}

/* From the store's row to a job that runs: its scene, and what was needed to start it. */
static enum store_status start_job(struct queue *queue, struct queued *entry)
{
    struct job_record record = {0};
    struct bcd_scene *scene = NULL;
    double before = cpu_seconds(), used = 0;
    enum store_status status = store_jobs_get(queue->store, entry->id, &record);

    if (status == STORE_OK && record.state != (entry->resumes ? JOB_RUNNING : JOB_QUEUED))
        status = STORE_CONFLICT; /* cancelled meanwhile */
    if (status == STORE_OK)
        status = load_scene(queue, &record, &entry->cancelled, &scene);
    if (status == STORE_OK && !scene)
        status = STORE_CONFLICT; /* failed just now */
    job_record_fini(&record);
    if (status == STORE_OK && entry->resumes)
        status = store_attempts_used(queue->store, entry->id, &used);
    entry->spent = used + entry->untold;
    queue_spend(queue, &(struct task){.owner = entry->owner, .entry = entry},
                cpu_seconds() - before);
    if (status) {
        bcd_scene_free(scene);
        return status;
    }
    if (!entry_set_scene_take(queue, entry, scene))
        return STORE_BROKEN;
    status = entry_read_goal(queue, entry, 0);
    return status || entry->resumes ? status : store_jobs_start(queue->store, entry->id);
}

/* The entry into motion, if the status at last is STORE_OK: with the mutex held, and let go
 * meanwhile, so that others go on with other work. */
static enum store_status start_entry(struct queue *queue, struct queued *entry)
{
    enum store_status status;

    entry->pinned = true;
    entry->prepared_ms = owner_steady_ms();
    pthread_mutex_unlock(&queue->mutex);
    crash_note(entry->id, -1);
    status = start_job(queue, entry);
    crash_note(NULL, 0);
    if (status == STORE_OK)
        log_write(LOG_LEVEL_INFO, entry->resumes ? "job_recovered" : "job_started",
                  LOG_FIELDS(log_text("job", entry->id),
                             log_integer("chunks_done", entry->chunks_done),
                             log_integer("chunks", entry->chunks)));
    pthread_mutex_lock(&queue->mutex);
    entry->prepared_ms = 0;
    if (status == STORE_FULL || status == STORE_BROKEN)
        start_wait(queue);
    entry->pinned = false;
    entry->started = status == STORE_OK;
    return status;
}

/* Starts the owner's head. */
void start_head(struct queue *queue, struct owner *owner)
{
    struct queued *entry = entry_create(owner, owner->head.id);
    enum store_status status;

    owner->head_known = false;
    owner->waiting = owner->more;
    if (!entry || !entry_append(queue, entry)) {
        entry_free(entry);
        start_wait(queue);
        owner->waiting = true;
        return;
    }
    entry->seq = owner->head.seq;
    entry->priority = owner->head.priority;
    owner->starting++;
    status = start_entry(queue, entry);
    if (status == STORE_FULL || status == STORE_BROKEN)
        owner->waiting = true; /* for this one at least */
    owner->starting--;
    /* It was cancelled before it began, or another time will be better. */
    if (status)
        entry->ended = true;
    entry_release(queue, entry);
    queue_changed(queue);
}

/* Takes up what was in motion before the server's start. */
void start_again(struct queue *queue, struct queued *entry)
{
    enum store_status status = start_entry(queue, entry);

    if (status == STORE_OK)
        entry->resumes = false;
    else if (status != STORE_FULL && status != STORE_BROKEN)
        entry->ended = true; /* cancelled, or failed */
    entry_release(queue, entry);
    queue_changed(queue);
}

/* ------------------------------------------------------------------- recovery */

static enum store_status recover_job(struct queue *queue, const struct job_record *record)
{
    struct owner *owner = owner_find(queue, record->ticket.owner);
    struct queued *entry = owner ? entry_create(owner, record->id) : NULL;
    enum store_status status;

    if (!entry)
        return STORE_BROKEN;
    entry->seq = record->seq;
    entry->priority = record->ticket.priority;
    entry->resumes = true;
    status = read_rest(queue, entry);
    if (status == STORE_OK && !entry_append(queue, entry))
        status = STORE_BROKEN;
    if (status)
        entry_free(entry);
    return status;
}

static enum store_status recover_owners(struct queue *queue)
{
    struct owner_record *records = NULL;
    size_t count = 0;
    enum store_status status = store_owners_list(queue->store, &records, &count);

    for (size_t i = 0; status == STORE_OK && i < count; i++) {
        struct owner *owner = owner_find(queue, records[i].owner);

        if (!owner) {
            status = STORE_BROKEN;
            break;
        }
        owner->usage = records[i].usage_seconds;
        owner->usage_ms = owner_now_ms();
        owner->waiting = records[i].queued > 0;
    }
    free(records);
    return status;
}

/* What was in motion when the server ended, and whether it was that which ended it. */
static enum store_status recover_attempts(struct queue *queue)
{
    char *notes = queue_crash_path(queue), *kills = store_beside(queue->store, "bcd.starved");
    struct attempts_end end = {0};
    struct attempt_crash *crashes = notes && kills ? crash_read(notes, &end.count) : NULL;
    enum store_status status = STORE_BROKEN;

    if (crashes) {
        end.crashes = crashes;
        end.starved = crash_starved(CRASH_VMSTAT, kills);
        status = store_attempts_recover(queue->store, &end);
    }
    free(crashes);
    free(kills);
    free(notes);
    return status;
}

enum store_status queue_recover(struct queue *queue)
{
    struct job_record *records = NULL;
    size_t count = 0;
    enum store_status status = recover_attempts(queue);

    if (status == STORE_OK)
        status = recover_owners(queue);
    if (status == STORE_OK)
        status = calibration_load(queue->calibration, queue->store);
    if (status == STORE_OK)
        status = store_jobs_running(queue->store, &records, &count);
    for (size_t i = 0; status == STORE_OK && i < count; i++)
        status = recover_job(queue, &records[i]);
    job_records_free(records, count);
    if (status == STORE_OK)
        pieces_tidy(queue->store);
    return status;
}
