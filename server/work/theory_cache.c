/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "theory_cache.h"

#include "deadline.h"
#include "limits.h"

#include <pthread.h>
#include <sha2.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { LOOK_MS = 20, USUAL_BYTES = 2048 };

/* One equilibrium: kept, or (theory NULL) being computed by somebody. */
struct entry {
    unsigned char key[SHA256_DIGEST_LENGTH];
    bool used;
    struct bcd_theory *theory;
    double bytes;
    unsigned holders; /* threads that copy from it */
    uint64_t last;    /* when it was asked for last */
};

/* THREADS  `mutex` guards all of it but what a held theory consists of, which never changes.
 * `changed`: somebody has come to the end of one. */
struct theory_cache {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct entry entries[LIMIT_THEORIES_KEPT];
    double bytes;
    uint64_t now;
    struct theory_counts counts;
};

struct theory_cache *theory_cache_create(void)
{
    struct theory_cache *cache = calloc(1, sizeof *cache);

    if (!cache)
        return NULL;
    pthread_mutex_init(&cache->mutex, NULL);
    deadline_condition(&cache->changed);
    return cache;
}

void theory_cache_free(struct theory_cache *cache)
{
    if (!cache)
        return;
    for (size_t i = 0; i < LIMIT_THEORIES_KEPT; i++)
        bcd_theory_free(cache->entries[i].theory);
    pthread_cond_destroy(&cache->changed);
    pthread_mutex_destroy(&cache->mutex);
    free(cache);
}

void theory_cache_count(struct theory_cache *cache, struct theory_counts *counts)
{
    pthread_mutex_lock(&cache->mutex);
    *counts = cache->counts;
    pthread_mutex_unlock(&cache->mutex);
}

/* A ring's theory and that of the infinite system besides are two. */
static bool key_of(const struct bcd_scene *scene, enum bcd_theory_scope scope,
                   unsigned char key[SHA256_DIGEST_LENGTH])
{
    unsigned char usual[USUAL_BYTES], *bytes = usual, kind = (unsigned char)scope;
    size_t size = bcd_scene_encode_equilibrium(scene, usual, sizeof usual);
    SHA2_CTX context;

    if (size > sizeof usual) {
        bytes = malloc(size);
        if (!bytes)
            return false;
        bcd_scene_encode_equilibrium(scene, bytes, size);
    }
    SHA256Init(&context);
    SHA256Update(&context, &kind, 1);
    SHA256Update(&context, bytes, size);
    SHA256Final(key, &context);
    if (bytes != usual)
        free(bytes);
    return true;
}

static struct entry *find(struct theory_cache *cache, const unsigned char key[SHA256_DIGEST_LENGTH])
{
    for (size_t i = 0; i < LIMIT_THEORIES_KEPT; i++)
        if (cache->entries[i].used && memcmp(cache->entries[i].key, key, SHA256_DIGEST_LENGTH) == 0)
            return &cache->entries[i];
    return NULL;
}

static void drop(struct theory_cache *cache, struct entry *entry)
{
    cache->bytes -= entry->bytes;
    bcd_theory_free(entry->theory);
    *entry = (struct entry){0};
}

/* The one that nobody has asked for the longest; NULL = all are in somebody's hands. */
static struct entry *oldest(struct theory_cache *cache)
{
    struct entry *oldest = NULL;

    for (size_t i = 0; i < LIMIT_THEORIES_KEPT; i++) {
        struct entry *entry = &cache->entries[i];

        if (entry->theory && entry->holders == 0 && (!oldest || entry->last < oldest->last))
            oldest = entry;
    }
    return oldest;
}

/* A place for what is going to be computed; NULL = there is none. */
static struct entry *begin(struct theory_cache *cache,
                           const unsigned char key[SHA256_DIGEST_LENGTH])
{
    struct entry *entry = NULL;

    for (size_t i = 0; i < LIMIT_THEORIES_KEPT && !entry; i++)
        if (!cache->entries[i].used)
            entry = &cache->entries[i];
    if (!entry && (entry = oldest(cache)))
        drop(cache, entry);
    if (!entry)
        return NULL;
    entry->used = true;
    memcpy(entry->key, key, SHA256_DIGEST_LENGTH);
    return entry;
}

/* With the mutex held: false when the watch wants to stop. */
static bool wait_a_moment(struct theory_cache *cache, struct bcd_watch *watch)
{
    const struct timespec until = deadline_in_ms(LOOK_MS);

    pthread_cond_timedwait(&cache->changed, &cache->mutex, &until);
    if (watch->should_stop && watch->should_stop(watch->context))
        watch->end = BCD_WATCH_TOLD;
    return watch->end != BCD_WATCH_TOLD;
}

/* What was computed is for others too, unless a limit of its watch has left something out. */
static void keep(struct theory_cache *cache, struct entry *entry, struct bcd_theory *copy)
{
    pthread_mutex_lock(&cache->mutex);
    entry->theory = copy;
    if (copy) {
        entry->bytes = (double)bcd_theory_bytes(copy);
        entry->last = ++cache->now;
        cache->bytes += entry->bytes;
        for (struct entry *old; cache->bytes > LIMIT_THEORIES_BYTES_MAX && (old = oldest(cache));)
            drop(cache, old);
    } else {
        *entry = (struct entry){0};
    }
    pthread_cond_broadcast(&cache->changed);
    pthread_mutex_unlock(&cache->mutex);
}

static struct bcd_theory *copy_of(const struct bcd_theory *theory, const struct bcd_scene *scene,
                                  enum bcd_theory_scope scope)
{
    struct bcd_theory *copy = NULL;

    if (!bcd_theory_cut_short(theory))
        bcd_theory_create(&copy, scene, scope, NULL, theory); /* without memory there is none */
    return copy;
}

enum bcd_status theory_cache_make(struct theory_cache *cache, const struct bcd_scene *scene,
                                  enum bcd_theory_scope scope, struct bcd_watch *watch,
                                  struct bcd_theory **theory)
{
    unsigned char key[SHA256_DIGEST_LENGTH];
    struct entry *entry;
    enum bcd_status status;

    if (!key_of(scene, scope, key))
        return BCD_NO_MEMORY;
    pthread_mutex_lock(&cache->mutex);
    while ((entry = find(cache, key)) && !entry->theory) {
        if (!wait_a_moment(cache, watch)) {
            pthread_mutex_unlock(&cache->mutex);
            return BCD_STOPPED;
        }
    }
    if (!entry) {
        cache->counts.computed++;
        entry = begin(cache, key);
        pthread_mutex_unlock(&cache->mutex);
        status = bcd_theory_create(theory, scene, scope, watch, NULL);
        if (entry)
            keep(cache, entry, status == BCD_OK ? copy_of(*theory, scene, scope) : NULL);
        return status;
    }
    cache->counts.shared++;
    entry->holders++;
    entry->last = ++cache->now;
    pthread_mutex_unlock(&cache->mutex);
    status = bcd_theory_create(theory, scene, scope, watch, entry->theory);
    pthread_mutex_lock(&cache->mutex);
    entry->holders--;
    pthread_mutex_unlock(&cache->mutex);
    return status;
}
