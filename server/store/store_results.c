/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_results.c - blobs of jobs in motion and of jobs that are done; see store_results.h. */
#include "store_results.h"

#include "store_internal.h"
#include "store_news.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

void blob_fini(struct blob *blob)
{
    free(blob->bytes);
    blob->bytes = NULL;
    blob->size = 0;
}

/* Runs a statement with :id, :chunk and :bytes, the latter two where it has them (chunk < 0, bytes
 * NULL: it has not). */
struct chunk_change {
    const char *id;
    int64_t chunk;
    const void *bytes;
    size_t size;
};
static enum store_status change(sqlite3 *db, const char *sql, const struct chunk_change *what,
                                int *changes)
{
    struct stmt row = stmt_init(db, sql);

    stmt_bind_text(&row, ":id", what->id);
    if (what->chunk >= 0)
        stmt_bind_integer(&row, ":chunk", what->chunk);
    if (what->bytes)
        stmt_bind_blob(&row, ":bytes", what->bytes, what->size);
    return stmt_run(&row, changes);
}

/* Reads the one blob that a statement finds; STORE_NOT_FOUND if none. Ends the statement. */
static enum store_status read_blob(struct stmt *row, struct blob *blob)
{
    struct blob found = {0};
    enum store_status status;
    bool any = stmt_step(row);

    if (any)
        found.bytes = stmt_blob(row, 0, &found.size);
    status = stmt_fini(row);
    if (status) {
        blob_fini(&found);
        return status;
    }
    if (!any)
        return STORE_NOT_FOUND;
    *blob = found;
    return STORE_OK;
}

/* ------------------------------------------------------------------ in motion */

static enum store_status put_checkpoint(sqlite3 *db, const struct chunk_change *what)
{
    int changes = 0;
    enum store_status status =
        change(db,
               "INSERT INTO checkpoints (job, chunk, bytes)"
               " SELECT seq, :chunk, :bytes FROM jobs"
               " WHERE id = :id AND state = 'running' AND :chunk < chunks"
               " ON CONFLICT (job, chunk) DO UPDATE SET bytes = excluded.bytes",
               what, &changes);

    return status == STORE_OK && changes == 0 ? store_jobs_why(db, what->id) : status;
}

/* All of them in one transaction. */
static enum store_status put_all(struct store *store,
                                 enum store_status (*put)(sqlite3 *, const struct chunk_change *),
                                 const struct chunk_change *first, const struct chunk_new *chunks,
                                 int64_t count)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN_SHARED(store, &db);

    assert(first->chunk >= 0 && count >= 1);
    if (status)
        return status;
    for (int64_t i = 0; status == STORE_OK && i < count; i++) {
        const struct chunk_change what = {first->id, first->chunk + i, chunks[i].bytes,
                                          chunks[i].size};

        assert(what.bytes);
        status = put(db, &what);
    }
    return store_end(store, status);
}

enum store_status store_results_checkpoints(struct store *store, const char *id, int64_t chunk,
                                            const struct chunk_new *checkpoints, int64_t count)
{
    const struct chunk_change first = {.id = id, .chunk = chunk};

    return put_all(store, put_checkpoint, &first, checkpoints, count);
}

static enum store_status load(struct store *store, const char *sql, const char *id, int64_t chunk,
                              struct blob *blob)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, sql);
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    stmt_bind_integer(&row, ":chunk", chunk);
    status = read_blob(&row, blob);
    store_read_end(store, db);
    return status;
}

enum store_status store_results_load_checkpoint(struct store *store, const char *id, int64_t chunk,
                                                struct blob *checkpoint)
{
    return load(store,
                "SELECT bytes FROM checkpoints"
                " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND chunk = :chunk",
                id, chunk, checkpoint);
}

/* Whether the chunk is there already: then putting it again is no fault. */
static enum store_status why_no_chunk(sqlite3 *db, const struct chunk_change *what)
{
    struct stmt row =
        stmt_init(db, "SELECT 1 FROM chunks"
                      " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND chunk = :chunk");
    enum store_status status;
    bool there;

