/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_jobs.c - rows of the table jobs; see store_jobs.h and schema/. */
#include "store_internal.h"
#include "store_segment.h"

#include "log.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const char *const state_names[JOB_STATES] = {
    [JOB_QUEUED] = "queued", [JOB_RUNNING] = "running",     [JOB_DONE] = "done",
    [JOB_FAILED] = "failed", [JOB_CANCELLED] = "cancelled",
};

const char *job_state_name(enum job_state state)
{
    return state_names[state];
}

bool job_state_parse(const char *name, enum job_state *state)
{
    for (int i = 0; i < JOB_STATES; i++) {
        if (strcmp(name, state_names[i]) == 0) {
            *state = (enum job_state)i;
            return true;
        }
    }
    return false;
}

void job_record_fini(struct job_record *record)
{
    free(record->job);
    free(record->derived);
    free(record->error);
    ticket_fini(&record->ticket);
    free(record->outcome);
    record->job = record->derived = record->error = record->outcome = NULL;
}

void job_records_free(struct job_record *records, size_t count)
{
    for (size_t i = 0; i < count; i++)
        job_record_fini(&records[i]);
    free(records);
}

/* ------------------------------------------------------------------- reading */

static void read_record(struct stmt *row, struct job_record *record)
{
    char state[STORE_WORD_SIZE];
    size_t hash_size = 0;
    void *hash = stmt_blob(row, 2, &hash_size);

    *record = (struct job_record){
        .seq = stmt_integer(row, 0),
        .submitted_ms = stmt_integer(row, 4),
        .started_ms = stmt_integer(row, 5),
        .finished_ms = stmt_integer(row, 6),
        .chunks = stmt_integer(row, 7),
        .chunks_done = stmt_integer(row, 8),
        .attempts_lost = stmt_integer(row, 17),
        .attempts_failed = stmt_integer(row, 18),
        .job = stmt_text(row, 9),
        .derived = stmt_text(row, 10),
        .error = stmt_text(row, 11),
        .outcome = stmt_text(row, 16),
        .ticket = {.priority = (int)stmt_integer(row, 13),
                   .label = stmt_text(row, 14),
                   .tags = stmt_text(row, 15)},
    };
    stmt_text_to(row, 1, record->id, sizeof record->id);
    stmt_text_to(row, 3, state, sizeof state);
    stmt_text_to(row, 12, record->ticket.owner, sizeof record->ticket.owner);
    if (!row->status && record->id[0] && record->ticket.owner[0] && hash_size == JOB_HASH_SIZE &&
        job_state_parse(state, &record->state))
        memcpy(record->hash, hash, JOB_HASH_SIZE);
    else if (!row->status)
        row->status = store_fault(row->db, SQLITE_CORRUPT, row->sql);
    free(hash);
    if (row->status)
        job_record_fini(record);
}

enum store_status store_jobs_read_one(struct stmt *row, struct job_record *record)
{
    struct job_record found = {0};
    bool any = stmt_step(row);
    enum store_status status;

    if (any)
        read_record(row, &found);
    status = stmt_fini(row);
    if (status)
        return status;
    if (!any)
        return STORE_NOT_FOUND;
    *record = found;
    return STORE_OK;
}

/* All rows. Ends the statement. */
static enum store_status read_all(struct stmt *row, struct job_record **records, size_t *count)
{
    struct job_record *array = NULL;
    size_t used = 0;
    enum store_status status;

    while (stmt_step(row)) {
        array = stmt_room(row, array, used, sizeof *array);
        if (!row->status)
            read_record(row, &array[used]);
        used += !row->status;
    }
    status = stmt_fini(row);
    if (status) {
        job_records_free(array, used);
        return status;
    }
    *records = array;
    *count = used;
    return STORE_OK;
}

enum store_status store_jobs_find(sqlite3 *db, const char *id, struct job_record *record)
{
    struct stmt row = stmt_init(db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs WHERE id = :id");

    stmt_bind_text(&row, ":id", id);
    return store_jobs_read_one(&row, record);
}

/* --------------------------------------------------------------------- lists */

enum store_status store_jobs_get(struct store *store, const char *id, struct job_record *record)
{
    sqlite3 *db = store_read_begin(store);
    enum store_status status = store_jobs_find(db, id, record);

    store_read_end(store, db);
    return status;
}

enum store_status store_jobs_read(sqlite3 *db, const int64_t *seqs, size_t count,
                                  struct job_record *records)
{
    struct stmt row = stmt_init(db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs WHERE seq = :seq");
    size_t used = 0;
    enum store_status status;

    for (; used < count && !row.status; used += !row.status) {
        stmt_bind_integer(&row, ":seq", seqs[used]);
        if (stmt_step(&row))
            read_record(&row, &records[used]);
        else if (!row.status)
            row.status = STORE_NOT_FOUND;
        stmt_again(&row);
    }
    status = stmt_fini(&row);
    for (size_t i = 0; status && i < used; i++)
        job_record_fini(&records[i]);
    return status;
}

enum store_status store_jobs_counts(struct store *store, int64_t counts[JOB_STATES])
{
    int64_t found[JOB_STATES] = {0};
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT state, jobs FROM job_counts");
    enum store_status status;

