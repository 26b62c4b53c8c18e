/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sweep_keep.c - see store_sweep_keep.h. */
#include "store_sweep_keep.h"

#include "store_segment.h"

#include <stdlib.h>
#include <string.h>

/* For 10^5 jobs at once triggers, CHECKs and references are most of the work. While they rest, what
 * is bound is made by this program, and what triggers on jobs keep up to date is done in one go:
 * book. Cannot fail but for our own mistake. */
void store_rest(sqlite3 *db, bool rest)
{
    sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, !rest, (int *)NULL);
    sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_FKEY, !rest, (int *)NULL);
    store_exec(db, rest ? "PRAGMA ignore_check_constraints = ON"
                        : "PRAGMA ignore_check_constraints = OFF");
}

static enum store_status last_job(sqlite3 *db, int64_t *seq)
{
    struct stmt row = stmt_init(db, "SELECT coalesce(max(seq), 0) FROM sqlite_sequence"
                                    " WHERE name = 'jobs'");

    if (stmt_step(&row))
        *seq = stmt_integer(&row, 0);
    return stmt_fini(&row);
}

enum { POINT_BYTES = 48 }; /* as schema/008 has it */

/* Where the same job stands, the row that comes later is passed over. */
#define JOB_SQL                                                                                    \
    "INSERT OR ROLLBACK INTO jobs (seq, id, hash, state, submitted_ms, chunks, job, derived, "     \
    "owner,"                                                                                       \
    " priority, label, core_seconds, bytes, forced, alone)"                                        \
    " SELECT seq, id, hash, 'queued', :now, chunks, job_text, derived, :owner, :priority,"         \
    " :label, core_seconds, bytes, 0, 0 FROM incoming(:rows) WHERE true"                           \
    " ON CONFLICT (hash) WHERE state IN ('queued', 'running', 'done') AND superseded = 0"          \
    " DO NOTHING"

enum store_status keeper_init(struct keeper *keeper, sqlite3 *db, int64_t sweep,
                              const struct ticket *ticket)
{
    enum store_status status;

    store_rest(db, true); /* before they become part of the statements */
    *keeper = (struct keeper){
        .db = db,
        .ticket = ticket,
        .sweep = sweep,
        .find = stmt_init(db, "SELECT seq FROM jobs WHERE hash = :hash"
                              " AND state IN ('queued', 'running', 'done') AND superseded = 0"),
        .job = stmt_init(db, JOB_SQL),
        .point = stmt_init(db, "INSERT OR ROLLBACK INTO sweep_points (sweep, point, job, place)"
                               " SELECT :sweep, point, job, place FROM incoming(:rows)"),
        .rows = malloc(sizeof *keeper->rows),
    };
    status = keeper->rows ? last_job(db, &keeper->last) : store_fault(db, SQLITE_NOMEM, JOB_SQL);
    keeper->next = keeper->last + 1;
    stmt_bind_text(&keeper->job, ":owner", ticket->owner);
    stmt_bind_integer(&keeper->job, ":priority", ticket->priority);
    stmt_bind_text(&keeper->job, ":label", ticket->label);
    stmt_bind_integer(&keeper->point, ":sweep", sweep);
    store_incoming_bind(&keeper->job, keeper->rows);
    store_incoming_bind(&keeper->point, keeper->rows);
    return status;
}

enum store_status keeper_fini(struct keeper *keeper, enum store_status status)
{
    enum store_status ends[] = {stmt_fini(&keeper->find), stmt_fini(&keeper->job),
                                stmt_fini(&keeper->point)};

    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++)
        status = status ? status : ends[i];
    free(keeper->rows);
    keeper->rows = NULL;
    store_rest(keeper->db, false);
    return status;
}

/* Which job every row has got, where not all are new. */
static enum store_status find_jobs(struct keeper *keeper)
{
    struct incoming *rows = keeper->rows;

    for (size_t i = 0; i < rows->count && !keeper->find.status; i++) {
        stmt_bind_blob(&keeper->find, ":hash", rows->points[i].job.hash, JOB_HASH_SIZE);
        if (stmt_step(&keeper->find))
            rows->jobs[i] = stmt_integer(&keeper->find, 0);
        stmt_again(&keeper->find);
    }
    return keeper->find.status;
}

/* Jobs for the keeper's rows. Those that are new have consecutive seq, with gaps where one stands:
 * of these there are more than enough. */
static enum store_status keep_jobs(struct keeper *keeper)
{
    struct incoming *rows = keeper->rows;
    int changes = 0;
    enum store_status status = store_make_ids(rows->ids, rows->count, 'j');

    if (status)
        return status;
    rows->first_seq = keeper->next;
    stmt_bind_integer(&keeper->job, ":now", store_now_ms());
    status = stmt_run_again(&keeper->job, &changes);
    if (status)
        return status;
    for (size_t i = 0; i < rows->count; i++)
        rows->jobs[i] = rows->first_seq + (int64_t)i;
    if ((size_t)changes != rows->count)
        status = find_jobs(keeper);
    for (size_t i = 0; i < rows->count; i++) {
        const struct job_new *job = &rows->points[i].job;

        if (rows->jobs[i] != rows->first_seq + (int64_t)i)
            continue;
        keeper->next = rows->jobs[i] + 1;
        keeper->jobs++;
        keeper->bytes += (int64_t)job->bytes;
        keeper->seconds += job->core_seconds;
    }
    return status;
}

