/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * feed.c - see feed.h. The queue's mutex and the store are asked with the feed's mutex held, never
 * the other way round: the store tells of changes without a lock of its own.
 */
#include "feed.h"
#include "limits.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { ENDED = 256 };

struct feed {
    struct store *store;
    struct queue *queue;
    uint64_t start;
    pthread_mutex_t mutex;
    uint64_t now, lost; /* the newest change; the newest of those that are not in the ring */
    struct job_move ring[LIMIT_FEED_CHANGES]; /* number n at n % LIMIT_FEED_CHANGES */
    struct feed_progress running[LIMIT_FEED_RUNNING];
    size_t running_count;
    int64_t sampled_ms;
    int64_t ended[ENDED]; /* jobs that the queue may not have let go yet */
    size_t ended_count;
    pthread_mutex_t wake_mutex;
    void (*wake)(void *context);
    void *wake_context;
};

static void take(void *context, const struct job_move *moves, size_t count, bool more);
static void end(struct feed *feed, int64_t seq);
static bool has_ended(const struct feed *feed, int64_t seq);
static void sample(struct feed *feed);
static int64_t now_ms(clockid_t clock);

enum store_status feed_create(struct feed **feed, struct store *store, struct queue *queue)
{
    struct feed *made = calloc(1, sizeof *made);

    if (!made)
        return STORE_BROKEN;
    made->store = store;
    made->queue = queue;
    made->start = (uint64_t)now_ms(CLOCK_REALTIME);
    pthread_mutex_init(&made->mutex, NULL);
    pthread_mutex_init(&made->wake_mutex, NULL);
    enum store_status status = store_watch(store, take, made);
    if (status)
        feed_free(made);
    else
        *feed = made;
    return status;
}

void feed_free(struct feed *feed)
{
    if (!feed)
        return;
    store_watch(feed->store, NULL, NULL);
    pthread_mutex_destroy(&feed->mutex);
    pthread_mutex_destroy(&feed->wake_mutex);
    free(feed);
}

void feed_wake(struct feed *feed, void (*wake)(void *context), void *context)
{
    pthread_mutex_lock(&feed->wake_mutex);
    feed->wake = wake;
    feed->wake_context = context;
    pthread_mutex_unlock(&feed->wake_mutex);
}

static void take(void *context, const struct job_move *moves, size_t count, bool more)
{
    struct feed *feed = context;

    pthread_mutex_lock(&feed->mutex);
    for (size_t i = 0; i < count; i++) {
        feed->ring[++feed->now % LIMIT_FEED_CHANGES] = moves[i];
        if (moves[i].state != JOB_QUEUED && moves[i].state != JOB_RUNNING)
            end(feed, moves[i].seq);
    }
    if (more)
        feed->lost = ++feed->now;
    pthread_mutex_unlock(&feed->mutex);
    pthread_mutex_lock(&feed->wake_mutex);
    if (feed->wake)
        feed->wake(feed->wake_context);
    pthread_mutex_unlock(&feed->wake_mutex);
}

/* Whose end was told is not told to be running afterwards. */
static void end(struct feed *feed, int64_t seq)
{
    feed->ended[feed->ended_count++ % ENDED] = seq;
    for (size_t i = 0; i < feed->running_count; i++)
        if (feed->running[i].job.seq == seq)
            feed->running[i--] = feed->running[--feed->running_count];
}

static bool has_ended(const struct feed *feed, int64_t seq)
{
    for (size_t i = 0; i < ENDED; i++)
        if (feed->ended[i] == seq)
            return true;
    return false;
}

uint64_t feed_start(const struct feed *feed)
{
    return feed->start;
}

uint64_t feed_now(struct feed *feed)
{
    pthread_mutex_lock(&feed->mutex);
    uint64_t now = feed->now;
    pthread_mutex_unlock(&feed->mutex);
    return now;
}

/* The first number that is known and after `since`. */
static uint64_t first_known(const struct feed *feed, uint64_t since, bool *lost)
{
    uint64_t oldest = feed->now >= LIMIT_FEED_CHANGES ? feed->now - LIMIT_FEED_CHANGES + 1 : 1;

    if (feed->lost >= oldest)
        oldest = feed->lost + 1;
    if (since == FEED_UNKNOWN) {
        *lost = true;
        return feed->now + 1;
    }
    *lost = since + 1 < oldest;
    return *lost ? oldest : since + 1;
}

bool feed_moved(struct feed *feed, uint64_t *since, int64_t seq)
{
    bool moved;

    pthread_mutex_lock(&feed->mutex);
    uint64_t number = first_known(feed, *since, &moved);
    for (; !moved && number <= feed->now; number++)
        moved = feed->ring[number % LIMIT_FEED_CHANGES].seq == seq;
    if (!moved)
        *since = feed->now;
    pthread_mutex_unlock(&feed->mutex);
    return moved;
}

size_t feed_read(struct feed *feed, uint64_t *since, struct job_move *moves, size_t room,
                 bool *lost)
{
    size_t count = 0;

    pthread_mutex_lock(&feed->mutex);
    uint64_t number = first_known(feed, *since, lost);
    for (; count < room && number <= feed->now; number++)
        moves[count++] = feed->ring[number % LIMIT_FEED_CHANGES];
    *since = number - 1;
    pthread_mutex_unlock(&feed->mutex);
    return count;
}

size_t feed_progress(struct feed *feed, struct feed_progress *jobs, size_t room)
{
    pthread_mutex_lock(&feed->mutex);
    if (feed->queue && now_ms(CLOCK_MONOTONIC) - feed->sampled_ms >= LIMIT_FEED_SAMPLE_MS)
        sample(feed);
    size_t count = feed->running_count < room ? feed->running_count : room;
    memcpy(jobs, feed->running, count * sizeof jobs[0]);
    pthread_mutex_unlock(&feed->mutex);
    return count;
}

static void sample(struct feed *feed)
{
    struct queue_running running[LIMIT_FEED_RUNNING];
    struct feed_progress before[LIMIT_FEED_RUNNING];
    size_t known = feed->running_count;
    size_t count = queue_running(feed->queue, running, LIMIT_FEED_RUNNING);

    memcpy(before, feed->running, known * sizeof before[0]);
    feed->running_count = 0;
    for (size_t i = 0; i < count; i++) {
        struct feed_progress *job = &feed->running[feed->running_count];
        size_t old = 0;
        while (old < known && strcmp(before[old].job.id, running[i].id) != 0)
            old++;
        if (old < known)
            job->job = before[old].job;
        else if (store_watch_job(feed->store, running[i].id, &job->job) != STORE_OK)
            continue;
        if (has_ended(feed, job->job.seq))
            continue;
        job->progress = running[i].progress;
        feed->running_count++;
    }
    feed->sampled_ms = now_ms(CLOCK_MONOTONIC);
}

static int64_t now_ms(clockid_t clock)
{
    struct timespec now;

    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
