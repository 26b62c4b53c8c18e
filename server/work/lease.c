/* SPDX-License-Identifier: GPL-3.0-or-later
 * lease.c - see lease.h. */
#include "lease.h"

#include "limits.h"
#include "log.h"
#include "scene_json.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

struct lease {
    struct leases *leases;
    struct lease *previous, *next;
    const struct task *task;
    char id[LEASE_ID_SIZE]; /* of who has it, "" = nobody */
    char worker[LEASE_WORKER_SIZE];
    int64_t attempts, until_ms;
    struct blob checkpoint, begun;
    bool fresh; /* the checkpoint has not been told yet */
    bool woken;
    double core_seconds, told_seconds;
    bool returned, failed;
    struct blob tally;
    struct bcd_error error;
    pthread_cond_t changed;
};

/* A result that came, for those that come once more. */
struct memory {
    char job[JOB_ID_SIZE];
    int64_t chunk;
    unsigned char digest[LEASE_DIGEST_SIZE];
};

struct leases {
    pthread_mutex_t mutex;
    struct lease *first, *last;
    int64_t lease_ms;
    struct lease_counts counts;
    size_t known;
    struct memory memory[LIMIT_LEASES_REMEMBERED];
};

static int64_t now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

struct leases *leases_create(int64_t lease_ms)
{
    struct leases *leases = calloc(1, sizeof *leases);

    if (!leases)
        return NULL;
    leases->lease_ms = lease_ms > 0 ? lease_ms : LIMIT_LEASE_MS;
    pthread_mutex_init(&leases->mutex, NULL);
    return leases;
}

void leases_free(struct leases *leases)
{
    if (!leases)
        return;
    pthread_mutex_destroy(&leases->mutex);
    free(leases);
}

/* A heartbeat that did not come: the chunk is anybody's again. Under the mutex. */
static void expire(struct leases *leases)
{
    int64_t now = now_ms();

    for (struct lease *lease = leases->first; lease; lease = lease->next) {
        if (!lease->id[0] || lease->returned || lease->failed || now < lease->until_ms)
            continue;
        leases->counts.expired++;
        log_write(
            LOG_LEVEL_WARNING, "lease_expired",
            LOG_FIELDS(log_text("job", lease->task->id), log_integer("chunk", lease->task->chunk),
                       log_text("worker", lease->worker), log_integer("attempt", lease->attempts)));
        lease->id[0] = '\0';
    }
}

void leases_count(struct leases *leases, struct lease_counts *counts)
{
    pthread_mutex_lock(&leases->mutex);
    expire(leases);
    *counts = leases->counts;
    for (const struct lease *lease = leases->first; lease; lease = lease->next) {
        counts->held += lease->id[0] != '\0';
        counts->offered += lease->id[0] == '\0';
    }
    pthread_mutex_unlock(&leases->mutex);
}

/* ------------------------------------------------------------------- lending */

struct lease *lease_offer(struct leases *leases, const struct task *task, struct blob *checkpoint,
                          struct blob *begun)
{
    struct lease *lease = calloc(1, sizeof *lease);
    pthread_condattr_t attributes;

    if (!lease)
        return NULL;
    lease->leases = leases;
    lease->task = task;
    lease->checkpoint = *checkpoint;
    lease->begun = *begun;
    *checkpoint = *begun = (struct blob){0};
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&lease->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_lock(&leases->mutex);
    lease->previous = leases->last;
    if (leases->last)
        leases->last->next = lease;
    else
        leases->first = lease;
    leases->last = lease;
    pthread_mutex_unlock(&leases->mutex);
    return lease;
}

static struct blob copy(const struct blob *blob)
{
    struct blob made = {.bytes = malloc(blob->size + 1), .size = blob->size};

    if (made.bytes && blob->size > 0)
        memcpy(made.bytes, blob->bytes, blob->size);
    if (!made.bytes)
        made.size = 0;
    return made;
}

void lease_wait(struct lease *lease, int64_t wait_ms, struct lease_news *news)
{
    struct leases *leases = lease->leases;
    struct timespec until;
    int code = 0;

    *news = (struct lease_news){0};
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += wait_ms % 1000 * 1000000;
    until.tv_sec += wait_ms / 1000 + until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    pthread_mutex_lock(&leases->mutex);
    while (code == 0 && !lease->returned && !lease->failed && !lease->fresh && !lease->woken)
        code = pthread_cond_timedwait(&lease->changed, &leases->mutex, &until);
    news->core_seconds = lease->core_seconds - lease->told_seconds;
    lease->told_seconds = lease->core_seconds;
    news->returned = lease->returned;
    news->tally = lease->tally;
    lease->tally = (struct blob){0};
    news->failed = lease->failed;
    news->error = lease->error;
    if (lease->fresh && !lease->returned)
        news->checkpoint = copy(&lease->checkpoint);
    lease->fresh = lease->woken = false;
    pthread_mutex_unlock(&leases->mutex);
}

