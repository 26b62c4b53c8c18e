/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_attempts.c - see store_attempts.h. */
#include "store_attempts.h"

#include "limits.h"
#include "log.h"
#include "store_internal.h"

#include <stdio.h>
#include <stdlib.h>

/* ------------------------------------------------------------------ recovery */

static enum store_status run(sqlite3 *db, const char *sql, const struct attempt_crash *crash)
{
    struct stmt row = stmt_init(db, sql);

    if (crash)
        stmt_bind_text(&row, ":id", crash->job);
    stmt_bind_integer(&row, ":now", store_now_ms());
    return stmt_run(&row, NULL);
}

/* A job may crash before it runs, as its first worker makes its scene: that was an attempt, too. */
static enum store_status note_crash(sqlite3 *db, const struct attempt_crash *crash)
{
    enum store_status status =
        run(db,
            "INSERT INTO attempts (job, number, started_ms)"
            " SELECT seq, (SELECT coalesce(max(number), 0) + 1 FROM attempts AS a WHERE a.job = "
            "seq), :now"
            " FROM jobs WHERE id = :id AND state IN ('queued', 'running')"
            " AND NOT EXISTS (SELECT 1 FROM attempts AS a WHERE a.job = seq AND ended IS NULL)",
            crash);
    struct stmt row;

    if (status)
        return status;
    log_write(LOG_LEVEL_ERROR, "job_crashed_server",
              LOG_FIELDS(log_text("job", crash->job), log_text("reason", crash->reason)));
    row = stmt_init(db, "UPDATE attempts SET ended = 'crashed', ended_ms = :now, reason = :reason"
                        " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND ended IS NULL");
    stmt_bind_text(&row, ":id", crash->job);
    stmt_bind_text(&row, ":reason", crash->reason);
    stmt_bind_integer(&row, ":now", store_now_ms());
    return stmt_run(&row, NULL);
}

/* The jobs of these crashes that have crashed too often now. */
static enum store_status fail_poison(sqlite3 *db, const struct attempt_crash *crash)
{
    char error[ATTEMPT_REASON_SIZE + 80];
    struct stmt row =
        stmt_init(db, "SELECT count(*) FROM attempts JOIN jobs ON seq = attempts.job"
                      " WHERE id = :id AND state IN ('queued', 'running') AND ended = 'crashed'");
    int64_t crashes = 0;
    enum store_status status;

    stmt_bind_text(&row, ":id", crash->job);
    if (stmt_step(&row))
        crashes = stmt_integer(&row, 0);
    status = stmt_fini(&row);
    if (status || crashes < LIMIT_CRASHES_MAX)
        return status;
    snprintf(error, sizeof error, "it crashed the server %lld times, the last time by %s",
             (long long)crashes, crash->reason);
    status = store_jobs_move(db, crash->job, JOB_FAILED, error);
    if (status == STORE_OK)
        log_write(LOG_LEVEL_ERROR, "job_failed",
                  LOG_FIELDS(log_text("job", crash->job), log_text("reason", error)));
    return status;
}

static const char starved_text[] = "the system was out of memory";

static enum store_status lose(sqlite3 *db, bool starved)
{
    struct stmt row = stmt_init(db, "UPDATE attempts SET ended = 'lost', ended_ms = :now,"
                                    " reason = :reason WHERE ended IS NULL");

    stmt_bind_integer(&row, ":now", store_now_ms());
    stmt_bind_text(&row, ":reason", starved ? starved_text : NULL);
    return stmt_run(&row, NULL);
}

/* One job that memory never sufficed for; STORE_NOT_FOUND = there is none (any more). */
static enum store_status fail_starved(sqlite3 *db)
{
    char id[JOB_ID_SIZE], error[160];
    struct stmt row =
        stmt_init(db, "SELECT id FROM jobs WHERE state = 'running' AND :most ="
                      " (SELECT total(ended = 'lost' AND saves = 0 AND reason = :reason) FROM"
                      "  (SELECT ended, saves, reason FROM attempts WHERE attempts.job = jobs.seq"
                      "   ORDER BY number DESC LIMIT :most)) LIMIT 1");
    enum store_status status;
    bool any;

    stmt_bind_integer(&row, ":most", LIMIT_STARVED_MAX);
    stmt_bind_text(&row, ":reason", starved_text);
    any = stmt_step(&row);
    if (any)
        stmt_text_to(&row, 0, id, sizeof id);
    status = stmt_fini(&row);
    if (status || !any)
        return status ? status : STORE_NOT_FOUND;
    snprintf(error, sizeof error,
             "%d times in a row %s and the server was killed before the job had saved anything",
             LIMIT_STARVED_MAX, starved_text);
    status = store_jobs_move(db, id, JOB_FAILED, error);
    if (status == STORE_OK)
        log_write(LOG_LEVEL_ERROR, "job_failed",
                  LOG_FIELDS(log_text("job", id), log_text("reason", error)));
    return status;
}

static enum store_status recover(sqlite3 *db, const struct attempts_end *end)
{
    enum store_status status = STORE_OK;

