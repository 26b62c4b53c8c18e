/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sweeps.c - sweeps are kept, extended, tried again, cancelled; see store_sweeps.h. */
#include "store_segment.h"
#include "store_sweeps_internal.h"

#include <string.h>

/* The statements that every point runs. */
struct keeper {
    sqlite3 *db;
    const struct ticket *ticket;
    int64_t sweep, last; /* the youngest job that was there before */
    struct stmt find, job, point;
    int64_t jobs, bytes; /* new ones, and what they are expected to need */
    double seconds;
};

/* For 10^5 jobs at once triggers and CHECKs are most of the work. While the keeper lives they rest:
 * what it binds is made by this program, and what triggers on the insertion of jobs keep up to date
 * is done in one go: book. Cannot fail but for our own mistake. */
static void rest_triggers(sqlite3 *db, bool rest)
{
    sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, !rest, (int *)NULL);
    store_exec(db, rest ? "PRAGMA ignore_check_constraints = ON"
                        : "PRAGMA ignore_check_constraints = OFF");
}

static struct keeper keeper_init(sqlite3 *db, int64_t sweep, const struct ticket *ticket)
{
    rest_triggers(db, true); /* before they become part of the statements */
    return (struct keeper){
        .db = db,
        .ticket = ticket,
        .sweep = sweep,
        .find = stmt_init(db, "SELECT seq FROM jobs WHERE hash = :hash"
                              " AND state IN ('queued', 'running', 'done') AND superseded = 0"),
        .job = store_insert_stmt(db, true), /* made by form/, just now or when the job was new */
        .point = stmt_init(db, "INSERT INTO sweep_points (sweep, point, job, place)"
                               " VALUES (:sweep, :point, :job, :place)"),
    };
}

static enum store_status keeper_fini(struct keeper *keeper, enum store_status status)
{
    enum store_status ends[] = {stmt_fini(&keeper->find), stmt_fini(&keeper->job),
                                stmt_fini(&keeper->point)};

    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++)
        status = status ? status : ends[i];
    rest_triggers(keeper->db, false);
    return status;
}

/* Counters of states, of the owner and of the sweep; first whether the owner may have so much. */
static enum store_status book(const struct keeper *keeper)
{
    static const char *const sql[] = {
        "UPDATE job_counts SET jobs = jobs + :jobs WHERE state = 'queued'",
        "INSERT OR IGNORE INTO owners (owner) VALUES (:owner)",
        "UPDATE owners SET queued = queued + :jobs, waiting_seconds = waiting_seconds + :seconds,"
        " bytes = bytes + :bytes WHERE owner = :owner",
        "UPDATE sweep_counts SET points = (SELECT count(*) FROM sweep_points AS p"
        " JOIN jobs AS j ON j.seq = p.job WHERE p.sweep = :sweep AND j.state = sweep_counts.state)"
        " WHERE sweep = :sweep",
    };
    const struct quota_need need = {{(double)keeper->jobs, keeper->seconds, (double)keeper->bytes}};
    enum store_status status = store_owners_check(keeper->db, keeper->ticket->owner, &need);

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
        if (strstr(sql[i], ":sweep"))
            stmt_bind_integer(&row, ":sweep", keeper->sweep);
        status = stmt_run(&row, NULL);
    }
    return status;
}

/* The job that stands, or a new one of this sweep. */
static enum store_status keep_job(struct keeper *keeper, const struct job_new *job, int64_t *seq)
{
    char id[JOB_ID_SIZE];
    enum store_status status;

