/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sweeps.c - sweeps are kept, extended, tried again, cancelled; see store_sweeps.h. */
#include "store_sweep_keep.h"
#include "store_sweeps_internal.h"

#include <string.h>

/* Points that are not wanted are looked at all the same: for faults, and for the hash. */
static enum store_status pass_over(const struct sweep_source *source)
{
    const struct sweep_point_new *points;
    enum store_status status = STORE_OK;

    for (size_t count = 1; count > 0 && status == STORE_OK;)
        status = source->take(source->state, &points, &count);
    return status;
}

/* ------------------------------------------------------------------ insertion */

/* Did the owner use the key before, for whatever? */
static enum store_status know_key(sqlite3 *db, const struct sweep_new *sweep, bool *known)
{
    struct stmt row;

    *known = false;
    if (!sweep->idempotency_key)
        return STORE_OK;
    row = stmt_init(db, "SELECT 1 FROM idempotency_keys WHERE owner = :owner AND key = :key"
                        " UNION ALL"
                        " SELECT 1 FROM sweep_keys WHERE owner = :owner AND key = :key");
    stmt_bind_text(&row, ":owner", sweep->ticket->owner);
    stmt_bind_text(&row, ":key", sweep->idempotency_key);
    *known = stmt_step(&row);
    return stmt_fini(&row);
}

/* STORE_OK: the sweep that the key was used for; STORE_CONFLICT: something else. */
static enum store_status find_key(sqlite3 *db, const struct sweep_new *sweep,
                                  struct sweep_record *record)
{
    struct stmt row;
    enum store_status status = STORE_CONFLICT;
    int64_t seq = 0;

    row = stmt_init(db, "SELECT sweep, hash = :hash FROM sweep_keys"
                        " WHERE owner = :owner AND key = :key");
    stmt_bind_text(&row, ":owner", sweep->ticket->owner);
    stmt_bind_text(&row, ":key", sweep->idempotency_key);
    stmt_bind_blob(&row, ":hash", sweep->source->hash, JOB_HASH_SIZE);
    if (stmt_step(&row)) {
        seq = stmt_integer(&row, 0);
        status = stmt_integer(&row, 1) ? STORE_OK : STORE_CONFLICT;
    }
    if (stmt_fini(&row))
        return row.status;
    return status ? status : store_sweeps_find(db, NULL, seq, record);
}

static enum store_status find_live(sqlite3 *db, const struct sweep_new *sweep,
                                   struct sweep_record *record)
{
    struct stmt row =
        stmt_init(db, "SELECT seq FROM sweeps WHERE hash = :hash AND cancelled_ms IS NULL");
    int64_t seq;

    stmt_bind_blob(&row, ":hash", sweep->source->hash, JOB_HASH_SIZE);
    seq = stmt_step(&row) ? stmt_integer(&row, 0) : 0;
    if (stmt_fini(&row))
        return row.status;
    return seq == 0 ? STORE_NOT_FOUND : store_sweeps_find(db, NULL, seq, record);
}

static enum store_status insert_key(sqlite3 *db, const struct sweep_new *sweep, int64_t seq)
{
    struct stmt row = stmt_init(db, "INSERT INTO sweep_keys (owner, key, sweep, hash)"
                                    " VALUES (:owner, :key, :sweep, :hash)");

    stmt_bind_text(&row, ":owner", sweep->ticket->owner);
    stmt_bind_text(&row, ":key", sweep->idempotency_key);
    stmt_bind_integer(&row, ":sweep", seq);
    stmt_bind_blob(&row, ":hash", sweep->source->hash, JOB_HASH_SIZE);
    return stmt_run(&row, NULL);
}

/* Its hash is known when the last point is: set_hash. */
static enum store_status insert_row(sqlite3 *db, const struct sweep_new *sweep, const char *id)
{
    static const unsigned char unknown[JOB_HASH_SIZE];
    struct stmt row = stmt_init(db, "INSERT INTO sweeps (id, hash, owner, label, tags, priority,"
                                    " submitted_ms, base, axes, zip, points) VALUES (:id, :hash,"
                                    " :owner, :label, :tags, :priority, :now, :base, :axes, :zip,"
                                    " :points)");

    stmt_bind_text(&row, ":id", id);
    stmt_bind_blob(&row, ":hash", unknown, sizeof unknown);
    stmt_bind_text(&row, ":owner", sweep->ticket->owner);
    stmt_bind_text(&row, ":label", sweep->ticket->label);
    stmt_bind_text(&row, ":tags", sweep->ticket->tags);
    stmt_bind_integer(&row, ":priority", sweep->ticket->priority);
    stmt_bind_integer(&row, ":now", store_now_ms());
    stmt_bind_text(&row, ":base", sweep->base);
    stmt_bind_text(&row, ":axes", sweep->axes);
    stmt_bind_text(&row, ":zip", sweep->zip);
    stmt_bind_integer(&row, ":points", (int64_t)sweep->source->count);
    return stmt_run(&row, NULL);
}

