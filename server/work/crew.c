/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * crew.c - see crew.h.
 *
 * A leader's shares have numbers, and `turn` holds that of the newest with how many of its parts
 * are taken from the front and from the back: whoever counts one of these up has taken that part.
 * What is shared is written before the number is and stays until all parts are done; so whoever
 * took a part of a share knows what it is, and whoever comes too late takes none. `done` counts
 * parts that are done. The leader takes parts from the front and the first helper from the back, so
 * that from one share to the next most rods stay with the processor whose cache has them.
 */
#include "crew.h"
#include "crash.h"
#include "deadline.h"

#include <assert.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum {
    PART_BITS = 16, /* of each of the two counts */
    TAKEN_MAX = (1 << PART_BITS) - 1,
    NUMBER_SHIFT = 2 * PART_BITS,
    LOOKS = 2000,     /* at another's work before sleeping: some ten microseconds */
    NAP_MS = 2,       /* of a helper, before it looks whether it is wanted elsewhere */
    TELLING_MS = 10,  /* what takes less time tells little */
    ALONE_EVERY = 64, /* slices with help, until one without tells what there is to gain */
    REST_MIN = 4,     /* slices without, where help does not pay: twice as many each time */
    REST_MAX = 64,
    PAYS_PERCENT = 95, /* of the time that it takes without */
    CACHE_LINE = 128,  /* two: processors fetch pairs */
};

/* ns per tick, 0 = not known: without help and with it. */
struct pace {
    double alone, helped;
    int left; /* slices until it is tried the other way */
    int rest; /* slices without help next time that it does not pay */
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
    atomic_bool alone;                       /* the leader does without help for a while */
    atomic_uint term;                        /* odd: there is a leader */
    _Atomic int64_t helped_ns;
    struct pace pace; /* the leader's */
    /* Under the crew's mutex: */
    struct crew *crew;
    char job[JOB_ID_SIZE];
    int64_t chunk;
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

/* What `turn` says. */
static int64_t taken_of(uint64_t turn, bool back)
{
    return (int64_t)(turn >> (back ? PART_BITS : 0) & TAKEN_MAX);
}

/* Takes a part of share number `share`, if one is left: does it and returns true. */
static bool take_part(struct crew_lead *lead, uint64_t share, bool back)
{
    uint64_t turn = atomic_load(&lead->turn);
    int64_t part, parts;
    bcd_part work;
    void *of;

    do {
        part = taken_of(turn, back);
        parts = atomic_load_explicit(&lead->parts, memory_order_acquire);
        work = atomic_load_explicit(&lead->part, memory_order_relaxed);
        of = atomic_load_explicit(&lead->of, memory_order_relaxed);
        if (turn >> NUMBER_SHIFT != share || part + taken_of(turn, !back) >= parts)
            return false;
    } while (!atomic_compare_exchange_weak(&lead->turn, &turn,
                                           turn + (UINT64_C(1) << (back ? PART_BITS : 0))));
    part = back ? parts - 1 - part : part;
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

    if (atomic_load_explicit(&lead->alone, memory_order_relaxed))
        return 0;
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
    const uint32_t closed = (uint32_t)(atomic_load(&lead->turn) >> NUMBER_SHIFT);
    const uint64_t number = (uint32_t)(closed + 1); /* begins anew after 2^32 */

    assert(parts < TAKEN_MAX); /* 2500 of the largest ring there may be */
    /* Who comes late, and has looked at the old number, must not see the new parts as left of the
     * old share: that one is closed before anything of the new one can be seen. */
    atomic_exchange(&lead->turn, (uint64_t)closed << NUMBER_SHIFT | TAKEN_MAX);
    atomic_store_explicit(&lead->part, part, memory_order_release);
    atomic_store_explicit(&lead->of, of, memory_order_release);
    atomic_store_explicit(&lead->parts, parts, memory_order_release);
    atomic_store_explicit(&lead->done, 0, memory_order_relaxed);
    atomic_store(&lead->turn, number << NUMBER_SHIFT);
    if (atomic_load(&lead->asleep) > 0) {
        pthread_mutex_lock(&lead->mutex);
        pthread_cond_broadcast(&lead->shared);
        pthread_mutex_unlock(&lead->mutex);
    }
    while (take_part(lead, number, false))
        ;
    wait_for_others(lead, parts);
}

static bool has_leader(unsigned term)
{
    return term % 2 == 1;
}

struct crew_lead *crew_lead(struct crew *crew, const char *job, int64_t chunk)
{
    struct crew_lead *lead = NULL;

