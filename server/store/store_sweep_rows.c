/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sweep_rows.c - sweeps are looked at; see store_sweeps.h. */
#include "store_sweeps_internal.h"

#include <stdio.h>

void sweep_record_fini(struct sweep_record *record)
{
    ticket_fini(&record->ticket);
    free(record->base);
    free(record->axes);
    free(record->zip);
    record->base = record->axes = record->zip = NULL;
}

void sweep_records_free(struct sweep_record *records, size_t count)
{
    for (size_t i = 0; i < count; i++)
        sweep_record_fini(&records[i]);
    free(records);
}

/* -------------------------------------------------------------------- records */

#define COUNT(state) "(SELECT points FROM sweep_counts WHERE sweep = seq AND state = '" state "')"
#define COLUMNS                                                                                    \
    "seq, id, owner, label, tags, priority, submitted_ms, cancelled_ms, points, base, axes, "      \
    "zip, " COUNT("queued") ", " COUNT("running") ", " COUNT("done") ", " COUNT(                   \
        "failed") ", " COUNT("cancelled")

static void read_record(struct stmt *row, struct sweep_record *record)
{
    *record = (struct sweep_record){
        .seq = stmt_integer(row, 0),
        .ticket = {.label = stmt_text(row, 3),
                   .tags = stmt_text(row, 4),
                   .priority = (int)stmt_integer(row, 5)},
        .submitted_ms = stmt_integer(row, 6),
        .cancelled_ms = stmt_integer(row, 7),
        .points = stmt_integer(row, 8),
        .base = stmt_text(row, 9),
        .axes = stmt_text(row, 10),
        .zip = stmt_text(row, 11),
        .counts = {[JOB_QUEUED] = stmt_integer(row, 12),
                   [JOB_RUNNING] = stmt_integer(row, 13),
                   [JOB_DONE] = stmt_integer(row, 14),
                   [JOB_FAILED] = stmt_integer(row, 15),
                   [JOB_CANCELLED] = stmt_integer(row, 16)},
    };
    stmt_text_to(row, 1, record->id, sizeof record->id);
    stmt_text_to(row, 2, record->ticket.owner, sizeof record->ticket.owner);
    if (!row->status && (!record->id[0] || !record->ticket.owner[0]))
        row->status = store_fault(row->db, SQLITE_CORRUPT, row->sql);
    if (row->status)
        sweep_record_fini(record);
}

enum store_status store_sweeps_find(sqlite3 *db, const char *id, int64_t seq,
                                    struct sweep_record *record)
{
    struct stmt row = stmt_init(db, id ? "SELECT " COLUMNS " FROM sweeps WHERE id = :id"
                                       : "SELECT " COLUMNS " FROM sweeps WHERE seq = :seq");
    struct sweep_record found = {0};
    bool any;

    if (id)
        stmt_bind_text(&row, ":id", id);
    else
        stmt_bind_integer(&row, ":seq", seq);
    any = stmt_step(&row);
    if (any)
        read_record(&row, &found);
    if (stmt_fini(&row))
        return row.status;
    if (!any)
        return STORE_NOT_FOUND;
    *record = found;
    return STORE_OK;
}

enum store_status store_sweeps_find_alive(sqlite3 *db, const char *id, struct sweep_record *record)
{
    enum store_status status = store_sweeps_find(db, id, 0, record);

    return status == STORE_OK && record->cancelled_ms > 0 ? STORE_CONFLICT : status;
}

enum store_status store_sweeps_get(struct store *store, const char *id, struct sweep_record *record)
{
    sqlite3 *db = store_read_begin(store);
    enum store_status status = store_sweeps_find(db, id, 0, record);

    store_read_end(store, db);
    return status;
}