static enum store_status set_hash(sqlite3 *db, const struct sweep_new *sweep, int64_t seq)
{
    struct stmt row = stmt_init(db, "UPDATE sweeps SET hash = :hash WHERE seq = :seq");

    stmt_bind_blob(&row, ":hash", sweep->source->hash, JOB_HASH_SIZE);
    stmt_bind_integer(&row, ":seq", seq);
    return stmt_run(&row, NULL);
}

/* Points are kept while later ones are made. If in the end the same sweep stands, *stands, *record
 * is that one and what was done is to be rolled back. */
static enum store_status insert(sqlite3 *db, const struct sweep_new *sweep,
                                struct sweep_record *record, bool *stands)
{
    char id[JOB_ID_SIZE];
    struct keeper keeper;
    int64_t seq;
    enum store_status status = store_make_id(id, 's');

    if (status == STORE_OK)
        status = insert_row(db, sweep, id);
    if (status)
        return status;
    seq = sqlite3_last_insert_rowid(db);
    status = keeper_init(&keeper, db, seq, sweep->ticket);
    if (status == STORE_OK)
        status = keep_points(&keeper, sweep->source, 0);
    status = keeper_fini(&keeper, status);
    if (status)
        return status;
    status = find_live(db, sweep, record);
    *stands = status == STORE_OK;
    if (status != STORE_NOT_FOUND)
        return status;
    keeper.text_bytes += (int64_t)(strlen(sweep->base) + strlen(sweep->axes) + strlen(sweep->zip));
    status = set_hash(db, sweep, seq);
    if (status == STORE_OK)
        status = keeper_end(&keeper, sweep->need);
    if (status == STORE_OK)
        status = store_sweeps_find(db, NULL, seq, record);
    return status ? status
                  : store_sweeps_audit(db, sweep->by, "sweep.submit", record, record->points);
}

/* Nothing but the insertion was done in this transaction. */
static enum store_status undo(struct store *store, sqlite3 *db)
{
    enum store_status status = store_exec(db, "ROLLBACK");
    struct watch forgotten;

    store_watch_take(store, false, &forgotten);
    return status ? status : store_exec(db, "BEGIN IMMEDIATE");
}

/* The sweep that a key belongs to, once more. */
static enum store_status insert_again(sqlite3 *db, const struct sweep_new *sweep,
                                      struct sweep_record *record)
{
    enum store_status status = pass_over(sweep->source);

    return status ? status : find_key(db, sweep, record);
}

static enum store_status insert_or_find(struct store *store, const struct sweep_new *sweep,
                                        struct sweep_record *record, bool *existed)
{
    struct sweep_record found = {0};
    bool known_key, stands = false;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = know_key(db, sweep, &known_key);
    if (status == STORE_OK)
        status = known_key ? insert_again(db, sweep, &found) : insert(db, sweep, &found, &stands);
    if (status == STORE_OK && stands)
        status = undo(store, db);
    if (status == STORE_OK && sweep->idempotency_key && !known_key)
        status = insert_key(db, sweep, found.seq);
    status = store_end(store, status);
    if (status) {
        sweep_record_fini(&found);
        return status;
    }
    *record = found;
    *existed = known_key || stands;
    return STORE_OK;
}

enum store_status store_sweeps_insert(struct store *store, const struct sweep_new *sweep,
                                      struct sweep_record *record, bool *existed)
{
    bool large = sweep->source->count >= KEEP_LARGE;
    enum store_status status;

    if (large)
        store_large_begin(store);
    status = insert_or_find(store, sweep, record, existed);
    if (large)
        store_large_end(store);
    return status;
}

/* ------------------------------------------------------------------ extension */

static enum store_status keep_more(sqlite3 *db, const struct sweep_record *sweep,
                                   const struct sweep_extension *more)
{
    struct keeper keeper;
    enum store_status status = keeper_init(&keeper, db, sweep->seq, &sweep->ticket);

    if (status == STORE_OK)
        status = keep_points(&keeper, more->source, sweep->points);
    keeper.text_bytes += (int64_t)strlen(more->axes) - (int64_t)strlen(sweep->axes);
    status = keeper_fini(&keeper, status);
    return status ? status : keeper_end(&keeper, more->need);
}

static enum store_status grow(sqlite3 *db, int64_t seq, const struct sweep_extension *more)
{
    struct stmt row = stmt_init(db, "UPDATE sweeps SET axes = :axes, points = points + :count"
                                    " WHERE seq = :seq");

    stmt_bind_text(&row, ":axes", more->axes);
    stmt_bind_integer(&row, ":count", (int64_t)more->source->count);
    stmt_bind_integer(&row, ":seq", seq);
    return stmt_run(&row, NULL);
}

