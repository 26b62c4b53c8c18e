/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_samples.c - see store_samples.h. */
#include "store_samples.h"

#include "store_internal.h"

void family_sample_fini(struct family_sample *sample)
{
    blob_fini(&sample->whole);
    blob_fini(&sample->rest);
}

#define SAMPLE_COLUMNS                                                                             \
    "samples.seq, realizations, samples.chunks, whole, rest,"                                      \
    " (SELECT id FROM jobs WHERE jobs.seq = samples.job)"

/* The one sample that a statement finds; STORE_NOT_FOUND if none. Ends the statement. */
static enum store_status read_sample(struct stmt *row, struct family_sample *sample)
{
    struct family_sample found = {0};
    enum store_status status;
    bool any = stmt_step(row);

    if (any) {
        found.seq = stmt_integer(row, 0);
        found.realizations = stmt_integer(row, 1);
        found.chunks = stmt_integer(row, 2);
        found.whole.bytes = stmt_blob(row, 3, &found.whole.size);
        found.rest.bytes = stmt_blob(row, 4, &found.rest.size);
        stmt_text_to(row, 5, found.job, sizeof found.job);
    }
    status = stmt_fini(row);
    if (status) {
        family_sample_fini(&found);
        return status;
    }
    if (!any)
        return STORE_NOT_FOUND;
    *sample = found;
    return STORE_OK;
}

enum store_status store_samples_find(struct store *store, const struct sample_query *query,
                                     struct family_sample *sample)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT " SAMPLE_COLUMNS " FROM samples"
                                    " WHERE family = :family"
                                    " AND realizations > :above AND realizations <= :most"
                                    " AND (SELECT forced FROM jobs WHERE id = :id) = 0"
                                    " ORDER BY realizations DESC LIMIT 1");
    enum store_status status;

    stmt_bind_text(&row, ":id", query->id);
    stmt_bind_blob(&row, ":family", query->family, JOB_HASH_SIZE);
    stmt_bind_integer(&row, ":above", query->above);
    stmt_bind_integer(&row, ":most", query->most);
    status = read_sample(&row, sample);
    store_read_end(store, db);
    return status;
}

enum store_status store_samples_base(struct store *store, const char *id,
                                     struct family_sample *sample)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT " SAMPLE_COLUMNS " FROM bases JOIN samples"
                                    " ON samples.seq = bases.sample"
                                    " WHERE bases.job = (SELECT seq FROM jobs WHERE id = :id)");
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    status = read_sample(&row, sample);
    store_read_end(store, db);
    return status;
}

static bool sample_there(sqlite3 *db, int64_t seq)
{
    struct stmt row = stmt_init(db, "SELECT 1 FROM samples WHERE seq = :sample");
    bool there;

    stmt_bind_integer(&row, ":sample", seq);
    there = stmt_step(&row);
    stmt_fini(&row);
    return there;
}

enum store_status store_samples_adopt(struct store *store, const char *id, int64_t seq)
{
    int changes = 0;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);
    struct stmt row;

    if (status)
        return status;
    row = stmt_init(db, "INSERT INTO bases (job, sample)"
                        " SELECT jobs.seq, samples.seq FROM jobs, samples WHERE id = :id"
                        " AND state IN ('queued', 'running') AND samples.seq = :sample"
                        " ON CONFLICT (job) DO UPDATE SET sample = excluded.sample");
    stmt_bind_text(&row, ":id", id);
    stmt_bind_integer(&row, ":sample", seq);
    status = stmt_run(&row, &changes);
    if (status == STORE_OK && changes == 0)
        status = sample_there(db, seq) ? store_jobs_why(db, id) : STORE_NOT_FOUND;
    return store_end(store, status);
}

static enum store_status delete_where(sqlite3 *db, const char *sql, int64_t seq)
{
    struct stmt row = stmt_init(db, sql);

    stmt_bind_integer(&row, ":sample", seq);
    return stmt_run(&row, NULL);
}

enum store_status store_samples_drop(struct store *store, int64_t seq)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = delete_where(db, "DELETE FROM bases WHERE sample = :sample", seq);
    if (status == STORE_OK)
        status = delete_where(db, "DELETE FROM samples WHERE seq = :sample", seq);
    return store_end(store, status);
}

static enum store_status set_outcome(sqlite3 *db, const char *id, const char *outcome)
{
    struct stmt row = stmt_init(db, "UPDATE jobs SET outcome = :outcome"
                                    " WHERE id = :id AND json_valid(:outcome)");
    int changes = 0;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    stmt_bind_text(&row, ":outcome", outcome);
    status = stmt_run(&row, &changes);
    if (status == STORE_OK && changes == 0)
        status = store_fault(db, SQLITE_MISMATCH, "an outcome that is no JSON");
    return status;
}

static enum store_status insert_sample(sqlite3 *db, const char *id, const unsigned char *family,
                                       const struct sample_new *sample)
{
    struct stmt row =
        stmt_init(db, "INSERT INTO samples (family, realizations, chunks, job, whole, rest)"
                      " VALUES (:family, :realizations, :chunks,"
                      " (SELECT seq FROM jobs WHERE id = :id), :whole, :rest)"
                      " ON CONFLICT (family, realizations) DO UPDATE SET"
                      " chunks = excluded.chunks, whole = excluded.whole,"
                      " rest = excluded.rest");

    stmt_bind_text(&row, ":id", id);
    stmt_bind_blob(&row, ":family", family, JOB_HASH_SIZE);
    stmt_bind_integer(&row, ":realizations", sample->realizations);
    stmt_bind_integer(&row, ":chunks", sample->chunks);
    if (sample->whole.bytes)
        stmt_bind_blob(&row, ":whole", sample->whole.bytes, sample->whole.size);
    if (sample->rest.bytes)
        stmt_bind_blob(&row, ":rest", sample->rest.bytes, sample->rest.size);
    return stmt_run(&row, NULL);
}

enum store_status store_samples_add(sqlite3 *db, const char *id, const struct samples_kept *kept)
{
    enum store_status status = set_outcome(db, id, kept->outcome);

    for (size_t i = 0; status == STORE_OK && i < kept->count; i++)
        status = insert_sample(db, id, kept->family, &kept->samples[i]);
    return status;
}
