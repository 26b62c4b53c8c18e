/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_sweep_cancel.c - sweeps are cancelled; see store_sweeps.h.
 *
 * The sweep is cancelled in a transaction of its own, its jobs by the thousands in others, so that
 * nobody else waits long to write. Where that ends early, the next start goes on with it.
 */
#include "store_segment.h"
#include "store_sweep_keep.h"
#include "store_sweeps_internal.h"

enum { SLICE_JOBS = 8 * SEGMENT_JOBS };

/* Jobs of the sweep :sweep that wait, and that nobody else wants. */
#define UNWANTED                                                                                   \
    " alone = 0 AND seq IN (SELECT job FROM sweep_points WHERE sweep = :sweep)"                    \
    " AND NOT EXISTS (SELECT 1 FROM sweep_points AS p JOIN sweeps AS s ON s.seq = p.sweep"         \
    " WHERE p.job = jobs.seq AND p.sweep <> :sweep AND s.cancelled_ms IS NULL)"

/* ----------------------------------------------------------------------- plain */

/* Those that no other sweep, cancelled or not, and no other owner has anything to do with: nearly
 * all. For each the same is to be booked. */
struct plain {
    int64_t seqs[SLICE_JOBS];
    size_t count;
    int64_t points; /* of the sweep */
    double seconds, bytes;
};

/* The next ones behind job `after`. */
static enum store_status find_plain(sqlite3 *db, const struct sweep_record *sweep, int64_t after,
                                    struct plain *plain)
{
    struct stmt row =
        stmt_init(db, "SELECT j.seq, count(*), j.core_seconds, j.bytes"
                      " FROM sweep_points AS p INDEXED BY sweep_points_of"
                      " CROSS JOIN jobs AS j ON j.seq = p.job"
                      " WHERE p.sweep = :sweep AND p.job > :after AND j.state = 'queued'"
                      " AND j.alone = 0 AND j.forced = 0 AND j.owner = :owner"
                      " AND NOT EXISTS (SELECT 1 FROM sweep_points AS o"
                      "  WHERE o.job = p.job AND o.sweep <> :sweep)"
                      " GROUP BY p.job ORDER BY p.job LIMIT :most");

    *plain = (struct plain){.count = 0};
    stmt_bind_integer(&row, ":sweep", sweep->seq);
    stmt_bind_integer(&row, ":after", after);
    stmt_bind_text(&row, ":owner", sweep->ticket.owner);
    stmt_bind_integer(&row, ":most", SLICE_JOBS);
    while (plain->count < SLICE_JOBS && stmt_step(&row)) {
        plain->seqs[plain->count++] = stmt_integer(&row, 0);
        plain->points += stmt_integer(&row, 1);
        plain->seconds += stmt_number(&row, 2);
        plain->bytes += stmt_number(&row, 3);
    }
    return stmt_fini(&row);
}

/* No trigger is at work: book. */
static enum store_status move_plain(sqlite3 *db, const struct plain *plain, int64_t now_ms)
{
    struct stmt row = stmt_init(db, "UPDATE jobs SET state = 'cancelled', finished_ms = :now,"
                                    " bytes = 0 WHERE seq = :seq AND state = 'queued'");

    stmt_bind_integer(&row, ":now", now_ms);
    for (size_t i = 0; i < plain->count && !row.status; i++) {
        stmt_bind_integer(&row, ":seq", plain->seqs[i]);
        stmt_step(&row);
        stmt_again(&row);
    }
    return stmt_fini(&row);
}