static enum store_status keep_rows(struct keeper *keeper, const struct sweep_point_new *points,
                                   size_t count, int64_t first)
{
    struct incoming *rows = keeper->rows;
    enum store_status status;

    rows->points = points;
    rows->count = count;
    rows->first_point = first;
    for (size_t i = 0; i < count; i++)
        keeper->text_bytes += (int64_t)strlen(points[i].place) + POINT_BYTES;
    status = keep_jobs(keeper);
    return status ? status : stmt_run_again(&keeper->point, NULL);
}

enum store_status keep_points(struct keeper *keeper, const struct sweep_source *source,
                              int64_t first)
{
    enum store_status status = STORE_OK;
    size_t count = 1;

    while (count > 0 && status == STORE_OK) {
        const struct sweep_point_new *points = NULL;

        status = source->take(source->state, &points, &count);
        for (size_t i = 0; i < count && status == STORE_OK; i += INCOMING_MAX) {
            size_t some = count - i < INCOMING_MAX ? count - i : INCOMING_MAX;

            status = keep_rows(keeper, points + i, some, first + (int64_t)i);
        }
        first += (int64_t)count;
    }
    return status;
}

enum store_status keep_job(struct keeper *keeper, const struct job_new *job, int64_t *seq)
{
    const struct sweep_point_new one = {.job = *job};
    enum store_status status;

    keeper->rows->points = &one;
    keeper->rows->count = 1;
    status = keep_jobs(keeper);
    *seq = keeper->rows->jobs[0];
    return status;
}

/* ----------------------------------------------------------------------- end */

/* Counters of states, of the owner and of the sweep; first whether the owner may have so much. */
static enum store_status book(const struct keeper *keeper, struct quota_need *wanted)
{
    static const char *const sql[] = {
        "UPDATE job_counts SET jobs = jobs + :jobs WHERE state = 'queued'",
        "INSERT OR IGNORE INTO owners (owner) VALUES (:owner)",
        "UPDATE owners SET queued = queued + :jobs, waiting_seconds = waiting_seconds + :seconds,"
        " bytes = bytes + :bytes WHERE owner = :owner",
        "UPDATE sweeps SET bytes = bytes + :text_bytes WHERE seq = :sweep", /* and so the owner's */
        "UPDATE sweep_counts SET points = 0 WHERE sweep = :sweep",
        "UPDATE sweep_counts SET points = found.points FROM"
        " (SELECT j.state AS state, count(*) AS points FROM sweep_points AS p"
        "  JOIN jobs AS j ON j.seq = p.job WHERE p.sweep = :sweep GROUP BY j.state) AS found"
        " WHERE sweep = :sweep AND sweep_counts.state = found.state",
    };
    const struct quota_need need = {
        {(double)keeper->jobs, keeper->seconds, (double)(keeper->bytes + keeper->text_bytes)}};
    enum store_status status = store_owners_check(keeper->db, keeper->ticket->owner, &need);

    if (status == STORE_QUOTA && wanted)
        *wanted = need;
    for (size_t i = 0; i < sizeof sql / sizeof sql[0] && status == STORE_OK; i++) {
        struct stmt row = stmt_init(keeper->db, sql[i]);

        if (strstr(sql[i], ":jobs"))
            stmt_bind_integer(&row, ":jobs", keeper->jobs);
        if (strstr(sql[i], ":owner"))
            stmt_bind_text(&row, ":owner", keeper->ticket->owner);
        if (strstr(sql[i], ":seconds"))
            stmt_bind_number(&row, ":seconds", keeper->seconds);
        if (strstr(sql[i], ":bytes"))
            stmt_bind_integer(&row, ":bytes", keeper->bytes);
        if (strstr(sql[i], ":text_bytes"))
            stmt_bind_integer(&row, ":text_bytes", keeper->text_bytes);
        if (strstr(sql[i], ":sweep"))
            stmt_bind_integer(&row, ":sweep", keeper->sweep);
        status = stmt_run(&row, NULL);
    }
    return status;
}

/* The sweep's tags for those of its jobs that are younger than `last`. */
static enum store_status tag_jobs(const struct keeper *keeper)
{
    const char *tags = keeper->ticket->tags;
    enum store_status status = STORE_OK;

    while (tags && status == STORE_OK) {
        struct stmt row =
            stmt_init(keeper->db, "INSERT OR IGNORE INTO job_tags (job, tag)"
                                  " SELECT job, substr(:tags, 1, :length) FROM sweep_points"
                                  " WHERE sweep = :sweep AND job > :last");
        size_t length = strcspn(tags, " ");

        stmt_bind_text(&row, ":tags", tags);
        stmt_bind_integer(&row, ":length", (int64_t)length);
        stmt_bind_integer(&row, ":sweep", keeper->sweep);
        stmt_bind_integer(&row, ":last", keeper->last);
        status = stmt_run(&row, NULL);
        tags = tags[length] ? tags + length + 1 : NULL;
    }
    return status;
}

enum store_status keeper_end(const struct keeper *keeper, struct quota_need *need)
{
    enum store_status status = book(keeper, need);

    if (status == STORE_OK)
        status = tag_jobs(keeper);
    if (keeper->jobs >= KEEP_LARGE)
        return status;
    for (int64_t seq = keeper->last + 1; seq < keeper->next && status == STORE_OK; seq++)
        status = store_segment_inserted(keeper->db, seq);
    return status;
}
