/* SPDX-License-Identifier: GPL-3.0-or-later
 * lease.c - see lease.h. */
#include "lease.h"

#include "deadline.h"
#include "limits.h"
#include "log.h"
#include "scene_json.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

enum {
    GRANTS = 8,
    EXPIRE_SHARE = 20,     /* leases are looked at so many times while one holds */
    LEASES_HELD_SHARE = 4, /* beside LIMIT_LEASES_OFFERED, a quarter of what is held is offered */
};

/* To whom a chunk was given. */
struct grant {
    char id[LEASE_ID_SIZE], owner[OWNER_SIZE];
};

struct lease {
    struct leases *leases;
    struct lease *previous, *next;
    const struct task *task;
    char id[LEASE_ID_SIZE];                            /* of who has it, "" = nobody */
    char worker[LEASE_WORKER_SIZE], owner[OWNER_SIZE]; /* whose token it has */
    struct grant grants[GRANTS];                       /* the latest, in a ring */
    int64_t attempts, until_ms, heard_ms;
    int64_t failures, failed_ms; /* whose run failed, or gave no tally: worker, above */
    struct lease_terms terms;
    bool waiting; /* it lies where a worker may take it: share.h */
    bool fresh;   /* the checkpoint has not been told yet */
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
    pthread_cond_t room; /* a chunk has been taken, or taken back */
    bool woken;
    size_t expected;
    int64_t lease_ms, expired_ms; /* expired_ms: when leases were looked at last */
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

/* Waits under the mutex until then; false = it is then. */
static bool wait_until(struct leases *leases, pthread_cond_t *condition,
                       const struct timespec *until)
{
    return pthread_cond_timedwait(condition, &leases->mutex, until) == 0;
}

struct leases *leases_create(int64_t lease_ms)
{
    struct leases *leases = calloc(1, sizeof *leases);