    stmt_bind_blob(&keeper->find, ":hash", job->hash, JOB_HASH_SIZE);
    *seq = stmt_step(&keeper->find) ? stmt_integer(&keeper->find, 0) : 0;
    stmt_again(&keeper->find);
    if (keeper->find.status || *seq > 0)
        return keeper->find.status;
    status = store_make_id(id, 'j');
    if (status)
        return status;
    store_insert_bind(&keeper->job, job, keeper->ticket, id);
    stmt_bind_integer(&keeper->job, ":alone", 0);
    status = stmt_run_again(&keeper->job, NULL);
    if (status)
        return status;
    *seq = sqlite3_last_insert_rowid(keeper->db);
    keeper->jobs++;
    keeper->bytes += (int64_t)job->bytes;
    keeper->seconds += job->core_seconds;
    return status;
}

static enum store_status last_job(sqlite3 *db, int64_t *seq)
{
    struct stmt row = stmt_init(db, "SELECT coalesce(max(seq), 0) FROM sqlite_sequence"
                                    " WHERE name = 'jobs'");

    if (stmt_step(&row))
        *seq = stmt_integer(&row, 0);
    return stmt_fini(&row);
}

/* The sweep's tags for those of its jobs that are younger than `last`. */
static enum store_status tag_jobs(sqlite3 *db, int64_t sweep, const char *tags, int64_t last)
{
    enum store_status status = STORE_OK;

    while (tags && status == STORE_OK) {
        struct stmt row = stmt_init(db, "INSERT OR IGNORE INTO job_tags (job, tag)"
                                        " SELECT job, substr(:tags, 1, :length) FROM sweep_points"
                                        " WHERE sweep = :sweep AND job > :last");
        size_t length = strcspn(tags, " ");

        stmt_bind_text(&row, ":tags", tags);
        stmt_bind_integer(&row, ":length", (int64_t)length);
        stmt_bind_integer(&row, ":sweep", sweep);
        stmt_bind_integer(&row, ":last", last);
        status = stmt_run(&row, NULL);
        tags = tags[length] ? tags + length + 1 : NULL;
    }
    return status;
}

/* What every insertion ends with, after keeper_fini. */
static enum store_status end_jobs(const struct keeper *keeper)
{
    enum store_status status = book(keeper);

    if (status == STORE_OK)
        status = tag_jobs(keeper->db, keeper->sweep, keeper->ticket->tags, keeper->last);
    for (int64_t i = 1; i <= keeper->jobs && status == STORE_OK; i++)
        status = store_segment_inserted(keeper->db, keeper->last + i);
    return status;
}

static enum store_status keep_point(struct keeper *keeper, const struct sweep_point_new *point,
                                    int64_t number)
{
    int64_t job;
    enum store_status status = keep_job(keeper, &point->job, &job);

    if (status)
        return status;
    stmt_bind_integer(&keeper->point, ":sweep", keeper->sweep);
    stmt_bind_integer(&keeper->point, ":point", number);
    stmt_bind_integer(&keeper->point, ":job", job);
    stmt_bind_text(&keeper->point, ":place", point->place);
    return stmt_run_again(&keeper->point, NULL);
}

/* Points `first` and on, with the jobs that stand or new ones; end_jobs is still to be done. */
static enum store_status keep_points(struct keeper *keeper, const struct sweep_source *source,
                                     int64_t first)
{
    enum store_status status = last_job(keeper->db, &keeper->last);
    size_t count = 1;

    while (count > 0 && status == STORE_OK) {
        const struct sweep_point_new *points = NULL;

        status = source->take(source->state, &points, &count);
        for (size_t i = 0; i < count && status == STORE_OK; i++)
            status = keep_point(keeper, &points[i], first++);
    }
    return keeper_fini(keeper, status);
}

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
    keeper = keeper_init(db, seq, sweep->ticket);
    status = keep_points(&keeper, sweep->source, 0);
    if (status)
        return status;
    status = find_live(db, sweep, record);
    *stands = status == STORE_OK;
    if (status != STORE_NOT_FOUND)
        return status;
    status = set_hash(db, sweep, seq);
    if (status == STORE_OK)
        status = end_jobs(&keeper);
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