    stmt_bind_text(&row, ":id", what->id);
    stmt_bind_integer(&row, ":chunk", what->chunk);
    there = stmt_step(&row);
    status = stmt_fini(&row);
    return status || there ? status : store_jobs_why(db, what->id);
}

static enum store_status put_chunk(sqlite3 *db, const struct chunk_change *what)
{
    struct chunk_change only_id = {.id = what->id, .chunk = -1};
    struct chunk_change only_chunk = {.id = what->id, .chunk = what->chunk};
    int changes = 0;
    enum store_status status = change(db,
                                      "INSERT INTO chunks (job, chunk, bytes)"
                                      " SELECT seq, :chunk, :bytes FROM jobs"
                                      " WHERE id = :id AND state = 'running' AND :chunk < chunks"
                                      " ON CONFLICT (job, chunk) DO NOTHING",
                                      what, &changes);

    if (status)
        return status;
    if (changes == 0)
        return why_no_chunk(db, what);
    status = change(db,
                    "UPDATE jobs SET chunks_done = chunks_done + 1"
                    " WHERE id = :id AND state = 'running'",
                    &only_id, &changes);
    assert(status || changes == 1);
    if (status)
        return status;
    return change(db,
                  "DELETE FROM checkpoints"
                  " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND chunk = :chunk",
                  &only_chunk, NULL);
}

enum store_status store_results_put_chunks(struct store *store, const char *id, int64_t chunk,
                                           const struct chunk_new *tallies, int64_t count)
{
    const struct chunk_change first = {.id = id, .chunk = chunk};

    return put_all(store, put_chunk, &first, tallies, count);
}

enum store_status store_results_chunks(struct store *store, const char *id, bool *flags,
                                       int64_t chunks)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT chunk FROM chunks"
                                    " WHERE job = (SELECT seq FROM jobs WHERE id = :id)");
    enum store_status status;

    memset(flags, 0, (size_t)chunks * sizeof *flags);
    stmt_bind_text(&row, ":id", id);
    while (stmt_step(&row)) {
        int64_t chunk = stmt_integer(&row, 0);

        if (chunk >= 0 && chunk < chunks)
            flags[chunk] = true;
    }
    status = stmt_fini(&row);
    store_read_end(store, db);
    return status;
}

enum store_status store_results_load_chunk(struct store *store, const char *id, int64_t chunk,
                                           struct blob *tally)
{
    return load(store,
                "SELECT bytes FROM chunks"
                " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND chunk = :chunk",
                id, chunk, tally);
}

static enum store_status drop_chunk(sqlite3 *db, const char *id, int64_t chunk)
{
    struct chunk_change which = {.id = id, .chunk = chunk}, only_id = {.id = id, .chunk = -1};
    int changes = 0;
    enum store_status status =
        change(db,
               "DELETE FROM chunks"
               " WHERE job = (SELECT seq FROM jobs WHERE id = :id) AND chunk = :chunk",
               &which, &changes);

    if (status || changes == 0)
        return status;
    return change(db, "UPDATE jobs SET chunks_done = chunks_done - 1 WHERE id = :id", &only_id,
                  NULL);
}

enum store_status store_results_drop_chunk(struct store *store, const char *id, int64_t chunk)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, drop_chunk(db, id, chunk));
}

/* ----------------------------------------------------------------------- done */

static enum store_status insert_result(sqlite3 *db, const char *id, const struct result_new *result,
                                       int64_t position)
{
    struct stmt row = stmt_init(db, "INSERT INTO results (job, position, observable, bytes)"
                                    " VALUES ((SELECT seq FROM jobs WHERE id = :id),"
                                    " :position, :observable, :bytes)");

    stmt_bind_text(&row, ":id", id);
    stmt_bind_integer(&row, ":position", position);
    stmt_bind_text(&row, ":observable", result->observable);
    stmt_bind_blob(&row, ":bytes", result->table, result->size);
    return stmt_run(&row, NULL);
}

