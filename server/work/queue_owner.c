/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue_owner.c - whose turn it is, and what they have used; see queue_internal.h.
 *
 * The owner who has used the least goes first, as used up core seconds are forgotten by half every
 * LIMIT_USAGE_HALF_LIFE_MS. Nobody starves: who runs uses, who waits forgets. But a person who
 * comes with one job after a pause should not wait until a sweep has caught up with what they used
 * yesterday: the first chunk of a newcomer goes out of turn. Not two such in a row while others
 * have work, for else people who come and go could keep a sweep waiting for ever.
 */
#include "queue_internal.h"

#include "limits.h"
#include "store_attempts.h"
#include "store_owners.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { USES = 64 }; /* jobs in one transaction */

int64_t owner_now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

struct owner *owner_find(struct queue *queue, const char *name)
{
    struct owner **last = &queue->owners;

    while (*last && strcmp((*last)->name, name) != 0)
        last = &(*last)->next;
    if (!*last) {
        *last = calloc(1, sizeof **last);
        if (*last)
            snprintf((*last)->name, sizeof(*last)->name, "%s", name);
    }
    return *last;
}

int64_t owner_steady_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static bool rests(struct queued *entry)
{
    if (entry->rests_until_ms != 0 && owner_steady_ms() >= entry->rests_until_ms)
        entry->rests_until_ms = 0;
    return entry->rests_until_ms != 0;
}

struct queued *owner_resting(struct queue *queue)
{
    struct queued *first = NULL;

    for (struct owner *owner = queue->owners; owner; owner = owner->next)
        for (struct queued *entry = owner->first; entry; entry = entry->next)
            if (!entry->ended && rests(entry) &&
                (!first || entry->rests_until_ms < first->rests_until_ms))
                first = entry;
    return first;
}

/* Whether a goes before b, both of one owner. */
static bool goes_before(const struct queued *a, const struct queued *b)
{
    return a->priority != b->priority ? a->priority > b->priority : a->seq < b->seq;
}

static bool has_work(struct queued *entry)
{
    if (entry->ended)
        return false;
    if (entry->resumes)
        return !entry->pinned;
    return entry->started && !entry->aside && entry_next_chunk(entry) != entry->chunks;
}

struct queued *owner_entry(struct owner *owner)
{
    struct queued *best = NULL;

    for (struct queued *entry = owner->first; entry; entry = entry->next)
        if ((!best || goes_before(entry, best)) && has_work(entry) && !rests(entry))
            best = entry;
    return best;
}

/* Whether a has used less than b; fewer chunks in motion where both have used the same. */
static bool used_less(const struct owner *a, const struct owner *b, int64_t now_ms)
{
    double usage_a = owner_decay(a->usage, now_ms - a->usage_ms);
    double usage_b = owner_decay(b->usage, now_ms - b->usage_ms);

    return usage_a != usage_b ? usage_a < usage_b : a->claims < b->claims;
}

static size_t count_aside(const struct owner *owner, bool in_motion)
{
    size_t count = 0;

    for (const struct queued *entry = owner->first; entry; entry = entry->next)
        count += entry->aside && !entry->ended && entry->pinned == in_motion;
    return count;
}

bool owner_may_start(const struct owner *owner)
{
    return owner->waiting && count_aside(owner, false) < LIMIT_FINISHES_WAITING;
}

struct queued *owner_finish(struct queue *queue, size_t threads)
{
    struct owner *fair = NULL;
    struct queued *best = NULL;
    size_t moving = 0, finishing = 0;
    int64_t now_ms = owner_now_ms();

    for (struct owner *owner = queue->owners; owner; owner = owner->next) {
        size_t own = count_aside(owner, true);

        finishing += own;
        moving += own + owner->claims;
        if (count_aside(owner, false) > 0 && (!fair || used_less(owner, fair, now_ms)))
            fair = owner;
    }
    if (!fair || (finishing > 0 && moving >= threads))
        return NULL;
    for (struct queued *entry = fair->first; entry; entry = entry->next)
        if (entry->aside && !entry->pinned && !entry->ended && (!best || goes_before(entry, best)))
            best = entry;
    return best;
}

