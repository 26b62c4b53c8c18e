/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * crew.c - see crew.h.
 *
 * A leader's shares have numbers, and `turn` holds that of the newest with the next part to be
 * taken: whoever counts it up has taken that part. What is shared is written before the number is
 * and stays until all parts are done; so whoever took a part of a share knows what it is, and
 * whoever comes too late takes none. `done` counts parts that are done.
 */
#include "crew.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>

enum {
    PART_BITS = 24,
    LOOKS = 2000,     /* at another's work before sleeping: some ten microseconds */
    NAP_MS = 2,       /* of a helper, before it looks whether it is wanted elsewhere */
    CACHE_LINE = 128, /* two: processors fetch pairs */
};

struct crew_lead {
    _Alignas(CACHE_LINE) _Atomic uint64_t turn;
    _Alignas(CACHE_LINE) _Atomic int64_t done;
    _Alignas(CACHE_LINE) _Atomic(bcd_part) part; /* what is shared */
    _Atomic(void *) of;
    _Atomic int64_t parts;
    struct bcd_hands hands;
    _Alignas(CACHE_LINE) atomic_int helpers; /* that are here, */
    atomic_int asleep;                       /* and of them */
    atomic_bool waits;                       /* the leader sleeps until all parts are done */
    atomic_bool open;
    _Atomic int64_t helped_ns;
    bool taken;            /* under the crew's mutex */
    pthread_mutex_t mutex; /* to sleep on */
    pthread_cond_t shared, finished;
};

struct crew {
    pthread_mutex_t mutex;
    size_t count;
    struct crew_lead each[];
};

static void pause_briefly(void)
{
#ifdef __x86_64__
    __builtin_ia32_pause();
#endif
}

static int64_t cpu_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* Takes a part of share number `share`, if one is left: does it and returns true. */
static bool take_part(struct crew_lead *lead, uint64_t share)
{
    uint64_t turn = atomic_load(&lead->turn);
    int64_t part, parts;
    bcd_part work;
    void *of;

    do {
        part = (int64_t)(turn & ((UINT64_C(1) << PART_BITS) - 1));
        parts = atomic_load_explicit(&lead->parts, memory_order_relaxed);
        work = atomic_load_explicit(&lead->part, memory_order_relaxed);
        of = atomic_load_explicit(&lead->of, memory_order_relaxed);
        if (turn >> PART_BITS != share || part >= parts)
            return false;
    } while (!atomic_compare_exchange_weak(&lead->turn, &turn, turn + 1));
    work(of, part);
    if (atomic_fetch_add(&lead->done, 1) + 1 == parts && atomic_load(&lead->waits)) {
        pthread_mutex_lock(&lead->mutex);
        pthread_cond_signal(&lead->finished);
        pthread_mutex_unlock(&lead->mutex);
    }
    return true;
}

/* ---------------------------------------------------------------------- leading */

static int count_helpers(void *context)
{
    struct crew_lead *lead = context;

    return atomic_load_explicit(&lead->helpers, memory_order_relaxed);
}

static void wait_for_others(struct crew_lead *lead, int64_t parts)
{
    for (int i = 0; i < LOOKS; i++) {
        if (atomic_load(&lead->done) == parts)
            return;
        pause_briefly();
    }
    pthread_mutex_lock(&lead->mutex);
    atomic_store(&lead->waits, true);
    while (atomic_load(&lead->done) != parts)
        pthread_cond_wait(&lead->finished, &lead->mutex);
    atomic_store(&lead->waits, false);
    pthread_mutex_unlock(&lead->mutex);
}

static void share(void *context, bcd_part part, void *of, int64_t parts)
{
    struct crew_lead *lead = context;
    const uint64_t number = (atomic_load(&lead->turn) >> PART_BITS) + 1;

    assert(parts < INT64_C(1) << PART_BITS);
    atomic_store_explicit(&lead->part, part, memory_order_relaxed);
    atomic_store_explicit(&lead->of, of, memory_order_relaxed);
    atomic_store_explicit(&lead->parts, parts, memory_order_relaxed);
    atomic_store_explicit(&lead->done, 0, memory_order_relaxed);
    atomic_store(&lead->turn, number << PART_BITS);
    if (atomic_load(&lead->asleep) > 0) {
        pthread_mutex_lock(&lead->mutex);
        pthread_cond_broadcast(&lead->shared);
        pthread_mutex_unlock(&lead->mutex);
    }
    while (take_part(lead, number))
        ;
    wait_for_others(lead, parts);
}

struct crew_lead *crew_lead(struct crew *crew)
{
    struct crew_lead *lead = NULL;

