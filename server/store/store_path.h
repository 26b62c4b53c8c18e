/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_path.h - what the index holds of one path (schema/: job_keys, job_ends, job_columns,
 * job_news), as a list sees it. For store_find.c only, within one transaction of its own.
 */
#ifndef STORE_PATH_H
#define STORE_PATH_H

#include "store_column.h"
#include "store_column_cache.h"
#include "store_condition.h"
#include "store_internal.h"
#include "store_news.h"

/* Reads columns, if the cache has them not. */
struct column_reader {
    sqlite3 *db;
    struct column_cache *cache;
    struct stmt row; /* its status says what went wrong */
};
struct column_reader column_reader_init(sqlite3 *db, struct column_cache *cache);
enum store_status column_reader_fini(struct column_reader *reader);

/* Of the column in one sealed segment. */
struct path_ends {
    int64_t version;
    struct scalar least, most; /* SCALAR_NONE where that is a text */
    bool there, news;          /* there is a column; some job has news */
};
struct path_index {
    int64_t key;            /* 0 = no job has this scalar */
    struct path_ends *ends; /* of all segments; NULL with key 0 */
    size_t segments;
    struct news_list news;
};
/* Once. Whatever it says, path_index_fini is to be called. */
enum store_status path_index_load(struct path_index *index, sqlite3 *db, const char *path,
                                  size_t segments);
void path_index_fini(struct path_index *index);
enum store_status path_key(sqlite3 *db, const char *path, int64_t *key);

/* Whether a job of a sealed segment may be accepted, as far as the ends say. */
bool path_index_may(const struct path_index *index, const struct test *test, size_t segment);

/* The column of a sealed segment, to be released; NULL = it has none, or see reader->row.status. */
const struct column_kept *path_index_column(const struct path_index *index,
                                            struct column_reader *reader, int64_t segment);

/* Strikes out of wanted the jobs of a sealed segment that the test refuses; false when none is
 * left. */
bool path_index_narrow(const struct path_index *index, struct column_reader *reader,
                       const struct test *test, int64_t segment, bool wanted[SEGMENT_JOBS]);

#endif