void leases_wake(struct leases *leases)
{
    pthread_mutex_lock(&leases->mutex);
    for (struct lease *lease = leases->first; lease; lease = lease->next) {
        lease->woken = true;
        pthread_cond_signal(&lease->changed);
    }
    pthread_mutex_unlock(&leases->mutex);
}

void lease_end(struct lease *lease)
{
    struct leases *leases = lease->leases;

    pthread_mutex_lock(&leases->mutex);
    if (lease->previous)
        lease->previous->next = lease->next;
    else
        leases->first = lease->next;
    if (lease->next)
        lease->next->previous = lease->previous;
    else
        leases->last = lease->previous;
    pthread_mutex_unlock(&leases->mutex);
    pthread_cond_destroy(&lease->changed);
    blob_fini(&lease->checkpoint);
    blob_fini(&lease->begun);
    blob_fini(&lease->tally);
    free(lease);
}

/* ------------------------------------------------------------------- running */

/* "l" and 64 random bits. */
static bool make_id(char id[LEASE_ID_SIZE])
{
    uint64_t bits;

    if (getrandom(&bits, sizeof bits, 0) != (ssize_t)sizeof bits)
        return false;
    snprintf(id, LEASE_ID_SIZE, "l%016llx", (unsigned long long)bits);
    return true;
}

/* Under the mutex. */
static enum store_status lend(struct lease *lease, const char *worker, struct lease_loan *loan)
{
    const struct task *task = lease->task;

    *loan = (struct lease_loan){.chunk = task->chunk,
                                .attempt = lease->attempts + 1,
                                .lease_ms = lease->leases->lease_ms,
                                .scene = scene_json_job(task->scene),
                                .checkpoint = copy(&lease->checkpoint),
                                .begun = copy(&lease->begun)};
    snprintf(loan->job, sizeof loan->job, "%s", task->id);
    if (!loan->scene || !loan->checkpoint.bytes || !loan->begun.bytes ||
        !queue_hash(task->scene, loan->hash) || !make_id(loan->id)) {
        lease_loan_fini(loan);
        return STORE_BROKEN;
    }
    memcpy(lease->id, loan->id, sizeof lease->id);
    snprintf(lease->worker, sizeof lease->worker, "%s", worker);
    lease->attempts++;
    lease->until_ms = now_ms() + lease->leases->lease_ms;
    lease->core_seconds = lease->told_seconds = 0;
    lease->leases->counts.granted++;
    return STORE_OK;
}

enum store_status leases_take(struct leases *leases, const char *worker, struct lease_loan *loan)
{
    enum store_status status = STORE_NOT_FOUND;
    struct lease *lease;

    pthread_mutex_lock(&leases->mutex);
    expire(leases);
    lease = leases->first;
    while (lease && (lease->id[0] || lease->returned || lease->failed ||
                     atomic_load(lease->task->cancelled)))
        lease = lease->next;
    if (lease)
        status = lend(lease, worker, loan);
    pthread_mutex_unlock(&leases->mutex);
    return status;
}

static struct lease *find(struct leases *leases, const struct lease_word *word)
{
    struct lease *lease = leases->first;

    while (lease && (lease->task->chunk != word->chunk || strcmp(lease->task->id, word->job) != 0))
        lease = lease->next;
    return lease;
}

static const struct memory *remember(const struct leases *leases, const struct lease_word *word)
{
    size_t count =
        leases->known < LIMIT_LEASES_REMEMBERED ? leases->known : LIMIT_LEASES_REMEMBERED;

    for (size_t i = 0; i < count; i++)
        if (leases->memory[i].chunk == word->chunk && strcmp(leases->memory[i].job, word->job) == 0)
            return &leases->memory[i];
    return NULL;
}

/* One who has what nobody has (any more) is taken for its worker: the daemon was started anew, or
 * the heartbeat was late. */
static bool is_theirs(struct lease *lease, const struct lease_word *word)
{
    if (!lease->id[0])
        memcpy(lease->id, word->id, sizeof lease->id);
    return strcmp(lease->id, word->id) == 0;
}