    for (size_t i = 0; status == STORE_OK && i < end->count; i++)
        status = note_crash(db, &end->crashes[i]);
    if (status == STORE_OK)
        status = lose(db, end->starved);
    for (size_t i = 0; status == STORE_OK && i < end->count; i++)
        status = fail_poison(db, &end->crashes[i]);
    while (status == STORE_OK && end->starved)
        status = fail_starved(db);
    if (status && status != STORE_NOT_FOUND)
        return status;
    return run(
        db,
        "INSERT INTO attempts (job, number, started_ms)"
        " SELECT seq, (SELECT coalesce(max(number), 0) + 1 FROM attempts AS a WHERE a.job = seq),"
        " :now FROM jobs WHERE state = 'running'",
        NULL);
}

enum store_status store_attempts_recover(struct store *store, const struct attempts_end *end)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, recover(db, end));
}

enum store_status store_attempts_stop(struct store *store)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    return store_end(
        store, run(db, "UPDATE attempts SET ended = 'stopped', ended_ms = :now WHERE ended IS NULL",
                   NULL));
}

/* ----------------------------------------------------------------------- use */

enum store_status store_attempts_add_use(sqlite3 *db, const char *id, double seconds)
{
    struct stmt row =
        stmt_init(db, "UPDATE attempts SET core_seconds = core_seconds + :seconds"
                      " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND number ="
                      " (SELECT max(number) FROM attempts AS a WHERE a.job = attempts.job)");

    stmt_bind_text(&row, ":id", id);
    stmt_bind_number(&row, ":seconds", seconds);
    return stmt_run(&row, NULL);
}

enum store_status store_attempts_use(struct store *store, const struct attempt_use *uses,
                                     size_t count)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    for (size_t i = 0; status == STORE_OK && i < count; i++)
        status = store_attempts_add_use(db, uses[i].job, uses[i].seconds);
    return store_end(store, status);
}

enum store_status store_attempts_used(struct store *store, const char *id, double *seconds)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT total(core_seconds) FROM attempts"
                                    " WHERE job = (SELECT seq FROM jobs WHERE id = :id)");
    double found = 0;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    if (stmt_step(&row))
        found = stmt_number(&row, 0);
    status = stmt_fini(&row);
    store_read_end(store, db);
    if (status == STORE_OK)
        *seconds = found;
    return status;
}

/* ------------------------------------------------------------------- looking */

enum store_status store_attempts_barren(struct store *store, const char *id,
                                        struct attempts_barren *barren)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row =
        stmt_init(db, "SELECT ended, saves FROM attempts"
                      " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND ended IS NOT NULL"
                      " ORDER BY number DESC");
    struct attempts_barren found = {0};
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    while (stmt_step(&row)) {
        char ended[STORE_WORD_SIZE];

        stmt_text_to(&row, 0, ended, sizeof ended);
        if (stmt_integer(&row, 1) > 0 || (ended[0] != 'l' && ended[1] != 'r')) /* lost, crashed */
            break;
        found.lost += ended[0] == 'l';
        found.crashed += ended[0] == 'c';
    }
    status = stmt_fini(&row);
    store_read_end(store, db);
    if (status == STORE_OK)
        *barren = found;
    return status;
}

void attempts_free(struct attempt *attempts, size_t count)
{
    for (size_t i = 0; i < count; i++)
        free(attempts[i].reason);
    free(attempts);
}

static enum store_status list(sqlite3 *db, int64_t seq, size_t limit, struct attempt **attempts,
                              size_t *count)
{
    struct stmt row = stmt_init(db, "SELECT number, started_ms, ended_ms, saves, ended, reason,"
                                    " core_seconds"
                                    " FROM attempts WHERE job = :job"
                                    " ORDER BY number DESC LIMIT :limit");
    struct attempt *array = NULL;
    size_t used = 0;
    enum store_status status;

    stmt_bind_integer(&row, ":job", seq);
    stmt_bind_integer(&row, ":limit", (int64_t)limit);
    while (stmt_step(&row)) {
        array = stmt_room(&row, array, used, sizeof *array);
        if (row.status)
            break;
        array[used] = (struct attempt){
            .number = stmt_integer(&row, 0),
            .started_ms = stmt_integer(&row, 1),
            .ended_ms = stmt_integer(&row, 2),
            .saves = stmt_integer(&row, 3),
            .reason = stmt_text(&row, 5),
            .core_seconds = stmt_number(&row, 6),
        };
        stmt_text_to(&row, 4, array[used].ended, sizeof array[used].ended);
        used++;
    }
    status = stmt_fini(&row);
    if (status) {
        attempts_free(array, used);
        return status;
    }
    *attempts = array;
    *count = used;
    return STORE_OK;
}

enum store_status store_attempts_list(struct store *store, const char *id, size_t limit,
                                      struct attempt **attempts, size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    int64_t seq = 0;
    enum store_status status = store_jobs_seq(db, id, &seq);

    if (status == STORE_OK)
        status = list(db, seq, limit, attempts, count);
    store_read_end(store, db);
    return status;
}