enum store_status store_sweeps_list(struct store *store, const char *owner, int64_t before_seq,
                                    size_t limit, struct sweep_record **records, size_t *count)
{
    struct sweep_record *list = calloc(limit + 1, sizeof *list);
    size_t used = 0;
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT " COLUMNS " FROM sweeps WHERE seq < :before"
                                    " AND (:owner IS NULL OR owner = :owner)"
                                    " ORDER BY seq DESC LIMIT :limit");

    stmt_bind_integer(&row, ":before", before_seq > 0 ? before_seq : INT64_MAX);
    stmt_bind_text(&row, ":owner", owner);
    stmt_bind_integer(&row, ":limit", (int64_t)limit);
    if (!list)
        row.status = store_fault(db, SQLITE_NOMEM, row.sql);
    while (used < limit && stmt_step(&row)) {
        read_record(&row, &list[used]);
        used += !row.status;
    }
    stmt_fini(&row);
    store_read_end(store, db);
    if (row.status) {
        sweep_records_free(list, used);
        return row.status;
    }
    *records = list;
    *count = used;
    return STORE_OK;
}

enum store_status store_sweeps_costs(sqlite3 *db, int64_t job, struct job_new *costs)
{
    struct stmt row = stmt_init(db, "SELECT core_seconds, bytes FROM jobs WHERE seq = :seq");

    stmt_bind_integer(&row, ":seq", job);
    if (stmt_step(&row)) {
        costs->core_seconds = stmt_number(&row, 0);
        costs->bytes = stmt_number(&row, 1);
    }
    return stmt_fini(&row);
}

enum store_status store_sweeps_audit(sqlite3 *db, const struct identity *by, const char *action,
                                     const struct sweep_record *sweep, int64_t points)
{
    char detail[40];

    snprintf(detail, sizeof detail, "%lld points", (long long)points);
    return by ? store_audit_add(db, &(struct audit_new){by, action, sweep->id, detail}) : STORE_OK;
}

/* --------------------------------------------------------------------- points */

void sweep_points_free(struct sweep_point *points, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        free(points[i].place);
        free(points[i].table);
    }
    free(points);
}

static void read_point(struct stmt *row, struct sweep_point *point)
{
    char state[STORE_WORD_SIZE];

    *point = (struct sweep_point){.point = stmt_integer(row, 0), .job_seq = stmt_integer(row, 1)};
    stmt_text_to(row, 2, point->job, sizeof point->job);
    stmt_text_to(row, 3, state, sizeof state);
    point->place = stmt_text(row, 4);
    point->table = stmt_blob(row, 5, &point->table_size);
    if (!row->status && !(point->job[0] && point->place && job_state_parse(state, &point->state)))
        row->status = store_fault(row->db, SQLITE_CORRUPT, row->sql);
    if (row->status) {
        free(point->place);
        free(point->table);
    }
}

enum store_status store_sweeps_points(struct store *store, int64_t sweep, int64_t first,
                                      const char *observable, size_t limit,
                                      struct sweep_point **points, size_t *count)
{
    struct sweep_point *list = calloc(limit + 1, sizeof *list);
    size_t used = 0;
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(
        db, "SELECT p.point, j.seq, j.id, j.state, p.place, r.bytes"
            " FROM sweep_points AS p JOIN jobs AS j ON j.seq = p.job"
            " LEFT JOIN results AS r ON r.job = p.job AND r.observable = :observable"
            " WHERE p.sweep = :sweep AND p.point >= :first ORDER BY p.point LIMIT :limit");

    stmt_bind_integer(&row, ":sweep", sweep);
    stmt_bind_integer(&row, ":first", first);
    stmt_bind_text(&row, ":observable", observable);
    stmt_bind_integer(&row, ":limit", (int64_t)limit);
    if (!list)
        row.status = store_fault(db, SQLITE_NOMEM, row.sql);
    while (used < limit && stmt_step(&row)) {
        read_point(&row, &list[used]);
        used += !row.status;
    }
    stmt_fini(&row);
    store_read_end(store, db);
    if (row.status) {
        sweep_points_free(list, used);
        return row.status;
    }
    *points = list;
    *count = used;
    return STORE_OK;
}
