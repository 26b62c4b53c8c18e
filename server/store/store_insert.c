/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_insert.c - a job is accepted: found again, or kept; see store_jobs.h. */
#include "store_internal.h"
#include "store_segment.h"

#include "log.h"

#include <errno.h>
#include <string.h>
#include <sys/random.h>

enum store_status store_make_ids(char (*ids)[JOB_ID_SIZE], size_t count, char kind)
{
    static const char digits[] = "abcdefghijklmnopqrstuvwxyz234567";
    enum { BITS = 16, AT_ONCE = 16 }; /* the kernel gives 256 bytes whole */
    unsigned char bits[AT_ONCE * BITS];

    for (size_t i = 0; i < count; i++) {
        const unsigned char *own = bits + i % AT_ONCE * BITS;
        size_t left = count - i < AT_ONCE ? count - i : AT_ONCE;

        if (i % AT_ONCE == 0 && getrandom(bits, left * BITS, 0) != (ssize_t)(left * BITS)) {
            log_write(LOG_LEVEL_ERROR, "no_random_bits", LOG_FIELDS(log_integer("errno", errno)));
            return STORE_BROKEN;
        }
        ids[i][0] = kind;
        for (size_t c = 0; c < BITS; c++)
            ids[i][c + 1] = digits[own[c] & 31];
        ids[i][BITS + 1] = '\0';
    }
    return STORE_OK;
}

enum store_status store_make_id(char id[JOB_ID_SIZE], char kind)
{
    return store_make_ids((char(*)[JOB_ID_SIZE])id, 1, kind);
}

static const char *owner_of(const struct job_new *job)
{
    return job->ticket ? job->ticket->owner : OWNER_LOCAL;
}

/* The job that the owner's key was first used for; STORE_CONFLICT if that is another job. */
static enum store_status find_key(sqlite3 *db, const struct job_new *job, struct job_record *record)
{
    struct job_record found;
    struct stmt row;
    enum store_status status;

    if (!job->idempotency_key)
        return STORE_NOT_FOUND;
    row = stmt_init(db, "SELECT 1 FROM sweep_keys WHERE owner = :owner AND key = :key");
    stmt_bind_text(&row, ":owner", owner_of(job));
    stmt_bind_text(&row, ":key", job->idempotency_key);
    if (stmt_step(&row)) {
        stmt_fini(&row);
        return STORE_CONFLICT;
    }
    status = stmt_fini(&row);
    if (status)
        return status;
    row = stmt_init(db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs WHERE seq ="
                        " (SELECT job FROM idempotency_keys"
                        " WHERE owner = :owner AND key = :key)");
    stmt_bind_text(&row, ":owner", owner_of(job));
    stmt_bind_text(&row, ":key", job->idempotency_key);
    status = store_jobs_read_one(&row, &found);
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
    struct stmt row = stmt_init(db, "SELECT " STORE_RECORD_COLUMNS " FROM jobs WHERE hash = :hash"
                                    " AND state IN ('queued', 'running', 'done')"
                                    " AND superseded = 0");

    stmt_bind_blob(&row, ":hash", job->hash, JOB_HASH_SIZE);
    return store_jobs_read_one(&row, record);
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

/* A text that is no JSON would break every filtered list from then on. (SQLite does not trust a
 * CHECK with this function.) */
static struct stmt insert_stmt(sqlite3 *db)
{
    return stmt_init(db, "INSERT INTO jobs (id, hash, state, submitted_ms, chunks, job, derived,"
                         " owner, priority, label, core_seconds, bytes, forced, alone)"
                         " SELECT :id, :hash, 'queued', :now, :chunks, :job, :derived,"
                         " :owner, :priority, :label, :core_seconds, :bytes, :forced, 1"
                         " WHERE json_valid(:job) AND json_valid(:derived)");
}

static void insert_bind(struct stmt *row, const struct job_new *job, const struct ticket *ticket,
                        const char *id)
{
    stmt_bind_text(row, ":owner", ticket->owner);
    stmt_bind_integer(row, ":priority", ticket->priority);
    stmt_bind_text(row, ":label", ticket->label);
    stmt_bind_number(row, ":core_seconds", job->core_seconds);
    stmt_bind_integer(row, ":bytes", (int64_t)job->bytes);
    stmt_bind_integer(row, ":forced", job->force);
    stmt_bind_text(row, ":id", id);
    stmt_bind_blob(row, ":hash", job->hash, JOB_HASH_SIZE);
    stmt_bind_integer(row, ":now", store_now_ms());
    stmt_bind_integer(row, ":chunks", job->chunks);
    stmt_bind_text(row, ":job", job->job);
    stmt_bind_text(row, ":derived", job->derived);
}

static enum store_status insert_row(sqlite3 *db, const struct job_new *job,
                                    struct job_record *record)
{
    static const struct ticket local = {.owner = OWNER_LOCAL};
    const struct ticket *ticket = job->ticket ? job->ticket : &local;
    char id[JOB_ID_SIZE];
    enum store_status status = store_make_id(id, 'j');
    struct stmt row;
    int changes = 0;

