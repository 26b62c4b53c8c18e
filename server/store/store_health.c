/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_health.c - see store_health.h. */
#include "store_health.h"
#include "store_internal.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

static int64_t size_of(const char *path, const char *suffix);

void store_health_note(struct store *store, enum store_status status)
{
    struct store_tally *tally = &store->tally;
    bool failed = status == STORE_FULL || status == STORE_BROKEN;

    atomic_fetch_add(status == STORE_OK ? &tally->commits : &tally->rollbacks, 1);
    if (failed)
        atomic_fetch_add(status == STORE_FULL ? &tally->full : &tally->broken, 1);
    if (failed)
        atomic_store(&tally->failed_ms, store_now_ms());
    if (failed || status == STORE_OK) {
        atomic_store(&tally->writable, !failed);
        atomic_store(&tally->tried_ms, store_now_ms());
    }
}

void store_health(struct store *store, struct store_health *health)
{
    const struct store_tally *tally = &store->tally;
    int64_t failed_ms = atomic_load(&tally->failed_ms);
    struct statvfs disk = {0};

    *health = (struct store_health){
        .commits = atomic_load(&tally->commits),
        .rollbacks = atomic_load(&tally->rollbacks),
        .full = atomic_load(&tally->full),
        .broken = atomic_load(&tally->broken),
        .writable = atomic_load(&tally->writable),
        .failed_ago_ms = failed_ms ? store_now_ms() - failed_ms : INT64_MAX,
        .database_bytes = size_of(store->path, ""),
        .log_bytes = size_of(store->path, "-wal"),
    };
    if (statvfs(store->path, &disk) == 0) {
        health->disk_free_bytes = (int64_t)disk.f_bavail * (int64_t)disk.f_frsize;
        health->disk_bytes = (int64_t)disk.f_blocks * (int64_t)disk.f_frsize;
    }
}

/* Only looked at: opening it would drop SQLite's locks. */
static int64_t size_of(const char *path, const char *suffix)
{
    char name[4096];
    struct stat file;

    snprintf(name, sizeof name, "%s%s", path, suffix);
    return stat(name, &file) == 0 ? file.st_size : 0;
}

enum store_status store_health_try(struct store *store, int64_t recent_ms)
{
    sqlite3 *db;
    enum store_status status;

    if (atomic_load(&store->tally.writable) &&
        store_now_ms() - atomic_load(&store->tally.tried_ms) < recent_ms)
        return STORE_OK;
    if (pthread_mutex_trylock(&store->write_mutex) != 0)
        return STORE_OK; /* somebody is writing: how that ends will be known */
    pthread_mutex_unlock(&store->write_mutex);
    status = STORE_BEGIN(store, &db);
    if (status)
        return status;
    return store_end(store,
                     store_exec(db, "UPDATE job_counts SET jobs = jobs WHERE state = 'queued'"));
}

enum store_status store_health_queued(struct store *store, struct owner_queued *owners, size_t room,
                                      size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT owner, queued, waiting_seconds FROM owners"
                                    " ORDER BY queued DESC, owner LIMIT :room");

    *count = 0;
    stmt_bind_integer(&row, ":room", (int64_t)room);
    while (stmt_step(&row)) {
        struct owner_queued *owner = &owners[(*count)++];
        snprintf(owner->owner, sizeof owner->owner, "%s",
                 (const char *)sqlite3_column_text(row.handle, 0));
        owner->jobs = stmt_integer(&row, 1);
        owner->core_seconds = stmt_number(&row, 2);
    }
    enum store_status status = stmt_fini(&row);
    store_read_end(store, db);
    return status;
}
