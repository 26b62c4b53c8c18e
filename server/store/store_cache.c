/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_cache.c - statements kept for the next time: to prepare one takes several times as long as
 * to look a job up with it.
 *
 * THREADS  A connection's cache belongs to whoever has the connection.
 */
#include "store_internal.h"

#include <stdlib.h>
#include <string.h>

enum { SLOTS = 32 };

/* Statements that nobody uses, reset; the one used longest ago goes first. */
struct cache {
    sqlite3_stmt *idle[SLOTS];
    uint64_t used[SLOTS], clock;
};

static struct cache *cache_of(sqlite3 *db);
static void set_cache(sqlite3 *db, struct cache *cache);

void store_cache_add(sqlite3 *db)
{
    set_cache(db, calloc(1, sizeof(struct cache))); /* without memory, without it */
}

void store_cache_drop(sqlite3 *db)
{
    struct cache *cache = db ? cache_of(db) : NULL;

    if (!cache)
        return;
    set_cache(db, NULL);
    for (int i = 0; i < SLOTS; i++)
        sqlite3_finalize(cache->idle[i]);
    free(cache);
}

sqlite3_stmt *store_cache_take(sqlite3 *db, const char *sql)
{
    struct cache *cache = cache_of(db);

    for (int i = 0; cache && i < SLOTS; i++) {
        sqlite3_stmt *found = cache->idle[i];

        if (found && strcmp(sqlite3_sql(found), sql) == 0) {
            cache->idle[i] = NULL;
            return found;
        }
    }
    return NULL;
}

void store_cache_give(sqlite3 *db, sqlite3_stmt *statement)
{
    struct cache *cache = cache_of(db);
    int place = 0;

    /* After an error (which is known already) it is not to be trusted. */
    if (!cache || sqlite3_reset(statement) != SQLITE_OK) {
        sqlite3_finalize(statement);
        return;
    }
    sqlite3_clear_bindings(statement);
    for (int i = 0; i < SLOTS && cache->idle[place]; i++)
        if (!cache->idle[i] || cache->used[i] < cache->used[place])
            place = i;
    sqlite3_finalize(cache->idle[place]);
    cache->idle[place] = statement;
    cache->used[place] = ++cache->clock;
}

static void nothing(void *cache)
{
    (void)cache;
}

/* A connection has no place for data of ours (before SQLite 3.44) but the argument of a hook. */
static struct cache *cache_of(sqlite3 *db)
{
    struct cache *cache = sqlite3_rollback_hook(db, nothing, NULL);

    sqlite3_rollback_hook(db, nothing, cache);
    return cache;
}

static void set_cache(sqlite3 *db, struct cache *cache)
{
    sqlite3_rollback_hook(db, nothing, cache);
}
