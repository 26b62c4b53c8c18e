/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_jobs.c - rows of the table jobs; see store_jobs.h and schema/. */
#include "store_internal.h"

#include "limits.h"
#include "log.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

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
    record->job = record->derived = record->error = NULL;
}

void job_records_free(struct job_record *records, size_t count)
{
    for (size_t i = 0; i < count; i++)
        job_record_fini(&records[i]);
    free(records);
}

/* ------------------------------------------------------------------- reading */

/* The columns of a record, in the order read_record wants them. */
#define RECORD_COLUMNS                                                                             \
    "seq, id, hash, state, submitted_ms, started_ms, finished_ms, chunks, chunks_done, job, "      \
    "derived, error, owner, priority, label, "                                                     \
    "(SELECT group_concat(tag, ' ') FROM job_tags WHERE job_tags.job = seq)"

static void read_record(struct stmt *row, struct job_record *record)
{
    char *id = stmt_text(row, 1), *state = stmt_text(row, 3);
    char *owner = stmt_text(row, 12);
    size_t hash_size = 0;
    void *hash = stmt_blob(row, 2, &hash_size);

    *record = (struct job_record){
        .seq = stmt_integer(row, 0),
        .submitted_ms = stmt_integer(row, 4),
        .started_ms = stmt_integer(row, 5),
        .finished_ms = stmt_integer(row, 6),
        .chunks = stmt_integer(row, 7),
        .chunks_done = stmt_integer(row, 8),
        .job = stmt_text(row, 9),
        .derived = stmt_text(row, 10),
        .error = stmt_text(row, 11),
        .ticket = {.priority = (int)stmt_integer(row, 13),
                   .label = stmt_text(row, 14),
                   .tags = stmt_text(row, 15)},
    };
    if (!row->status && id && owner && hash_size == JOB_HASH_SIZE && state &&
        job_state_parse(state, &record->state)) {
        snprintf(record->id, sizeof record->id, "%s", id);
        snprintf(record->ticket.owner, sizeof record->ticket.owner, "%s", owner);
        memcpy(record->hash, hash, JOB_HASH_SIZE);
    } else if (!row->status) {
        row->status = store_fault(row->db, SQLITE_CORRUPT, row->sql);
    }
    free(hash);
    free(owner);
    free(state);
    free(id);
    if (row->status)
        job_record_fini(record);
}

