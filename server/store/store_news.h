/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_news.h - scalars that jobs get at their end, for the index that they are found by
 * (schema/: job_news). For store*.c only. All within a transaction of the caller's.
 */
#ifndef STORE_NEWS_H
#define STORE_NEWS_H

#include "store_internal.h"
#include "store_scalar.h"

/* Scalars of a table that a job has left become known: results.NAME.COLUMN, and its notes that are
 * numbers. Bytes that are no table have none. */
enum store_status store_news_result(sqlite3 *db, int64_t seq, const void *table, size_t size);

/* Those of its outcome, JSON made by this program: outcome.NAME. */
enum store_status store_news_outcome(sqlite3 *db, int64_t seq, const char *json);

/* Of jobs that ended when these were not kept: at the start after a migration. */
enum store_status store_news_index_old(sqlite3 *db);

/* All news of a path, in order of jobs; texts are the list's. */
struct news {
    int64_t job;
    struct scalar value;
};
struct news_list {
    struct news *items;
    size_t count;
};
enum store_status store_news_load(sqlite3 *db, int64_t key, struct news_list *list);
void store_news_free(struct news_list *list);
/* Those of one segment: the first of them, and how many. */
const struct news *store_news_of(const struct news_list *list, int64_t segment, size_t *count);

/* The value in a column of a row; a text is borrowed until the next step. */
struct scalar store_news_scalar(sqlite3_stmt *row, int column);

#endif