/* What the job really takes, in the place of what it was expected to. */
static enum store_status set_bytes(sqlite3 *db, const char *id, int64_t bytes)
{
    struct stmt row = stmt_init(db, "UPDATE jobs SET bytes = :bytes WHERE id = :id");

    stmt_bind_text(&row, ":id", id);
    stmt_bind_integer(&row, ":bytes", bytes);
    return stmt_run(&row, NULL);
}

/* The state moves first: whoever comes too late (cancelled meanwhile) writes nothing. */
enum store_status store_results_finish_with(struct store *store, const char *id,
                                            const struct finish_new *finish)
{
    const struct samples_kept *kept = finish->kept;
    int64_t bytes = 0, seq = 0;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN_SHARED(store, &db);

    if (status)
        return status;
    status = store_jobs_move(db, id, JOB_DONE, NULL);
    if (status == STORE_OK && finish->core_seconds > 0)
        status = store_attempts_add_use(db, id, finish->core_seconds);
    if (status == STORE_OK)
        status = store_jobs_seq(db, id, &seq);
    for (size_t i = 0; status == STORE_OK && i < finish->count; i++) {
        const struct result_new *result = &finish->results[i];

        status = insert_result(db, id, result, (int64_t)i);
        if (status == STORE_OK)
            status = store_news_result(db, seq, result->table, result->size);
        bytes += (int64_t)result->size;
    }
    if (status == STORE_OK && kept)
        status = store_samples_add(db, id, kept);
    if (status == STORE_OK && kept)
        status = store_news_outcome(db, seq, kept->outcome);
    for (size_t i = 0; kept && i < kept->count; i++)
        bytes += (int64_t)(kept->samples[i].whole.size + kept->samples[i].rest.size);
    if (status == STORE_OK)
        status = set_bytes(db, id, bytes);
    return store_end(store, status);
}

enum store_status store_results_finish(struct store *store, const char *id,
                                       const struct result_new *results, size_t count)
{
    const struct finish_new finish = {.results = results, .count = count};

    return store_results_finish_with(store, id, &finish);
}

enum store_status store_results_get(struct store *store, const char *id, const char *observable,
                                    struct blob *table)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row =
        stmt_init(db, "SELECT bytes FROM results WHERE job ="
                      " (SELECT seq FROM jobs WHERE id = :id) AND observable = :observable");
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    stmt_bind_text(&row, ":observable", observable);
    status = read_blob(&row, table);
    store_read_end(store, db);
    return status;
}

enum store_status store_results_bytes(struct store *store, const char *id, const char *observable,
                                      int64_t *bytes)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT coalesce(sum(length(bytes)), 0) FROM results"
                                    " WHERE job = (SELECT seq FROM jobs WHERE id = :id)"
                                    " AND (:observable IS NULL OR observable = :observable)");
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    stmt_bind_text(&row, ":observable", observable);
    *bytes = stmt_step(&row) ? stmt_integer(&row, 0) : 0;
    status = stmt_fini(&row);
    store_read_end(store, db);
    return status;
}

enum store_status store_results_names(struct store *store, const char *id, char ***names,
                                      size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT observable FROM results WHERE job ="
                                    " (SELECT seq FROM jobs WHERE id = :id) ORDER BY position");
    char **list = NULL;
    size_t used = 0;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    while (stmt_step(&row)) {
        list = stmt_room(&row, list, used, sizeof *list);
        if (!row.status && (list[used] = stmt_text(&row, 0)))
            used++;
    }
    status = stmt_fini(&row);
    store_read_end(store, db);
    if (status) {
        for (size_t i = 0; i < used; i++)
            free(list[i]);
        free(list);
        return status;
    }
    *names = list;
    *count = used;
    return STORE_OK;
}