/* The first row, or STORE_NOT_FOUND. Ends the statement. */
static enum store_status read_one(struct stmt *row, struct job_record *record)
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
    size_t used = 0, room = 0;
    enum store_status status;

    while (stmt_step(row)) {
        if (used == room) {
            size_t more = room ? 2 * room : 16;
            struct job_record *bigger = realloc(array, more * sizeof *array);

            if (!bigger) {
                row->status = store_fault(row->db, SQLITE_NOMEM, row->sql);
                break;
            }
            array = bigger;
            room = more;
        }
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

static enum store_status find_id(sqlite3 *db, const char *id, struct job_record *record)
{
    struct stmt row = stmt_init(db, "SELECT " RECORD_COLUMNS " FROM jobs WHERE id = :id");

    stmt_bind_text(&row, ":id", id);
    return read_one(&row, record);
}

/* ------------------------------------------------------------------ insertion */

/* "j" and 80 random bits in base 32: nobody guesses one, and none is made twice. */
static enum store_status make_id(char id[JOB_ID_SIZE])
{
    static const char digits[] = "abcdefghijklmnopqrstuvwxyz234567";
    unsigned char bits[16];

    if (getrandom(bits, sizeof bits, 0) != (ssize_t)sizeof bits) {
        log_write(LOG_LEVEL_ERROR, "no_random_bits", LOG_FIELDS(log_integer("errno", errno)));
        return STORE_BROKEN;
    }
    id[0] = 'j';
    for (size_t i = 0; i < sizeof bits; i++)
        id[i + 1] = digits[bits[i] & 31];
    id[sizeof bits + 1] = '\0';
    return STORE_OK;
}

/* The job that an idempotency key was first used for; STORE_CONFLICT if that is another job. */
static enum store_status find_key(sqlite3 *db, const struct job_new *job, struct job_record *record)
{
    struct job_record found;
    struct stmt row;
    enum store_status status;

    if (!job->idempotency_key)
        return STORE_NOT_FOUND;
    row = stmt_init(db, "SELECT " RECORD_COLUMNS " FROM jobs WHERE seq ="
                        " (SELECT job FROM idempotency_keys WHERE key = :key)");
    stmt_bind_text(&row, ":key", job->idempotency_key);
    status = read_one(&row, &found);
    if (status)
        return status;
    if (memcmp(found.hash, job->hash, JOB_HASH_SIZE) != 0) {
        job_record_fini(&found);
        return STORE_CONFLICT;
    }
    *record = found;
    return STORE_OK;
}

static enum store_status find_live(sqlite3 *db, const struct job_new *job,
                                   struct job_record *record)
{
    struct stmt row = stmt_init(db, "SELECT " RECORD_COLUMNS " FROM jobs WHERE hash = :hash"
                                    " AND state IN ('queued', 'running', 'done')"
                                    " AND superseded = 0");

    stmt_bind_blob(&row, ":hash", job->hash, JOB_HASH_SIZE);
    return read_one(&row, record);
}

/* tags: one space between two. */
static enum store_status insert_tags(sqlite3 *db, const char *tags, int64_t seq)
{
    enum store_status status = STORE_OK;

    while (tags && status == STORE_OK) {
        struct stmt row = stmt_init(db, "INSERT INTO job_tags (job, tag)"
                                        " VALUES (:job, substr(:tags, 1, :length))");
        size_t length = strcspn(tags, " ");

        stmt_bind_integer(&row, ":job", seq);
        stmt_bind_text(&row, ":tags", tags);
        stmt_bind_integer(&row, ":length", (int64_t)length);
        status = stmt_run(&row, NULL);
        tags = tags[length] ? tags + length + 1 : NULL;
    }
    return status;
}

/* A job that stands makes way for one that is run anew. */
static enum store_status supersede(sqlite3 *db, const struct job_new *job)
{
    struct stmt row = stmt_init(db, "UPDATE jobs SET superseded = 1 WHERE hash = :hash"
                                    " AND state IN ('queued', 'running', 'done')"
                                    " AND superseded = 0");

    stmt_bind_blob(&row, ":hash", job->hash, JOB_HASH_SIZE);
    return stmt_run(&row, NULL);
}

static enum store_status insert_row(sqlite3 *db, const struct job_new *job,
                                    struct job_record *record)
{
    static const struct ticket local = {.owner = OWNER_LOCAL};
    const struct ticket *ticket = job->ticket ? job->ticket : &local;
    char id[JOB_ID_SIZE];
    enum store_status status = make_id(id);
    struct stmt row;
    int changes = 0;

    if (status)
        return status;
    /* A text that is no JSON would break every filtered list from then on. (SQLite does not trust a
     * CHECK with this function.) */
    row = stmt_init(db, "INSERT INTO jobs (id, hash, state, submitted_ms, chunks, job, derived,"
                        " owner, priority, label)"
                        " SELECT :id, :hash, 'queued', :now, :chunks, :job, :derived,"
                        " :owner, :priority, :label"
                        " WHERE json_valid(:job) AND json_valid(:derived)");
    stmt_bind_text(&row, ":owner", ticket->owner);
    stmt_bind_integer(&row, ":priority", ticket->priority);
    stmt_bind_text(&row, ":label", ticket->label);
    stmt_bind_text(&row, ":id", id);
    stmt_bind_blob(&row, ":hash", job->hash, JOB_HASH_SIZE);
    stmt_bind_integer(&row, ":now", store_now_ms());
    stmt_bind_integer(&row, ":chunks", job->chunks);
    stmt_bind_text(&row, ":job", job->job);
    stmt_bind_text(&row, ":derived", job->derived);
    status = stmt_run(&row, &changes);
    if (status == STORE_OK && changes == 0)
        status = store_fault(db, SQLITE_MISMATCH, "a job that is no JSON");
    if (status == STORE_OK && ticket->tags)
        status = insert_tags(db, ticket->tags, sqlite3_last_insert_rowid(db));
    return status ? status : find_id(db, id, record);
}

static enum store_status insert_key(sqlite3 *db, const char *key, int64_t seq)
{
    struct stmt row = stmt_init(db, "INSERT INTO idempotency_keys (key, job) VALUES (:key, :job)");

    stmt_bind_text(&row, ":key", key);
    stmt_bind_integer(&row, ":job", seq);
    return stmt_run(&row, NULL);
}

enum store_status store_jobs_insert(struct store *store, const struct job_new *job,
                                    struct job_record *record, bool *existed)
{
    struct job_record found = {0};
    sqlite3 *db;
    bool known_key, stands;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = find_key(db, job, &found);
    known_key = status == STORE_OK;
    if (status == STORE_NOT_FOUND && !job->force)
        status = find_live(db, job, &found);
    else if (status == STORE_NOT_FOUND && (status = supersede(db, job)) == STORE_OK)
        status = STORE_NOT_FOUND;
    stands = status == STORE_OK;
    if (status == STORE_NOT_FOUND)
        status = insert_row(db, job, &found);
    if (status == STORE_OK && job->idempotency_key && !known_key)
        status = insert_key(db, job->idempotency_key, found.seq);
    status = store_end(store, status);
    if (status) {
        job_record_fini(&found);
        return status;
    }
    *record = found;
    *existed = stands;
    return STORE_OK;
}

/* --------------------------------------------------------------------- lists */

enum store_status store_jobs_get(struct store *store, const char *id, struct job_record *record)
{
    sqlite3 *db = store_read_begin(store);
    enum store_status status = find_id(db, id, record);

    store_read_end(store, db);
    return status;
}

enum { PATH_BYTES = 128, NAME_BYTES = 32, LIST_SQL_BYTES = 8192 };

/* "potential.amplitude" as SQLite's "$.potential.amplitude". False for what no job can have. */
static bool make_json_path(const char *path, char json_path[PATH_BYTES])
{
    size_t length = strlen(path);

    if (length == 0 || length + 3 > PATH_BYTES || path[0] == '.' || path[length - 1] == '.' ||
        strstr(path, "..") || path[strspn(path, "abcdefghijklmnopqrstuvwxyz_0123456789.")])
        return false;
    snprintf(json_path, PATH_BYTES, "$.%s", path);
    return true;
}

/* The condition of filter number i; the parameters' names end in its number. */
static void add_filter_sql(char *sql, size_t i)
{
    size_t used = strlen(sql);

    snprintf(sql + used, LIST_SQL_BYTES - used,
             " AND CASE json_type(job, :path%zu)"
             " WHEN 'integer' THEN json_extract(job, :path%zu) = :exact%zu"
             " WHEN 'real' THEN"
             " abs(json_extract(job, :path%zu) - :number%zu) <= 1e-15 * abs(:number%zu)"
             " WHEN 'text' THEN json_extract(job, :path%zu) = :text%zu"
             " WHEN 'true' THEN :text%zu = 'true' WHEN 'false' THEN :text%zu = 'false'"
             " ELSE 0 END",
             i, i, i, i, i, i, i, i, i, i);
}

/* What a filter's value is as a JSON number. */
struct filter_number {
    bool is_integer, is_number;
    int64_t integer;
    double number;
};

static struct filter_number read_number(const char *value)
{
    struct filter_number read = {0};
    char *end;

    if (!*value || value[strspn(value, "0123456789+-.eE")])
        return read;
    errno = 0;
    read.integer = strtoll(value, &end, 10);
    read.is_integer = *end == '\0' && errno == 0;
    read.number = strtod(value, &end);
    read.is_number = *end == '\0' && isfinite(read.number);
    return read;
}

/* ":path3" and the like. */
static const char *numbered(char name[NAME_BYTES], const char *stem, size_t i)
{
    snprintf(name, NAME_BYTES, "%s%zu", stem, i);
    return name;
}

/* A value that is no number leaves :exact and :number NULL, which equal nothing. */
static void bind_filter(struct stmt *list, const char *value, size_t i, const char *json_path)
{
    struct filter_number read = read_number(value);
    char name[NAME_BYTES];

    stmt_bind_text(list, numbered(name, ":path", i), json_path);
    stmt_bind_text(list, numbered(name, ":text", i), value);
    if (read.is_number)
        stmt_bind_number(list, numbered(name, ":number", i), read.number);
    if (read.is_integer)
        stmt_bind_integer(list, numbered(name, ":exact", i), read.integer);
    else if (read.is_number)
        stmt_bind_number(list, numbered(name, ":exact", i), read.number);
}

enum store_status store_jobs_list(struct store *store, const struct job_query *query,
                                  struct job_record **records, size_t *count)
{
    char sql[LIST_SQL_BYTES] = "SELECT " RECORD_COLUMNS " FROM jobs WHERE seq < :before";
    char paths[LIMIT_FILTERS_MAX][PATH_BYTES];
    struct stmt list;
    sqlite3 *db;
    enum store_status status;

    assert(query->filter_count <= LIMIT_FILTERS_MAX);
    if (query->filter_count > LIMIT_FILTERS_MAX)
        return STORE_BROKEN;
    if (query->state >= 0)
        strcat(sql, " AND state = :state");
    for (size_t i = 0; i < query->filter_count; i++) {
        if (!make_json_path(query->filters[i].path, paths[i])) {
            *records = NULL;
            *count = 0;
            return STORE_OK;
        }
        add_filter_sql(sql, i);
    }
    strcat(sql, " ORDER BY seq DESC LIMIT :limit");

    db = store_read_begin(store);
    list = stmt_init(db, sql);
    stmt_bind_integer(&list, ":before", query->before_seq > 0 ? query->before_seq : INT64_MAX);
    stmt_bind_integer(&list, ":limit",
                      query->limit > INT64_MAX ? INT64_MAX : (int64_t)query->limit);
    if (query->state >= 0)
        stmt_bind_text(&list, ":state", job_state_name((enum job_state)query->state));
    for (size_t i = 0; i < query->filter_count; i++)
        bind_filter(&list, query->filters[i].value, i, paths[i]);
    status = read_all(&list, records, count);
    store_read_end(store, db);
    return status;
}

enum store_status store_jobs_counts(struct store *store, int64_t counts[JOB_STATES])
{
    int64_t found[JOB_STATES] = {0};
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT state, jobs FROM job_counts");
    enum store_status status;

    while (stmt_step(&row)) {
        char *name = stmt_text(&row, 0);
        enum job_state state;

        if (name && job_state_parse(name, &state))
            found[state] = stmt_integer(&row, 1);
        free(name);
    }
    status = stmt_fini(&row);
    store_read_end(store, db);
    if (status == STORE_OK)
        memcpy(counts, found, sizeof found);
    return status;
}

enum store_status store_jobs_unfinished(struct store *store, struct job_record **records,
                                        size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt list = stmt_init(db, "SELECT " RECORD_COLUMNS " FROM jobs"
                                     " WHERE state IN ('queued', 'running') ORDER BY seq");
    enum store_status status = read_all(&list, records, count);

    store_read_end(store, db);
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
    [JOB_FAILED] = "UPDATE jobs SET state = 'failed', finished_ms = :now, error = :error"
                   " WHERE id = :id AND state IN ('queued', 'running')",
    [JOB_CANCELLED] = "UPDATE jobs SET state = 'cancelled', finished_ms = :now"
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

enum store_status store_jobs_move(sqlite3 *db, const char *id, enum job_state to, const char *error)
{
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
    assert(status || changes == 1);
    return status;
}

static enum store_status move(struct store *store, const char *id, enum job_state to,
                              const char *error)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

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