    pthread_mutex_lock(&crew->mutex);
    for (size_t i = 0; i < crew->count && !lead; i++)
        if (!crew->each[i].taken)
            lead = &crew->each[i];
    if (lead) {
        lead->taken = true;
        atomic_store(&lead->open, true);
    }
    pthread_mutex_unlock(&crew->mutex);
    return lead;
}

const struct bcd_hands *crew_hands(struct crew_lead *lead)
{
    return &lead->hands;
}

int64_t crew_helped_ns(struct crew_lead *lead)
{
    return atomic_exchange(&lead->helped_ns, 0);
}

void crew_end(struct crew_lead *lead)
{
    if (!lead)
        return;
    atomic_store(&lead->open, false);
    pthread_mutex_lock(&lead->mutex);
    pthread_cond_broadcast(&lead->shared);
    while (atomic_load(&lead->helpers) > 0)
        pthread_cond_wait(&lead->finished, &lead->mutex);
    pthread_mutex_unlock(&lead->mutex);
    lead->taken = false;
}

/* ---------------------------------------------------------------------- helping */

/* The next share after `seen`; false = none came for a while. */
static bool await_share(struct crew_lead *lead, uint64_t seen)
{
    struct timespec until;

    for (int i = 0; i < LOOKS; i++) {
        if (atomic_load(&lead->turn) >> PART_BITS != seen)
            return true;
        pause_briefly();
    }
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += NAP_MS * 1000000L;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    pthread_mutex_lock(&lead->mutex);
    atomic_fetch_add(&lead->asleep, 1);
    if (atomic_load(&lead->turn) >> PART_BITS == seen && atomic_load(&lead->open))
        pthread_cond_timedwait(&lead->shared, &lead->mutex, &until);
    atomic_fetch_sub(&lead->asleep, 1);
    pthread_mutex_unlock(&lead->mutex);
    return atomic_load(&lead->turn) >> PART_BITS != seen;
}

static void help(struct crew_lead *lead, bool (*wanted)(void *context), void *context)
{
    const int64_t from_ns = cpu_ns();
    uint64_t seen = atomic_load(&lead->turn) >> PART_BITS;

    while (atomic_load(&lead->open) && !wanted(context)) {
        if (take_part(lead, seen))
            continue;
        if (await_share(lead, seen))
            seen = atomic_load(&lead->turn) >> PART_BITS;
    }
    atomic_fetch_add(&lead->helped_ns, cpu_ns() - from_ns);
    pthread_mutex_lock(&lead->mutex);
    atomic_fetch_sub(&lead->helpers, 1);
    pthread_cond_signal(&lead->finished);
    pthread_mutex_unlock(&lead->mutex);
}

/* The leader with the fewest helpers, as one more of them. */
static struct crew_lead *choose(struct crew *crew)
{
    struct crew_lead *lead = NULL;

    pthread_mutex_lock(&crew->mutex);
    for (size_t i = 0; i < crew->count; i++) {
        struct crew_lead *one = &crew->each[i];

        if (one->taken && atomic_load(&one->open) &&
            (!lead || atomic_load(&one->helpers) < atomic_load(&lead->helpers)))
            lead = one;
    }
    if (lead)
        atomic_fetch_add(&lead->helpers, 1);
    pthread_mutex_unlock(&crew->mutex);
    return lead;
}

bool crew_help(struct crew *crew, bool (*wanted)(void *context), void *context)
{
    struct crew_lead *lead = choose(crew);

    if (lead)
        help(lead, wanted, context);
    return lead != NULL;
}

/* ------------------------------------------------------------------- lifetime */

struct crew *crew_create(size_t leaders)
{
    const size_t size = sizeof(struct crew) + leaders * sizeof(struct crew_lead);
    struct crew *crew =
        aligned_alloc(_Alignof(struct crew), (size + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE);
    pthread_condattr_t attributes;

    if (!crew)
        return NULL;
    *crew = (struct crew){.count = leaders};
    pthread_mutex_init(&crew->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    for (size_t i = 0; i < leaders; i++) {
        struct crew_lead *lead = &crew->each[i];

        *lead = (struct crew_lead){.hands = {count_helpers, share, lead}};
        pthread_mutex_init(&lead->mutex, NULL);
        pthread_cond_init(&lead->shared, &attributes);
        pthread_cond_init(&lead->finished, NULL);
    }
    pthread_condattr_destroy(&attributes);
    return crew;
}

void crew_free(struct crew *crew)
{
    if (!crew)
        return;
    for (size_t i = 0; i < crew->count; i++) {
        pthread_cond_destroy(&crew->each[i].finished);
        pthread_cond_destroy(&crew->each[i].shared);
        pthread_mutex_destroy(&crew->each[i].mutex);
    }
    pthread_mutex_destroy(&crew->mutex);
    free(crew);
}
