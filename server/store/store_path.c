/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_path.c - see store_path.h. */
#include "store_path.h"

#include <stdlib.h>
#include <string.h>

struct column_reader column_reader_init(sqlite3 *db, struct column_cache *cache)
{
    return (struct column_reader){
        .db = db,
        .cache = cache,
        .row = stmt_init(db, "SELECT bytes FROM job_columns WHERE id = :id")};
}

enum store_status column_reader_fini(struct column_reader *reader)
{
    return stmt_fini(&reader->row);
}

/* ------------------------------------------------------------------ loading */

enum store_status path_key(sqlite3 *db, const char *path, int64_t *key)
{
    struct stmt row = stmt_init(db, "SELECT id FROM job_keys WHERE path = :path");

    stmt_bind_text(&row, ":path", path);
    if (stmt_step(&row))
        *key = stmt_integer(&row, 0);
    return stmt_fini(&row);
}

/* One pass over the ends of all segments costs less than looking them up one by one. */
static enum store_status load_ends(struct path_index *index, sqlite3 *db)
{
    struct stmt row = stmt_init(db, "SELECT id & 0xffffffff, version, least, most FROM job_ends"
                                    " WHERE id BETWEEN :key << 32 AND (:key << 32) + 0xffffffff");

    stmt_bind_integer(&row, ":key", index->key);
    while (stmt_step(&row)) {
        size_t segment = (size_t)stmt_integer(&row, 0);

        if (segment < index->segments)
            index->ends[segment] = (struct path_ends){.version = stmt_integer(&row, 1),
                                                      .least = store_news_scalar(row.handle, 2),
                                                      .most = store_news_scalar(row.handle, 3),
                                                      .there = true};
    }
    return stmt_fini(&row);
}

enum store_status path_index_load(struct path_index *index, sqlite3 *db, const char *path,
                                  size_t segments)
{
    enum store_status status = path_key(db, path, &index->key);

    if (status || index->key == 0)
        return status;
    index->ends = calloc(segments + 1, sizeof *index->ends);
    if (!index->ends)
        return store_fault(db, SQLITE_NOMEM, "find jobs");
    index->segments = segments;
    status = load_ends(index, db);
    if (status == STORE_OK)
        status = store_news_load(db, index->key, &index->news);
    for (size_t i = 0; i < index->news.count; i++) {
        size_t segment = (size_t)(index->news.items[i].job >> SEGMENT_BITS);

        if (segment < segments)
            index->ends[segment].news = true;
    }
    return status;
}

void path_index_fini(struct path_index *index)
{
    store_news_free(&index->news);
    free(index->ends);
    index->ends = NULL;
}

/* ------------------------------------------------------------------ columns */

bool path_index_may(const struct path_index *index, const struct test *test, size_t segment)
{
    const struct path_ends *ends = index->ends ? &index->ends[segment] : NULL;

    if (test->relation == FIND_OTHER)
        return true;
    return ends &&
           (ends->news || (ends->there && test_may_accept(test, &ends->least, &ends->most)));
}

const struct column_kept *path_index_column(const struct path_index *index,
                                            struct column_reader *reader, int64_t segment)
{
    int64_t id = index->key << 32 | segment, version;
    const struct column_kept *kept;
    struct stmt *row = &reader->row;

    if (!index->ends || !index->ends[segment].there || row->status)
        return NULL;
    version = index->ends[segment].version;
    kept = column_cache_find(reader->cache, id, version);
    if (kept)
        return kept;
    stmt_again(row);
    stmt_bind_integer(row, ":id", id);
    if (!stmt_step(row)) {
        row->status = row->status ? row->status : store_fault(row->db, SQLITE_CORRUPT, row->sql);
        return NULL;
    }
    kept = column_cache_keep(reader->cache, id, version, sqlite3_column_blob(row->handle, 0),
                             (size_t)sqlite3_column_bytes(row->handle, 0));
    if (!kept)
        row->status = store_fault(row->db, SQLITE_NOMEM, row->sql);
    return kept;
}

static int place(const void *test, const struct scalar *value)
{
    return test_place(test, value);
}

/* News prevail over what stands in the column. */
bool path_index_narrow(const struct path_index *index, struct column_reader *reader,
                       const struct test *test, int64_t segment, bool wanted[SEGMENT_JOBS])
{
    bool other = test->relation == FIND_OTHER, before[SEGMENT_JOBS];
    const struct column_filter filter = {place, test, .negate = other, .none = other};
    const struct column_kept *column = NULL;
    const struct path_ends *ends = index->ends ? &index->ends[segment] : NULL;
    const struct news *news;
    size_t count = 0;

    if (ends && ends->there && test_may_accept(test, &ends->least, &ends->most))
        column = path_index_column(index, reader, segment);
    if (ends && ends->news)
        memcpy(before, wanted, sizeof before);
    if (!column && !other)
        memset(wanted, false, SEGMENT_JOBS * sizeof wanted[0]);
    else if (column && !column_narrow(column->bytes, column->size, &filter, wanted))
        reader->row.status = store_fault(reader->db, SQLITE_CORRUPT, "decode a column");
    column_cache_release(column);
    news = ends && ends->news ? store_news_of(&index->news, segment, &count) : NULL;
    for (size_t i = 0; i < count; i++) {
        size_t job = (size_t)news[i].job % SEGMENT_JOBS;

        wanted[job] = before[job] && test_accepts(test, &news[i].value);
    }
    return memchr(wanted, true, SEGMENT_JOBS) != NULL;
}
