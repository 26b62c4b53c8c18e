/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_watch.c - see store_watch.h. Two temporary triggers, which the writing connection has for
 * itself and no file ever holds, call a function of ours for each row; what it noted is told once
 * the transaction is on disk, and forgotten when it was rolled back.
 *
 * THREADS  `moves`: under write_mutex, as everything of the writing connection.
 */
#include "store_internal.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The sweeps of a job, as text: "3,17". */
#define SWEEPS_OF(job)                                                                             \
    "(SELECT group_concat(sweep) FROM (SELECT DISTINCT sweep FROM main.sweep_points"               \
    " WHERE job = " job " ORDER BY sweep LIMIT 4))"
static_assert(JOB_MOVE_SWEEPS == 4, "the number in SWEEPS_OF");

static void note(sqlite3_context *call, int count, sqlite3_value **values);
static bool fill(struct job_move *move, sqlite3_value *const *values);

enum store_status store_watch(struct store *store, store_watcher *watcher, void *context)
{
    static const char triggers[] =
        "PRAGMA temp_store = MEMORY;"
        "CREATE TEMP TRIGGER IF NOT EXISTS watch_insert AFTER INSERT ON main.jobs"
        " BEGIN SELECT note_move(new.seq, new.id, new.owner, new.state, NULL); END;"
        "CREATE TEMP TRIGGER IF NOT EXISTS watch_move AFTER UPDATE OF state ON main.jobs"
        " BEGIN SELECT note_move(new.seq, new.id, new.owner, new.state, " SWEEPS_OF(
            "new.seq") "); END";
    enum store_status status = STORE_OK;

    pthread_mutex_lock(&store->write_mutex);
    store->watch.watcher = watcher;
    store->watch.context = context;
    if (watcher) {
        int code =
            sqlite3_create_function(store->writer, "note_move", 5, SQLITE_UTF8 | SQLITE_INNOCUOUS,
                                    &store->watch, note, NULL, NULL);
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

void store_watch_unseen(struct store *store)
{
    store->watch.more = true;
}

void store_watch_tell(const struct watch *taken)
{
    if (taken->watcher)
        taken->watcher(taken->context, taken->moves, taken->count, taken->more);
}

static void note(sqlite3_context *call, int count, sqlite3_value **values)
{
    struct watch *watch = sqlite3_user_data(call);

    (void)count;
    if (!watch->watcher)
        return;
    if (watch->count < STORE_WATCH_MOVES && fill(&watch->moves[watch->count], values))
        watch->count++;
    else
        watch->more = true;
}

/* seq, id, owner, state, sweeps; false = out of memory. */
static bool fill(struct job_move *move, sqlite3_value *const *values)
{
    const char *id = (const char *)sqlite3_value_text(values[1]);
    const char *owner = (const char *)sqlite3_value_text(values[2]);
    const char *state = (const char *)sqlite3_value_text(values[3]);
    const char *sweeps = (const char *)sqlite3_value_text(values[4]);

    if (!id || !owner || !state)
        return false;
    *move = (struct job_move){.seq = sqlite3_value_int64(values[0])};
    snprintf(move->id, sizeof move->id, "%s", id);
    snprintf(move->owner, sizeof move->owner, "%s", owner);
    for (int i = 0; i < JOB_MOVE_SWEEPS && sweeps && *sweeps; i++) {
        char *end;
        move->sweeps[i] = strtoll(sweeps, &end, 10);
        sweeps = *end == ',' ? end + 1 : NULL;
    }
    return job_state_parse(state, &move->state);
}

bool job_move_in_sweep(const struct job_move *move, int64_t sweep)
{
    for (int i = 0; i < JOB_MOVE_SWEEPS; i++)
        if (move->sweeps[i] == sweep)
            return true;
    return false;
}

enum store_status store_watch_job(struct store *store, const char *id, struct job_move *move)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(
        db, "SELECT seq, id, owner, state, " SWEEPS_OF("jobs.seq") " FROM jobs WHERE id = :id");
    sqlite3_value *values[5];
    bool found;

    stmt_bind_text(&row, ":id", id);
    found = stmt_step(&row);
    for (int i = 0; found && i < 5; i++)
        values[i] = sqlite3_column_value(row.handle, i);
    found = found && fill(move, values);
    enum store_status status = stmt_fini(&row);
    store_read_end(store, db);
    return status ? status : found ? STORE_OK : STORE_NOT_FOUND;
}

enum store_status store_watch_sweep(struct store *store, const char *id, int64_t *seq)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT seq FROM sweeps WHERE id = :id");
    bool found;

    stmt_bind_text(&row, ":id", id);
    found = stmt_step(&row);
    if (found)
        *seq = stmt_integer(&row, 0);
    enum store_status status = stmt_fini(&row);
    store_read_end(store, db);
    return status ? status : found ? STORE_OK : STORE_NOT_FOUND;
}

enum store_status store_watch_counts(struct store *store, int64_t sweep, int64_t counts[JOB_STATES])
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT state, points FROM sweep_counts WHERE sweep = :sweep");
    enum job_state state;

    memset(counts, 0, JOB_STATES * sizeof counts[0]);
    stmt_bind_integer(&row, ":sweep", sweep);
    while (stmt_step(&row))
        if (job_state_parse((const char *)sqlite3_column_text(row.handle, 0), &state))
            counts[state] = stmt_integer(&row, 1);
    enum store_status status = stmt_fini(&row);
    store_read_end(store, db);
    return status;
}
