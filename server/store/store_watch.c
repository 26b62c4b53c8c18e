/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_watch.c - see store_watch.h. Two temporary triggers, which the writing connection has for
 * itself and no file ever holds, call a function of ours for each row; what it noted is told once
 * the transaction is on disk, and forgotten when it was rolled back.
 *
 * THREADS  `moves`: under write_mutex, as everything of the writing connection.
 */
#include "store_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void note(sqlite3_context *call, int count, sqlite3_value **values);

enum store_status store_watch(struct store *store, store_watcher *watcher, void *context)
{
    static const char triggers[] =
        "PRAGMA temp_store = MEMORY;"
        "CREATE TEMP TRIGGER IF NOT EXISTS watch_insert AFTER INSERT ON main.jobs"
        " BEGIN SELECT note_move(new.seq, new.id, new.owner, new.state); END;"
        "CREATE TEMP TRIGGER IF NOT EXISTS watch_move AFTER UPDATE OF state ON main.jobs"
        " BEGIN SELECT note_move(new.seq, new.id, new.owner, new.state); END";
    enum store_status status = STORE_OK;

    pthread_mutex_lock(&store->write_mutex);
    store->watch.watcher = watcher;
    store->watch.context = context;
    if (watcher) {
        int code = sqlite3_create_function(store->writer, "note_move", 4,
                                           SQLITE_UTF8 | SQLITE_INNOCUOUS, &store->watch, note,
                                           NULL, NULL);
        status = code == SQLITE_OK ? store_exec(store->writer, triggers)
                                   : store_fault(store->writer, code, "note_move");
    }
    pthread_mutex_unlock(&store->write_mutex);
    return status;
}

void store_watch_take(struct store *store, bool committed, struct watch *taken)
{
    struct watch *watch = &store->watch;

    taken->watcher = NULL;
    if (committed && watch->watcher && (watch->count > 0 || watch->more)) {
        taken->watcher = watch->watcher;
        taken->context = watch->context;
        taken->count = watch->count;
        taken->more = watch->more;
        memcpy(taken->moves, watch->moves, watch->count * sizeof watch->moves[0]);
    }
    watch->count = 0;
    watch->more = false;
}

void store_watch_tell(const struct watch *taken)
{
    if (taken->watcher)
        taken->watcher(taken->context, taken->moves, taken->count, taken->more);
}

static void note(sqlite3_context *call, int count, sqlite3_value **values)
{
    struct watch *watch = sqlite3_user_data(call);
    const char *id = (const char *)sqlite3_value_text(values[1]);
    const char *owner = (const char *)sqlite3_value_text(values[2]);
    const char *state = (const char *)sqlite3_value_text(values[3]);
    struct job_move *move;

    (void)count;
    if (!watch->watcher)
        return;
    if (watch->count == STORE_WATCH_MOVES || !id || !owner || !state) {
        watch->more = true;
        return;
    }
    move = &watch->moves[watch->count];
    move->seq = sqlite3_value_int64(values[0]);
    snprintf(move->id, sizeof move->id, "%s", id);
    snprintf(move->owner, sizeof move->owner, "%s", owner);
    if (job_state_parse(state, &move->state))
        watch->count++;
}