static void note_progress(struct lease *lease, const struct lease_word *word)
{
    if (word->ticks_total > 0 && word->ticks_done >= 0 && word->ticks_done <= word->ticks_total) {
        atomic_store(lease->task->ticks_done, word->ticks_done);
        atomic_store(lease->task->ticks_total, word->ticks_total);
    }
    if (word->core_seconds > lease->core_seconds)
        lease->core_seconds = word->core_seconds;
}

enum lease_answer leases_hear(struct leases *leases, const struct lease_word *word)
{
    enum lease_answer answer = LEASE_GO_ON;
    struct lease *lease;

    pthread_mutex_lock(&leases->mutex);
    expire(leases);
    lease = find(leases, word);
    if (!lease || lease->returned || lease->failed) {
        answer = lease || remember(leases, word) ? LEASE_STOP : LEASE_UNKNOWN;
    } else if (atomic_load(lease->task->cancelled) || !is_theirs(lease, word)) {
        answer = LEASE_STOP;
    } else {
        lease->until_ms = now_ms() + leases->lease_ms;
        note_progress(lease, word);
        if (word->bytes.size > 0) {
            struct blob newer = copy(&word->bytes);

            if (newer.bytes) {
                blob_fini(&lease->checkpoint);
                lease->checkpoint = newer;
                lease->fresh = true;
            }
        }
        if (word->failed) {
            lease->failed = true;
            lease->error.code = BCD_INTERNAL;
            snprintf(lease->error.text, sizeof lease->error.text, "%s", word->failed);
        }
        if (word->let_go)
            lease->id[0] = '\0';
        pthread_cond_signal(&lease->changed);
    }
    pthread_mutex_unlock(&leases->mutex);
    return answer;
}

/* Whether these bytes are a tally of that chunk: its job's family, and as many realizations. */
static bool fits(const struct lease *lease, const struct blob *bytes)
{
    const struct bcd_scene *scene = lease->task->scene;
    int64_t chunk = lease->task->chunk;
    struct bcd_tally *tally = NULL;
    bool fitting = bcd_tally_create(&tally, scene) == BCD_OK &&
                   bcd_tally_restore(tally, bytes->bytes, bytes->size, NULL) == BCD_OK &&
                   bcd_tally_realizations(tally) == bcd_scene_realizations(scene, chunk + 1) -
                                                        bcd_scene_realizations(scene, chunk);

    bcd_tally_free(tally);
    return fitting;
}

/* A chunk comes once more; under the mutex. */
static enum lease_answer compare(struct leases *leases, const struct lease_word *word)
{
    const struct memory *known = remember(leases, word);

    if (!known)
        return LEASE_UNKNOWN;
    if (memcmp(known->digest, word->digest, sizeof known->digest) == 0) {
        leases->counts.again++;
        return LEASE_AGAIN;
    }
    leases->counts.differed++;
    log_write(LOG_LEVEL_ERROR, "result_differs",
              LOG_FIELDS(log_text("job", word->job), log_integer("chunk", word->chunk),
                         log_text("lease", word->id)));
    return LEASE_DIFFERS;
}

static enum lease_answer take_result(struct lease *lease, const struct lease_word *word)
{
    struct leases *leases = lease->leases;
    struct memory *memory = &leases->memory[leases->known % LIMIT_LEASES_REMEMBERED];
    struct blob tally;

    if (!fits(lease, &word->bytes)) {
        log_write(LOG_LEVEL_ERROR, "result_refused",
                  LOG_FIELDS(log_text("job", word->job), log_integer("chunk", word->chunk),
                             log_text("lease", word->id)));
        if (is_theirs(lease, word))
            lease->id[0] = '\0';
        return LEASE_REFUSED;
    }
    tally = copy(&word->bytes);
    if (!tally.bytes)
        return LEASE_UNKNOWN;
    note_progress(lease, word);
    lease->tally = tally;
    lease->returned = true;
    leases->counts.returned++;
    leases->known++;
    snprintf(memory->job, sizeof memory->job, "%s", word->job);
    memory->chunk = word->chunk;
    memcpy(memory->digest, word->digest, sizeof memory->digest);
    pthread_cond_signal(&lease->changed);
    return LEASE_GO_ON;
}

enum lease_answer leases_return(struct leases *leases, const struct lease_word *word)
{
    enum lease_answer answer;
    struct lease *lease;

    pthread_mutex_lock(&leases->mutex);
    lease = find(leases, word);
    if (!lease || lease->returned)
        answer = compare(leases, word);
    else if (lease->failed || atomic_load(lease->task->cancelled))
        answer = LEASE_STOP;
    else
        answer = take_result(lease, word);
    pthread_mutex_unlock(&leases->mutex);
    return answer;
}
