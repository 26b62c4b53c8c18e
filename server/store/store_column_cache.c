/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_column_cache.c - see store_column_cache.h. */
#include "store_column_cache.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { CHAINS = 1 << 13 };

/* THREADS  `mutex` guards all of it, and of each column next and used. */
struct column_cache {
    pthread_mutex_t mutex;
    size_t bytes;                      /* of all together */
    size_t hand;                       /* chain whose columns make way next, if they were not used
                                          since it was there last */
    struct column_kept *chain[CHAINS]; /* each is held by the cache */
};

struct column_cache *column_cache_create(void)
{
    struct column_cache *cache = calloc(1, sizeof *cache);

    if (cache)
        pthread_mutex_init(&cache->mutex, NULL);
    return cache;
}

static void release(struct column_kept *kept)
{
    if (kept && atomic_fetch_sub(&kept->holders, 1) == 1)
        free(kept);
}

void column_cache_free(struct column_cache *cache)
{
    if (!cache)
        return;
    for (size_t i = 0; i < CHAINS; i++)
        for (struct column_kept *kept = cache->chain[i], *next; kept; kept = next) {
            next = kept->next;
            release(kept);
        }
    pthread_mutex_destroy(&cache->mutex);
    free(cache);
}

/* Neighbouring segments, and keys, go to different chains. */
static struct column_kept **chain_of(struct column_cache *cache, int64_t id)
{
    uint64_t mixed = (uint64_t)id * 0x9E3779B97F4A7C15u;

    return &cache->chain[mixed >> 51];
}
static_assert(CHAINS == 1 << 13, "the bits that chain_of takes");

const struct column_kept *column_cache_find(struct column_cache *cache, int64_t id, int64_t version)
{
    struct column_kept *found;

    if (!cache)
        return NULL;
    pthread_mutex_lock(&cache->mutex);
    found = *chain_of(cache, id);
    while (found && (found->id != id || found->version != version))
        found = found->next;
    if (found) {
        found->used = true;
        atomic_fetch_add(&found->holders, 1);
    }
    pthread_mutex_unlock(&cache->mutex);
    return found;
}

/* Takes the column out of its chain. */
static void drop(struct column_cache *cache, struct column_kept **place)
{
    struct column_kept *gone = *place;

    *place = gone->next;
    cache->bytes -= sizeof *gone + gone->size;
    release(gone);
}

static void drop_other_versions(struct column_cache *cache, int64_t id)
{
    struct column_kept **place = chain_of(cache, id);

    while (*place)
        if ((*place)->id == id)
            drop(cache, place);
        else
            place = &(*place)->next;
}

static void make_room(struct column_cache *cache)
{
    while (cache->bytes > COLUMN_CACHE_BYTES_MAX) {
        struct column_kept **place = &cache->chain[cache->hand];

        while (*place) {
            if ((*place)->used) {
                (*place)->used = false;
                place = &(*place)->next;
            } else {
                drop(cache, place);
            }
        }
        cache->hand = (cache->hand + 1) % CHAINS;
    }
}

const struct column_kept *column_cache_keep(struct column_cache *cache, int64_t id, int64_t version,
                                            const void *bytes, size_t size)
{
    struct column_kept *kept = malloc(sizeof *kept + size), **place;

    if (!kept)
        return NULL;
    *kept = (struct column_kept){.id = id, .version = version, .size = size, .used = true};
    atomic_init(&kept->holders, cache ? 2 : 1);
    memcpy(kept->bytes, bytes, size);
    if (!cache)
        return kept;
    pthread_mutex_lock(&cache->mutex);
    drop_other_versions(cache, id);
    place = chain_of(cache, id);
    kept->next = *place;
    *place = kept;
    cache->bytes += sizeof *kept + size;
    make_room(cache);
    pthread_mutex_unlock(&cache->mutex);
    return kept;
}

void column_cache_release(const struct column_kept *kept)
{
    release((struct column_kept *)kept);
}