    while (stmt_step(&row)) {
        char name[STORE_WORD_SIZE];
        enum job_state state;

        stmt_text_to(&row, 0, name, sizeof name);
        if (job_state_parse(name, &state))
            found[state] = stmt_integer(&row, 1);
    }
    status = stmt_fini(&row);
    store_read_end(store, db);
    if (status == STORE_OK)
        memcpy(counts, found, sizeof found);
    return status;
}

enum store_status store_jobs_running(struct store *store, struct job_record **records,
                                     size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt list = stmt_init(db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs"
                                     " WHERE state = 'running' ORDER BY seq");
    enum store_status status = read_all(&list, records, count);

    store_read_end(store, db);
    return status;
}

enum store_status store_jobs_waiting(struct store *store, const char *owner,
                                     struct job_waiting *waiting, size_t room, size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt list = stmt_init(db, "SELECT seq, priority, id FROM jobs"
                                     " WHERE owner = :owner AND state = 'queued'"
                                     " ORDER BY priority DESC, seq LIMIT :room");
    size_t used = 0;
    enum store_status status;

    stmt_bind_text(&list, ":owner", owner);
    stmt_bind_integer(&list, ":room", (int64_t)room);
    while (used < room && stmt_step(&list)) {
        waiting[used].seq = stmt_integer(&list, 0);
        waiting[used].priority = (int)stmt_integer(&list, 1);
        stmt_text_to(&list, 2, waiting[used].id, sizeof waiting[used].id);
        used++;
    }
    status = stmt_fini(&list);
    store_read_end(store, db);
    *count = status ? 0 : used;
    return status;
}

/* --------------------------------------------------------------- transitions */

/* How a job gets into each state; the UPDATE names where it must come from. Nothing leads to
 * 'queued'. */
static const char *const transitions[JOB_STATES] = {
    [JOB_RUNNING] = "UPDATE jobs SET state = 'running', started_ms = :now"
                    " WHERE id = :id AND state = 'queued'",
    [JOB_DONE] = "UPDATE jobs SET state = 'done', finished_ms = :now"
                 " WHERE id = :id AND state = 'running'",
    [JOB_FAILED] = "UPDATE jobs SET state = 'failed', finished_ms = :now, error = :error,"
                   " bytes = 0"
                   " WHERE id = :id AND state IN ('queued', 'running')",
    [JOB_CANCELLED] = "UPDATE jobs SET state = 'cancelled', finished_ms = :now, bytes = 0"
                      " WHERE id = :id AND state IN ('queued', 'running')",
};

enum store_status store_jobs_why(sqlite3 *db, const char *id)
{
    struct stmt row = stmt_init(db, "SELECT 1 FROM jobs WHERE id = :id");
    bool any;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    any = stmt_step(&row);
    status = stmt_fini(&row);
    return status ? status : any ? STORE_CONFLICT : STORE_NOT_FOUND;
}

static enum store_status drop_work(sqlite3 *db, const char *sql, const char *id)
{
    struct stmt row = stmt_init(db, sql);

    stmt_bind_text(&row, ":id", id);
    return stmt_run(&row, NULL);
}

enum store_status store_jobs_seq(sqlite3 *db, const char *id, int64_t *seq)
{
    struct stmt row = stmt_init(db, "SELECT seq FROM jobs WHERE id = :id");
    bool any;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    any = stmt_step(&row);
    if (any)
        *seq = stmt_integer(&row, 0);
    status = stmt_fini(&row);
    return status || any ? status : STORE_NOT_FOUND;
}

enum store_status store_jobs_move(sqlite3 *db, const char *id, enum job_state to, const char *error)
{
    int64_t seq = 0;
    struct stmt row = stmt_init(db, transitions[to]);
    int changes = 0;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    stmt_bind_integer(&row, ":now", store_now_ms());
    if (to == JOB_FAILED)
        stmt_bind_text(&row, ":error", error);
    status = stmt_run(&row, &changes);
    if (status == STORE_OK && changes == 0)
        return store_jobs_why(db, id);
    if (status == STORE_OK && to != JOB_RUNNING)
        status = drop_work(
            db, "DELETE FROM chunks WHERE job = (SELECT seq FROM jobs WHERE id = :id)", id);
    if (status == STORE_OK && to != JOB_RUNNING)
        status = drop_work(
            db, "DELETE FROM checkpoints WHERE job = (SELECT seq FROM jobs WHERE id = :id)", id);
    if (status == STORE_OK && to != JOB_RUNNING)
        status = store_jobs_seq(db, id, &seq);
    if (status == STORE_OK && to != JOB_RUNNING)
        status = store_segment_settle(db, seq, seq);
    assert(status || changes == 1);
    return status;
}

static enum store_status move(struct store *store, const char *id, enum job_state to,
                              const char *error)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN_SHARED(store, &db);

    return status ? status : store_end(store, store_jobs_move(db, id, to, error));
}

enum store_status store_jobs_start(struct store *store, const char *id)
{
    return move(store, id, JOB_RUNNING, NULL);
}

enum store_status store_jobs_fail(struct store *store, const char *id, const char *error)
{
    return move(store, id, JOB_FAILED, error ? error : "unknown error");
}

enum store_status store_jobs_cancel(struct store *store, const char *id)
{
    return move(store, id, JOB_CANCELLED, NULL);
}

enum store_status store_jobs_cancel_by(struct store *store, const char *id,
                                       const struct identity *by)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = store_jobs_move(db, id, JOB_CANCELLED, NULL);
    if (status == STORE_OK)
        status = store_audit_add(db, &(struct audit_new){by, "job.cancel", id, ""});
    return store_end(store, status);
}