/* What triggers would have done, for all at once. */
static enum store_status book(sqlite3 *db, const struct sweep_record *sweep,
                              const struct plain *plain)
{
    static const char *const sql[] = {
        "UPDATE job_counts SET jobs = jobs + iif(state = 'queued', -:jobs, :jobs)"
        " WHERE state IN ('queued', 'cancelled')",
        "UPDATE owners SET queued = queued - :jobs, bytes = bytes - :bytes,"
        " waiting_seconds = max(0, waiting_seconds - :seconds) WHERE owner = :owner",
        "UPDATE sweep_counts SET points = points + iif(state = 'queued', -:points, :points)"
        " WHERE sweep = :sweep AND state IN ('queued', 'cancelled')",
    };
    enum store_status status = STORE_OK;

    for (size_t i = 0; i < sizeof sql / sizeof sql[0] && status == STORE_OK; i++) {
        struct stmt row = stmt_init(db, sql[i]);

        if (i < 2)
            stmt_bind_integer(&row, ":jobs", (int64_t)plain->count);
        if (i == 1) {
            stmt_bind_integer(&row, ":bytes", (int64_t)plain->bytes);
            stmt_bind_number(&row, ":seconds", plain->seconds);
            stmt_bind_text(&row, ":owner", sweep->ticket.owner);
        }
        if (i == 2) {
            stmt_bind_integer(&row, ":points", plain->points);
            stmt_bind_integer(&row, ":sweep", sweep->seq);
        }
        status = stmt_run(&row, NULL);
    }
    return status;
}

/* Jobs are in order, and so are their segments. */
static enum store_status tell_segments(sqlite3 *db, const struct plain *plain, int64_t now_ms)
{
    enum store_status status = STORE_OK;
    size_t count;

    for (size_t i = 0; i < plain->count && status == STORE_OK; i += count) {
        int64_t segment = plain->seqs[i] >> SEGMENT_BITS;

        for (count = 1; i + count < plain->count; count++)
            if (plain->seqs[i + count] >> SEGMENT_BITS != segment)
                break;
        status = store_segment_cancelled(db, &plain->seqs[i], count, now_ms);
    }
    return status;
}

/* One slice in one transaction. */
static enum store_status cancel_slice(struct store *store, const struct sweep_record *sweep,
                                      int64_t after, struct plain *plain)
{
    int64_t now_ms = store_now_ms();
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = find_plain(db, sweep, after, plain);
    if (status == STORE_OK && plain->count > 0) {
        store_rest(db, true);
        status = move_plain(db, plain, now_ms);
        store_rest(db, false);
    }
    if (status == STORE_OK && plain->count > 0)
        status = book(db, sweep, plain);
    if (status == STORE_OK)
        status = tell_segments(db, plain, now_ms);
    if (plain->count > 0)
        store_watch_unseen(store);
    return store_end(store, status);
}

static enum store_status cancel_plain(struct store *store, const struct sweep_record *sweep)
{
    struct plain *plain = malloc(sizeof *plain);
    enum store_status status = plain ? STORE_OK : STORE_BROKEN;
    int64_t after = 0;
    bool more = true;

    while (more && status == STORE_OK) {
        status = cancel_slice(store, sweep, after, plain);
        more = status == STORE_OK && plain->count == SLICE_JOBS;
        if (more)
            after = plain->seqs[plain->count - 1];
        if (more)
            store_let_others();
    }
    free(plain);
    return status;
}

/* ----------------------------------------------------------------------- others */

static enum store_status running_jobs(sqlite3 *db, int64_t sweep, char (**ids)[JOB_ID_SIZE],
                                      size_t *count)
{
    struct stmt row = stmt_init(db, "SELECT id FROM jobs WHERE state = 'running' AND" UNWANTED);
    char(*list)[JOB_ID_SIZE] = NULL;
    size_t used = 0;

    stmt_bind_integer(&row, ":sweep", sweep);
    while (stmt_step(&row)) {
        list = stmt_room(&row, list, used, sizeof *list);
        if (!row.status)
            stmt_text_to(&row, 0, list[used++], sizeof *list);
    }
    *ids = list;
    *count = used;
    return stmt_fini(&row);
}

/* Those that wait have nothing to be dropped but themselves. */
static enum store_status cancel_queued(sqlite3 *db, int64_t sweep)
{
    struct stmt row = stmt_init(db, "UPDATE jobs SET state = 'cancelled', finished_ms = :now,"
                                    " bytes = 0 WHERE state = 'queued' AND" UNWANTED);

    stmt_bind_integer(&row, ":now", store_now_ms());
    stmt_bind_integer(&row, ":sweep", sweep);
    return stmt_run(&row, NULL);
}

