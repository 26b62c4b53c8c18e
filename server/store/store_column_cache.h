/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_column_cache.h - columns that lists have read, kept for the next ones: most of a list's
 * time goes into reading them. For store*.c only.
 *
 * A column that was written anew has another version (schema/: job_ends), so that what is kept is
 * never out of date: a reader asks for the version that it sees.
 *
 * THREADS  All may be called from any thread.
 */
#ifndef STORE_COLUMN_CACHE_H
#define STORE_COLUMN_CACHE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { COLUMN_CACHE_BYTES_MAX = 96 << 20 };

/* The blob of a column. Does not change while it is held. */
struct column_kept {
    struct column_kept *next; /* the cache's, as all before size */
    atomic_int holders;
    bool used;
    int64_t id, version;
    size_t size;
    unsigned char bytes[];
};

struct column_cache;
/* NULL = no memory. */
struct column_cache *column_cache_create(void);
/* Nothing may be held any more. Accepts NULL. */
void column_cache_free(struct column_cache *cache);

/* Held until released; NULL = it is not there. */
const struct column_kept *column_cache_find(struct column_cache *cache, int64_t id,
                                            int64_t version);
/* Keeps a copy, instead of another version; what was not asked for lately makes way. Held until
 * released; NULL = no memory. A cache that is NULL keeps nothing, but makes the copy. */
const struct column_kept *column_cache_keep(struct column_cache *cache, int64_t id, int64_t version,
                                            const void *bytes, size_t size);
/* Accepts NULL. */
void column_cache_release(const struct column_kept *kept);

#endif