static enum store_status extend(struct store *store, const char *id,
                                const struct sweep_extension *more, struct sweep_record *record)
{
    struct sweep_record found = {0}, grown = {0};
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = store_sweeps_find_alive(db, id, &found);
    if (status == STORE_OK && found.points != more->had)
        status = STORE_CONFLICT;
    if (status == STORE_OK)
        status = keep_more(db, &found, more);
    else if (status == STORE_CONFLICT)
        pass_over(more->source);
    if (status == STORE_OK)
        status = grow(db, found.seq, more);
    if (status == STORE_OK)
        status = store_sweeps_find(db, id, 0, &grown);
    if (status == STORE_OK)
        status =
            store_sweeps_audit(db, more->by, "sweep.extend", &grown, (int64_t)more->source->count);
    status = store_end(store, status);
    sweep_record_fini(&found);
    if (status)
        sweep_record_fini(&grown);
    else
        *record = grown;
    return status;
}

enum store_status store_sweeps_extend(struct store *store, const char *id,
                                      const struct sweep_extension *more,
                                      struct sweep_record *record)
{
    bool large = more->source->count >= KEEP_LARGE;
    enum store_status status;

    if (large)
        store_large_begin(store);
    status = extend(store, id, more, record);
    if (large)
        store_large_end(store);
    return status;
}

/* ---------------------------------------------------------------------- retry */

/* Numbers of the jobs that failed, or were cancelled. */
static enum store_status failed_jobs(sqlite3 *db, int64_t sweep, bool cancelled, int64_t **jobs,
                                     size_t *count)
{
    struct stmt row =
        stmt_init(db, "SELECT DISTINCT p.job FROM sweep_points AS p JOIN jobs AS j ON j.seq = p.job"
                      " WHERE p.sweep = :sweep AND (j.state = 'failed'"
                      " OR (:cancelled AND j.state = 'cancelled'))");
    int64_t *list = NULL;
    size_t used = 0;

    stmt_bind_integer(&row, ":sweep", sweep);
    stmt_bind_integer(&row, ":cancelled", cancelled);
    while (stmt_step(&row)) {
        list = stmt_room(&row, list, used, sizeof *list);
        if (!row.status)
            list[used++] = stmt_integer(&row, 0);
    }
    *jobs = list;
    *count = used;
    return stmt_fini(&row);
}

/* What the record's job is now. *made: the texts are new ones, to be freed. */
static struct job_new job_again(const struct job_record *record, const struct sweep_retry *retry,
                                bool *made)
{
    struct job_new job = {.job = record->job, .derived = record->derived, .chunks = record->chunks};
    bool outdated =
        record->error && strncmp(record->error, JOB_OUTDATED, strlen(JOB_OUTDATED)) == 0;

    memcpy(job.hash, record->hash, JOB_HASH_SIZE);
    *made = outdated && retry->renew && retry->renew(retry->context, record->job, &job);
    return job;
}

/* The same job once more, in the place of the one that failed. */
static enum store_status replace_job(struct keeper *keeper, int64_t old,
                                     const struct sweep_retry *retry)
{
    struct stmt row = stmt_init(keeper->db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs"
                                            " WHERE seq = :seq");
    struct job_record record = {0};
    int64_t seq = 0;
    enum store_status status;

    stmt_bind_integer(&row, ":seq", old);
    status = store_jobs_read_one(&row, &record);
    if (status == STORE_OK) {
        bool made;
        struct job_new job = job_again(&record, retry, &made);

        if (!made)
            status = store_sweeps_costs(keeper->db, old, &job);
        if (status == STORE_OK)
            status = keep_job(keeper, &job, &seq);
        if (made) {
            free((char *)job.job);
            free((char *)job.derived);
        }
    }
    job_record_fini(&record);
    if (status)
        return status;
    row = stmt_init(keeper->db, "UPDATE sweep_points SET job = :new"
                                " WHERE sweep = :sweep AND job = :old");
    stmt_bind_integer(&row, ":new", seq);
    stmt_bind_integer(&row, ":sweep", keeper->sweep);
    stmt_bind_integer(&row, ":old", old);
    return stmt_run(&row, NULL);
}

enum store_status store_sweeps_retry(struct store *store, const char *id, struct sweep_retry *retry)
{
    struct sweep_record found = {0};
    int64_t *jobs = NULL, points = 0;
    size_t failed = 0;
    bool large = false;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = store_sweeps_find_alive(db, id, &found);
    if (status == STORE_OK)
        status = failed_jobs(db, found.seq, retry->cancelled, &jobs, &failed);
    points = found.counts[JOB_FAILED] + (retry->cancelled ? found.counts[JOB_CANCELLED] : 0);
    large = failed >= KEEP_LARGE;
    if (large)
        store_large_begin(store);
    if (status == STORE_OK) {
        struct keeper keeper;

        status = keeper_init(&keeper, db, found.seq, &found.ticket);
        for (size_t i = 0; i < failed && status == STORE_OK; i++)
            status = replace_job(&keeper, jobs[i], retry);
        status = keeper_fini(&keeper, status);
        if (status == STORE_OK)
            status = keeper_end(&keeper, &retry->need);
    }
    if (status == STORE_OK && failed > 0)
        status = store_sweeps_audit(db, retry->by, "sweep.retry", &found, points);
    status = store_end(store, status);
    if (large)
        store_large_end(store);
    if (status == STORE_OK)
        retry->count = points;
    free(jobs);
    sweep_record_fini(&found);
    return status;
}