    if (status)
        return status;
    row = insert_stmt(db);
    insert_bind(&row, job, ticket, id);
    status = stmt_run(&row, &changes);
    if (status == STORE_OK && changes == 0)
        status = store_fault(db, SQLITE_MISMATCH, "a job that is no JSON");
    if (status == STORE_OK && ticket->tags)
        status = insert_tags(db, ticket->tags, sqlite3_last_insert_rowid(db));
    if (status == STORE_OK)
        status = store_segment_inserted(db, sqlite3_last_insert_rowid(db));
    return status ? status : store_jobs_find(db, id, record);
}

static enum store_status insert_key(sqlite3 *db, const struct job_new *job, int64_t seq)
{
    struct stmt row = stmt_init(db, "INSERT INTO idempotency_keys (owner, key, job)"
                                    " VALUES (:owner, :key, :job)");

    stmt_bind_text(&row, ":owner", owner_of(job));
    stmt_bind_text(&row, ":key", job->idempotency_key);
    stmt_bind_integer(&row, ":job", seq);
    return stmt_run(&row, NULL);
}

/* A job that stands nowhere yet, with its line in the audit log. */
static enum store_status insert_new(sqlite3 *db, const struct job_new *job,
                                    struct job_record *record)
{
    const struct quota_need need = {{1, job->core_seconds, job->bytes}};
    enum store_status status = store_owners_check(db, owner_of(job), &need);

    if (status == STORE_OK)
        status = insert_row(db, job, record);
    if (status == STORE_OK && job->by)
        status = store_audit_add(
            db, &(struct audit_new){job->by, "job.submit", record->id, job->force ? "force" : ""});
    return status;
}

/* A job of sweeps that somebody wants by itself now: it no longer ends with them. */
static enum store_status stand_alone(sqlite3 *db, int64_t seq)
{
    struct stmt row = stmt_init(db, "UPDATE jobs SET alone = 1 WHERE seq = :seq AND alone = 0");

    stmt_bind_integer(&row, ":seq", seq);
    return stmt_run(&row, NULL);
}

enum store_status store_jobs_add(sqlite3 *db, const struct job_new *job, struct job_record *record,
                                 bool *existed)
{
    struct job_record found = {0};
    bool known_key;
    enum store_status status = find_key(db, job, &found);

    known_key = status == STORE_OK;
    if (status == STORE_NOT_FOUND && !job->force)
        status = find_live(db, job, &found);
    else if (status == STORE_NOT_FOUND && (status = supersede(db, job)) == STORE_OK)
        status = STORE_NOT_FOUND;
    *existed = status == STORE_OK;
    if (*existed)
        status = stand_alone(db, found.seq);
    if (status == STORE_NOT_FOUND)
        status = insert_new(db, job, &found);
    if (status == STORE_OK && job->idempotency_key && !known_key)
        status = insert_key(db, job, found.seq);
    if (status)
        job_record_fini(&found);
    else
        *record = found;
    return status;
}

enum store_status store_jobs_insert(struct store *store, const struct job_new *job,
                                    struct job_record *record, bool *existed)
{
    struct job_record found = {0};
    bool stands = false;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN_SHARED(store, &db);

    if (status)
        return status;
    status = store_jobs_add(db, job, &found, &stands);
    status = store_end(store, status);
    if (status) {
        job_record_fini(&found);
        return status;
    }
    *record = found;
    *existed = stands;
    return STORE_OK;
}