enum store_status store_sweeps_insert(struct store *store, const struct sweep_new *sweep,
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

/* ------------------------------------------------------------------ extension */

static enum store_status keep_more(sqlite3 *db, const struct sweep_record *sweep,
                                   const struct sweep_source *source)
{
    struct keeper keeper = keeper_init(db, sweep->seq, &sweep->ticket);
    enum store_status status = keep_points(&keeper, source, sweep->points);

    return status ? status : end_jobs(&keeper);
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

enum store_status store_sweeps_extend(struct store *store, const char *id,
                                      const struct sweep_extension *more,
                                      struct sweep_record *record)
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
        status = keep_more(db, &found, more->source);
    else if (status == STORE_CONFLICT)
        pass_over(more->source);
    if (status == STORE_OK)
        status = grow(db, found.seq, more);
    if (status == STORE_OK)
        status = store_sweeps_find(db, id, 0, &grown);
    if (status == STORE_OK)
        status = store_sweeps_audit(db, more->by, "sweep.extend", &grown,
                                    (int64_t)more->source->count);
    status = store_end(store, status);
    sweep_record_fini(&found);
    if (status)
        sweep_record_fini(&grown);
    else
        *record = grown;
    return status;
}

/* ---------------------------------------------------------------------- retry */

/* Numbers of the jobs that failed. */
static enum store_status failed_jobs(sqlite3 *db, int64_t sweep, int64_t **jobs, size_t *count)
{
    struct stmt row =
        stmt_init(db, "SELECT DISTINCT p.job FROM sweep_points AS p JOIN jobs AS j ON j.seq = p.job"
                      " WHERE p.sweep = :sweep AND j.state = 'failed'");
    int64_t *list = NULL;
    size_t used = 0;

    stmt_bind_integer(&row, ":sweep", sweep);
    while (stmt_step(&row)) {
        list = stmt_room(&row, list, used, sizeof *list);
        if (!row.status)
            list[used++] = stmt_integer(&row, 0);
    }
    *jobs = list;
    *count = used;
    return stmt_fini(&row);
}

/* The same job once more, in the place of the one that failed. */
static enum store_status replace_job(struct keeper *keeper, int64_t old)
{
    struct stmt row = stmt_init(keeper->db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs"
                                            " WHERE seq = :seq");
    struct job_record record = {0};
    int64_t seq = 0;
    enum store_status status;

    stmt_bind_integer(&row, ":seq", old);
    status = store_jobs_read_one(&row, &record);
    if (status == STORE_OK) {
        struct job_new job = {
            .job = record.job, .derived = record.derived, .chunks = record.chunks};

        memcpy(job.hash, record.hash, JOB_HASH_SIZE);
        status = store_sweeps_costs(keeper->db, old, &job);
        if (status == STORE_OK)
            status = keep_job(keeper, &job, &seq);
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

enum store_status store_sweeps_retry(struct store *store, const char *id, const struct identity *by,
                                     int64_t *count)
{
    struct sweep_record found = {0};
    int64_t *jobs = NULL;
    size_t failed = 0;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = store_sweeps_find_alive(db, id, &found);
    if (status == STORE_OK)
        status = failed_jobs(db, found.seq, &jobs, &failed);
    if (status == STORE_OK) {
        struct keeper keeper = keeper_init(db, found.seq, &found.ticket);

        status = last_job(db, &keeper.last);
        for (size_t i = 0; i < failed && status == STORE_OK; i++)
            status = replace_job(&keeper, jobs[i]);
        status = keeper_fini(&keeper, status);
        if (status == STORE_OK)
            status = end_jobs(&keeper);
    }
    if (status == STORE_OK && failed > 0)
        status = store_sweeps_audit(db, by, "sweep.retry", &found, found.counts[JOB_FAILED]);
    status = store_end(store, status);
    if (status == STORE_OK)
        *count = found.counts[JOB_FAILED];
    free(jobs);
    sweep_record_fini(&found);
    return status;
}