    if (!leases)
        return NULL;
    leases->lease_ms = lease_ms > 0 ? lease_ms : LIMIT_LEASE_MS;
    pthread_mutex_init(&leases->mutex, NULL);
    deadline_condition(&leases->room);
    return leases;
}

void leases_free(struct leases *leases)
{
    if (!leases)
        return;
    pthread_cond_destroy(&leases->room);
    pthread_mutex_destroy(&leases->mutex);
    free(leases);
}

/* A heartbeat that did not come: the chunk is anybody's again. Under the mutex. */
static void expire(struct leases *leases)
{
    int64_t now = now_ms();

    if (now < leases->expired_ms + leases->lease_ms / EXPIRE_SHARE)
        return; /* hundreds of workers ask, and each is told by hundreds of leases */
    leases->expired_ms = now;
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

/* Under the mutex. */
static void count(struct leases *leases, struct lease_counts *counts)
{
    expire(leases);
    *counts = leases->counts;
    counts->expected = leases->expected;
    for (const struct lease *lease = leases->first; lease; lease = lease->next) {
        bool held = lease->id[0] && !lease->waiting;

        counts->held += held;
        counts->offered += !held;
    }
}

void leases_count(struct leases *leases, struct lease_counts *counts)
{
    pthread_mutex_lock(&leases->mutex);
    count(leases, counts);
    pthread_mutex_unlock(&leases->mutex);
}

void leases_expect(struct leases *leases, size_t workers)
{
    pthread_mutex_lock(&leases->mutex);
    leases->expected = workers;
    pthread_cond_broadcast(&leases->room);
    pthread_mutex_unlock(&leases->mutex);
}

/* ------------------------------------------------------------------- lending */

/* Under the mutex. */
static bool is_room(struct leases *leases)
{
    struct lease_counts counts;
    size_t usual;

    count(leases, &counts);
    usual = LIMIT_LEASES_OFFERED + counts.held / LEASES_HELD_SHARE;
    return counts.offered < usual || counts.offered + counts.held < counts.expected;
}

bool leases_room(struct leases *leases, int64_t wait_ms)
{
    const struct timespec until = deadline_in_ms(wait_ms);
    bool room;

    pthread_mutex_lock(&leases->mutex);
    while (!(room = is_room(leases)) && !leases->woken)
        if (!wait_until(leases, &leases->room, &until))
            break;
    pthread_mutex_unlock(&leases->mutex);
    return room;
}

struct lease *lease_offer(struct leases *leases, const struct task *task, struct lease_terms *terms)
{
    struct lease *lease = calloc(1, sizeof *lease);

    if (!lease)
        return NULL;
    lease->leases = leases;
    lease->task = task;
    lease->terms = *terms;
    terms->checkpoint = terms->begun = (struct blob){0};
    deadline_condition(&lease->changed);
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
    const struct timespec until = deadline_in_ms(wait_ms);

    *news = (struct lease_news){0};
    pthread_mutex_lock(&leases->mutex);
    while (!lease->returned && !lease->failed && !lease->fresh && !lease->woken)
        if (!wait_until(leases, &lease->changed, &until))
            break;
    news->core_seconds = lease->core_seconds - lease->told_seconds;
    lease->told_seconds = lease->core_seconds;
    news->returned = lease->returned;
    news->tally = lease->tally;
    lease->tally = (struct blob){0};
    news->failed = lease->failed;
    news->error = lease->error;
    if (lease->fresh && !lease->returned)
        news->checkpoint = copy(&lease->terms.checkpoint);
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
    leases->woken = true;
    pthread_cond_broadcast(&leases->room);
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
    pthread_cond_signal(&leases->room);
    pthread_mutex_unlock(&leases->mutex);
    pthread_cond_destroy(&lease->changed);
    blob_fini(&lease->terms.checkpoint);
    blob_fini(&lease->terms.begun);
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
static enum store_status lend(struct lease *lease, const struct lease_asker *asker,
                              struct lease_loan *loan)
{
    struct grant *grant = &lease->grants[lease->attempts % GRANTS];
    const struct task *task = lease->task;

    *loan = (struct lease_loan){.chunk = task->chunk,
                                .attempt = lease->attempts + 1,
                                .lease_ms = lease->leases->lease_ms,
                                .scene = scene_json_job(task->scene),
                                .core_seconds_max = lease->terms.core_seconds_max,
                                .bytes_max = lease->terms.bytes_max,
                                .checkpoint = copy(&lease->terms.checkpoint),
                                .begun = copy(&lease->terms.begun)};
    snprintf(loan->job, sizeof loan->job, "%s", task->id);
    if (!loan->scene || !loan->checkpoint.bytes || !loan->begun.bytes ||
        !queue_hash(task->scene, loan->hash) || !make_id(loan->id)) {
        lease_loan_fini(loan);
        return STORE_BROKEN;
    }
    memcpy(lease->id, loan->id, sizeof lease->id);
    memcpy(grant->id, loan->id, sizeof grant->id);
    snprintf(grant->owner, sizeof grant->owner, "%s", asker->owner);
    memcpy(lease->owner, grant->owner, sizeof lease->owner);
    snprintf(lease->worker, sizeof lease->worker, "%s", asker->worker);
    lease->waiting = false;
    lease->attempts++;
    lease->heard_ms = now_ms();
    lease->until_ms = lease->heard_ms + lease->leases->lease_ms;
    lease->core_seconds = lease->told_seconds = 0;
    lease->leases->counts.granted++;
    pthread_cond_signal(&lease->leases->room);
    return STORE_OK;
}

/* Whose run of it failed just now leaves it to others first. */
static bool may_have(const struct lease *lease, const struct lease_asker *asker)
{
    return !lease->id[0] && !lease->returned && !lease->failed &&
           !atomic_load(lease->task->cancelled) &&
           (lease->failures == 0 || strcmp(lease->worker, asker->worker) != 0 ||
            now_ms() >= lease->failed_ms + lease->leases->lease_ms);
}

enum store_status leases_take(struct leases *leases, const struct lease_asker *asker,
                              struct lease_loan *loan)
{
    enum store_status status = STORE_NOT_FOUND;
    struct lease *lease;

    pthread_mutex_lock(&leases->mutex);
    expire(leases);
    lease = leases->first;
    while (lease && !may_have(lease, asker))
        lease = lease->next;
    if (lease)
        status = lend(lease, asker, loan);
    leases->counts.missed += !lease;
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

static bool was_theirs(const struct lease *lease, const struct lease_word *word)
{
    for (int i = 0; i < GRANTS; i++)
        if (lease->grants[i].id[0] && strcmp(lease->grants[i].id, word->id) == 0 &&
            strcmp(lease->grants[i].owner, word->owner) == 0)
            return true;
    return false;
}

/* One who has what nobody has (any more) is taken for its worker: the heartbeat was late, or the
 * daemon was started anew and has not given it to anybody yet. What was used before that has been
 * told to the daemon of then. */
static bool is_theirs(struct lease *lease, const struct lease_word *word)
{
    if (!lease->id[0] && (lease->attempts == 0 || was_theirs(lease, word))) {
        memcpy(lease->id, word->id, sizeof lease->id);
        memcpy(lease->owner, word->owner, sizeof lease->owner);
        if (lease->attempts == 0) {
            lease->heard_ms = now_ms();
            lease->core_seconds = lease->told_seconds = word->core_seconds;
        }
    }
    return lease->id[0] && strcmp(lease->id, word->id) == 0 &&
           strcmp(lease->owner, word->owner) == 0;
}

/* A core gives no more than a second in each. */
static void note_use(struct lease *lease, double core_seconds)
{
    enum { SLACK_MS = 1000 };
    int64_t now = now_ms();
    double most = lease->core_seconds + 1e-3 * (double)(now - lease->heard_ms + SLACK_MS);

    lease->heard_ms = now;
    if (core_seconds > lease->core_seconds)
        lease->core_seconds = core_seconds < most ? core_seconds : most;
}

static void note_progress(struct lease *lease, const struct lease_word *word)
{
    if (word->ticks_total > 0 && word->ticks_done >= 0 && word->ticks_done <= word->ticks_total) {
        atomic_store(lease->task->ticks_done, word->ticks_done);
        atomic_store(lease->task->ticks_total, word->ticks_total);
    }
    note_use(lease, word->core_seconds);
}

/* A run that failed, or gave what is no tally, may be the fault of one machine: another one tries,
 * and the job fails when that comes to the same. */
static void note_failure(struct lease *lease, const char *reason)
{
    snprintf(lease->error.text, sizeof lease->error.text, "%s", reason); /* of any length */
    log_write(LOG_LEVEL_WARNING, "lease_failed",
              LOG_FIELDS(log_text("job", lease->task->id), log_integer("chunk", lease->task->chunk),
                         log_text("worker", lease->worker), log_text("reason", lease->error.text)));
    lease->id[0] = '\0';
    lease->failed_ms = now_ms();
    lease->failed = ++lease->failures >= LIMIT_LEASE_FAILURES;
}

/* A heartbeat that was sent before and comes after this takes it up no more. */
static void let_go(struct lease *lease)
{
    for (int i = 0; i < GRANTS; i++)
        if (strcmp(lease->grants[i].id, lease->id) == 0)
            lease->grants[i].id[0] = '\0';
    lease->id[0] = '\0';
    if (lease->attempts == 0) /* it had it since before the daemon's start */
        lease->attempts = 1;
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
        lease->waiting = word->waiting;
        note_progress(lease, word);
        if (word->bytes.size > 0) {
            struct blob newer = copy(&word->bytes);

            if (newer.bytes) {
                blob_fini(&lease->terms.checkpoint);
                lease->terms.checkpoint = newer;
                lease->fresh = true;
            }
        }
        if (word->failed)
            note_failure(lease, word->failed);
        if (word->let_go)
            let_go(lease);
        pthread_cond_signal(&lease->changed);
    }
    pthread_mutex_unlock(&leases->mutex);
    return answer;
}

enum lease_answer leases_look(struct leases *leases, const struct lease_word *word)
{
    enum lease_answer answer = LEASE_UNKNOWN;
    const struct lease *lease;

    pthread_mutex_lock(&leases->mutex);
    expire(leases);
    lease = find(leases, word);
    if (lease)
        answer = !lease->returned && !lease->failed && !atomic_load(lease->task->cancelled) &&
                         strcmp(lease->id, word->id) == 0
                     ? LEASE_GO_ON
                     : LEASE_STOP;
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
        if (lease->id[0] && is_theirs(lease, word)) {
            note_failure(lease, "what came back was no result of this part");
            pthread_cond_signal(&lease->changed);
        }
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
    else if (lease->failed || atomic_load(lease->task->cancelled) ||
             (!was_theirs(lease, word) && !is_theirs(lease, word)))
        answer = LEASE_STOP;
    else
        answer = take_result(lease, word);
    leases->counts.unwanted += answer == LEASE_STOP || answer == LEASE_UNKNOWN;
    pthread_mutex_unlock(&leases->mutex);
    return answer;
}