    if (!crew)
        return NULL;
    pthread_mutex_lock(&crew->mutex);
    for (size_t i = 0; i < crew->count && !lead; i++)
        if (!has_leader(atomic_load(&crew->each[i].term)))
            lead = &crew->each[i];
    if (lead) {
        snprintf(lead->job, sizeof lead->job, "%s", job);
        lead->chunk = chunk;
        lead->pace = (struct pace){.rest = REST_MIN};
        atomic_store(&lead->alone, false);
        atomic_store(&lead->helped_ns, 0);
        atomic_fetch_add(&lead->term, 1);
    }
    pthread_mutex_unlock(&crew->mutex);
    return lead;
}

const struct bcd_hands *crew_hands(struct crew_lead *lead)
{
    return &lead->hands;
}

void crew_note(struct crew_lead *lead, int64_t ticks, int64_t elapsed_ns)
{
    struct pace *pace = &lead->pace;
    const double ns = (double)elapsed_ns / (double)ticks;
    const bool alone = atomic_load(&lead->alone);

    if (elapsed_ns < TELLING_MS * INT64_C(1000000) || atomic_load(&lead->helpers) == 0)
        return;
    *(alone ? &pace->alone : &pace->helped) = ns;
    if (alone) {
        atomic_store(&lead->alone, --pace->left > 0);
        if (pace->left == 0)
            pace->left = ALONE_EVERY;
        return;
    }
    const bool pays = pace->helped < pace->alone * PAYS_PERCENT / 100;
    if (pays && --pace->left > 0)
        return;
    if (pays || pace->alone == 0) { /* a look at what it is without */
        pace->left = 1;
        pace->rest = REST_MIN;
    } else {
        pace->left = pace->rest;
        pace->rest = 2 * pace->rest < REST_MAX ? 2 * pace->rest : REST_MAX;
    }
    atomic_store(&lead->alone, true);
}

int64_t crew_helped_ns(struct crew_lead *lead)
{
    return lead ? atomic_exchange(&lead->helped_ns, 0) : 0;
}

void crew_end(struct crew_lead *lead)
{
    if (!lead)
        return;
    pthread_mutex_lock(&lead->crew->mutex);
    atomic_fetch_add(&lead->term, 1);
    pthread_mutex_unlock(&lead->crew->mutex);
    pthread_mutex_lock(&lead->mutex);
    pthread_cond_broadcast(&lead->shared);
    pthread_mutex_unlock(&lead->mutex);
}

/* ---------------------------------------------------------------------- helping */

/* One more helper, of the leader of that term. */
struct joined {
    struct crew_lead *lead;
    unsigned term;
    bool back; /* where it takes parts from */
};

static bool still_leads(const struct joined *joined)
{
    return atomic_load(&joined->lead->term) == joined->term;
}

/* The next share after `seen`; false = none came for a while. */
static bool await_share(const struct joined *joined, uint64_t seen)
{
    struct crew_lead *lead = joined->lead;
    struct timespec until;

    for (int i = 0; i < LOOKS; i++) {
        if (atomic_load(&lead->turn) >> NUMBER_SHIFT != seen)
            return true;
        pause_briefly();
    }
    until = deadline_in_ms(NAP_MS);
    pthread_mutex_lock(&lead->mutex);
    atomic_fetch_add(&lead->asleep, 1);
    if (atomic_load(&lead->turn) >> NUMBER_SHIFT == seen && still_leads(joined))
        pthread_cond_timedwait(&lead->shared, &lead->mutex, &until);
    atomic_fetch_sub(&lead->asleep, 1);
    pthread_mutex_unlock(&lead->mutex);
    return atomic_load(&lead->turn) >> NUMBER_SHIFT != seen;
}

static void help(const struct joined *joined, bool (*wanted)(void *context), void *context)
{
    struct crew_lead *lead = joined->lead;
    int64_t told_ns = cpu_ns();
    uint64_t seen = atomic_load(&lead->turn) >> NUMBER_SHIFT;

    while (still_leads(joined) && !wanted(context)) {
        int64_t now_ns;

        if (take_part(lead, seen, joined->back))
            continue;
        now_ns = cpu_ns();
        atomic_fetch_add(&lead->helped_ns, now_ns - told_ns);
        told_ns = now_ns;
        if (await_share(joined, seen))
            seen = atomic_load(&lead->turn) >> NUMBER_SHIFT;
    }
}

/* The leader with the fewest helpers, as one more of them. */
static struct joined join(struct crew *crew)
{
    struct joined joined = {0};
    int fewest = 0;

    pthread_mutex_lock(&crew->mutex);
    for (size_t i = 0; i < crew->count; i++) {
        struct crew_lead *lead = &crew->each[i];
        unsigned term = atomic_load(&lead->term);
        int helpers = atomic_load(&lead->helpers);

        if (has_leader(term) && (!joined.lead || helpers < fewest)) {
            joined = (struct joined){lead, term, helpers % 2 == 0};
            fewest = helpers;
        }
    }
    if (joined.lead) {
        atomic_fetch_add(&joined.lead->helpers, 1);
        crash_note(joined.lead->job, joined.lead->chunk);
    }
    pthread_mutex_unlock(&crew->mutex);
    return joined;
}

bool crew_help(struct crew *crew, bool (*wanted)(void *context), void *context)
{
    struct joined joined = {0};

    if (crew)
        joined = join(crew);
    if (!joined.lead)
        return false;
    help(&joined, wanted, context);
    atomic_fetch_sub(&joined.lead->helpers, 1);
    crash_note(NULL, 0);
    return true;
}

size_t crew_helpers(struct crew *crew)
{
    size_t helpers = 0;

    for (size_t i = 0; crew && i < crew->count; i++)
        helpers += (size_t)atomic_load(&crew->each[i].helpers);
    return helpers;
}

/* ------------------------------------------------------------------- lifetime */

struct crew *crew_create(size_t leaders)
{
    const size_t size = sizeof(struct crew) + leaders * sizeof(struct crew_lead);
    struct crew *crew =
        aligned_alloc(_Alignof(struct crew), (size + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE);

    if (!crew)
        return NULL;
    *crew = (struct crew){.count = leaders};
    pthread_mutex_init(&crew->mutex, NULL);
    for (size_t i = 0; i < leaders; i++) {
        struct crew_lead *lead = &crew->each[i];

        *lead = (struct crew_lead){.crew = crew, .hands = {count_helpers, share, lead}};
        pthread_mutex_init(&lead->mutex, NULL);
        deadline_condition(&lead->shared);
        pthread_cond_init(&lead->finished, NULL);
    }
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