static enum store_status settle(sqlite3 *db, int64_t sweep)
{
    struct stmt row = stmt_init(db, "SELECT min(job), max(job) FROM sweep_points"
                                    " WHERE sweep = :sweep");
    int64_t first = 0, last = -1;

    stmt_bind_integer(&row, ":sweep", sweep);
    if (stmt_step(&row)) {
        first = stmt_integer(&row, 0);
        last = stmt_integer(&row, 1);
    }
    return stmt_fini(&row) ? row.status : store_segment_settle(db, first, last);
}

/* What is left: those that run, by now, and what is shared with others who do not want it. */
static enum store_status cancel_rest(struct store *store, int64_t sweep, char (**ids)[JOB_ID_SIZE],
                                     size_t *count)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = running_jobs(db, sweep, ids, count);
    for (size_t i = 0; i < *count && status == STORE_OK; i++)
        status = store_jobs_move(db, (*ids)[i], JOB_CANCELLED, NULL);
    if (status == STORE_OK)
        status = cancel_queued(db, sweep);
    if (status == STORE_OK)
        status = settle(db, sweep);
    return store_end(store, status);
}

/* ----------------------------------------------------------------------- sweep */

/* STORE_CONFLICT with the record filled in: it was cancelled before. */
static enum store_status mark(struct store *store, const char *id, const struct identity *by,
                              struct sweep_record *found)
{
    struct stmt row;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = store_sweeps_find_alive(db, id, found);
    if (status == STORE_OK) {
        row = stmt_init(db, "UPDATE sweeps SET cancelled_ms = :now WHERE seq = :seq");
        stmt_bind_integer(&row, ":now", store_now_ms());
        stmt_bind_integer(&row, ":seq", found->seq);
        status = stmt_run(&row, NULL);
    }
    if (status == STORE_OK)
        status = store_sweeps_audit(db, by, "sweep.cancel", found, found->points);
    return store_end(store, status);
}

enum store_status store_sweeps_cancel(struct store *store, const char *id,
                                      const struct identity *by, char (**running)[JOB_ID_SIZE],
                                      size_t *count)
{
    struct sweep_record found = {0};
    char(*ids)[JOB_ID_SIZE] = NULL;
    size_t ran = 0;
    enum store_status marked = mark(store, id, by, &found), status = marked;
    bool again =
        marked == STORE_CONFLICT && found.counts[JOB_QUEUED] + found.counts[JOB_RUNNING] > 0;
    bool large = found.points >= KEEP_LARGE;

    if (marked == STORE_OK || again) {
        if (large)
            store_slices_begin(store);
        status = cancel_plain(store, &found);
        if (status == STORE_OK)
            status = cancel_rest(store, found.seq, &ids, &ran);
        if (large)
            store_slices_end(store);
    }
    sweep_record_fini(&found);
    if (status) {
        free(ids);
        return status;
    }
    *running = ids;
    *count = ran;
    return STORE_OK;
}

enum store_status store_sweeps_resume(struct store *store)
{
    struct sweep_record found = {0};
    char(*running)[JOB_ID_SIZE] = NULL;
    size_t ran = 0;
    int64_t after = 0;
    enum store_status status = STORE_OK;

    while (status == STORE_OK) {
        sqlite3 *db = store_read_begin(store);
        struct stmt row = stmt_init(db, "SELECT min(s.seq) FROM sweeps AS s JOIN sweep_counts AS c"
                                        " ON c.sweep = s.seq WHERE s.cancelled_ms IS NOT NULL"
                                        " AND c.state IN ('queued', 'running') AND c.points > 0"
                                        " AND s.seq > :after");

        stmt_bind_integer(&row, ":after", after);
        after = stmt_step(&row) ? stmt_integer(&row, 0) : 0;
        status = stmt_fini(&row);
        if (status == STORE_OK && after > 0)
            status = store_sweeps_find(db, NULL, after, &found);
        store_read_end(store, db);
        if (status || after == 0)
            break;
        status = cancel_plain(store, &found);
        if (status == STORE_OK)
            status = cancel_rest(store, found.seq, &running, &ran);
        free(running);
        running = NULL;
        ran = 0;
        sweep_record_fini(&found);
    }
    return status;
}