struct owner *owner_choose(struct queue *queue, bool *jumps)
{
    struct owner *fair = NULL, *newcomer = NULL;
    int64_t now_ms = owner_now_ms();

    for (struct owner *owner = queue->owners; owner; owner = owner->next) {
        if (!owner_may_start(owner) && !owner_entry(owner))
            continue;
        if (!fair || used_less(owner, fair, now_ms))
            fair = owner;
        if (!owner->greeted && (!newcomer || used_less(owner, newcomer, now_ms)))
            newcomer = owner;
    }
    *jumps = newcomer && newcomer != fair && !queue->jumped;
    return *jumps ? newcomer : fair;
}

bool owner_gives_way(struct queue *queue, const struct owner *owner)
{
    bool jumps = false;
    const struct owner *next = owner_choose(queue, &jumps);

    return next && next != owner && (jumps || used_less(next, owner, owner_now_ms()));
}

/* ---------------------------------------------------------------------- usage */

/* With the mutex held. */
static void spend(struct queue *queue, struct owner *owner, double seconds)
{
    int64_t now_ms = owner_now_ms();

    owner->usage = owner_decay(owner->usage, now_ms - owner->usage_ms) + seconds;
    owner->usage_ms = now_ms;
    owner->unsaved += seconds;
    if (!queue->saving && (now_ms >= queue->saved_ms + LIMIT_USAGE_SAVE_MS ||
                           now_ms < queue->saved_ms)) /* the clock was set back */
        owner_save_usage(queue);
}

void queue_spend(struct queue *queue, const struct task *task, double seconds)
{
    struct queued *entry = task->entry;

    if (!(seconds > 0))
        return;
    pthread_mutex_lock(&queue->mutex);
    if (entry) {
        entry->spent += seconds;
        entry->untold += seconds;
    }
    spend(queue, task->owner, seconds);
    pthread_mutex_unlock(&queue->mutex);
}

void queue_spent_take(struct queue *queue, const struct task *task, double *seconds, double *untold)
{
    struct queued *entry = task->entry;

    pthread_mutex_lock(&queue->mutex);
    *seconds = entry->spent;
    *untold = entry->untold;
    entry->untold = 0;
    pthread_mutex_unlock(&queue->mutex);
}

void queue_spend_of(struct queue *queue, const char *name, double seconds)
{
    struct owner *owner;

    if (!(seconds > 0))
        return;
    pthread_mutex_lock(&queue->mutex);
    owner = owner_find(queue, name);
    if (owner) /* without memory it is a present */
        spend(queue, owner, seconds);
    pthread_mutex_unlock(&queue->mutex);
}

/* What jobs in motion have used, as many of them as fit: the others next time. */
static void save_uses(struct queue *queue)
{
    struct attempt_use uses[USES];
    size_t count = 0;

    for (struct owner *owner = queue->owners; owner; owner = owner->next)
        for (struct queued *entry = owner->first; entry && count < USES; entry = entry->next) {
            if (!(entry->untold > 0) || !entry->started)
                continue;
            memcpy(uses[count].job, entry->id, sizeof entry->id);
            uses[count++].seconds = entry->untold;
            entry->untold = 0;
        }
    pthread_mutex_unlock(&queue->mutex);
    /* What a store cannot take, and has logged why, the attempts lack. */
    if (count > 0)
        store_attempts_use(queue->store, uses, count);
    pthread_mutex_lock(&queue->mutex);
}

void owner_save_usage(struct queue *queue)
{
    queue->saving = true;
    for (struct owner *owner = queue->owners; owner; owner = owner->next) {
        double seconds = owner->unsaved;
        enum store_status status;

        if (!(seconds > 0))
            continue;
        owner->unsaved = 0;
        pthread_mutex_unlock(&queue->mutex);
        status = store_owners_spend(queue->store, owner->name, seconds);
        pthread_mutex_lock(&queue->mutex);
        if (status) /* the store has logged why; it comes along next time */
            owner->unsaved += seconds;
    }
    save_uses(queue);
    pthread_mutex_unlock(&queue->mutex);
    calibration_save(queue->calibration, queue->store); /* the store logs why not; next time then */
    pthread_mutex_lock(&queue->mutex);
    queue->saving = false;
    queue->saved_ms = owner_now_ms();
}
