/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_segment.h - keeps the index that jobs are found by: segments of 1024 jobs and their columns
 * (schema/: job_segments, job_columns, job_news). For store*.c only.
 *
 * Whoever inserts jobs calls store_segment_inserted after each, whoever ends jobs
 * store_segment_settle, both in the same transaction; thousands may be left to store_settle.
 * Forgetting it makes lists slow until the next start, never wrong.
 */
#ifndef STORE_SEGMENT_H
#define STORE_SEGMENT_H

#include "store_column.h"
#include "store_internal.h"
#include "text.h"

/* Job seq was inserted with all that belongs to it. Seals the segment whose last one it is: some
 * microseconds a job, all of them at once every 1024 jobs. */
enum store_status store_segment_inserted(sqlite3 *db, int64_t seq);

/* Jobs between first and last may have ended: news of theirs that have become many move into the
 * columns. */
enum store_status store_segment_settle(sqlite3 *db, int64_t first, int64_t last);

/* Jobs of one segment, in order, were cancelled at once without triggers: what these would have
 * noted. */
enum store_status store_segment_cancelled(sqlite3 *db, const int64_t *seqs, size_t count,
                                          int64_t finished_ms);

/* News of a sealed segment move into its columns: times, results, outcomes. */
enum store_status store_segment_fold(sqlite3 *db, int64_t segment);

/* The number of a path among job_keys, where it is put if it is new. */
enum store_status store_segment_key(sqlite3 *db, const char *path, int64_t *key);

/* Seals whatever is not sealed and could be: after a migration, and where a job was changed. The
 * same one by one; *sealed = false: there was none. */
enum store_status store_segment_seal_all(sqlite3 *db);
enum store_status store_segment_seal_next(sqlite3 *db, bool *sealed);

/* Columns by path, gathered from jobs. */
struct gathered {
    size_t count, room;
    struct gathered_key {
        char path[SCALAR_PATH_SIZE];
        char token[224]; /* the JSON of the value put last, if it is not too long */
        size_t token_length, token_job;
        struct column *column;
    } * key;
    bool closed;                /* only paths that are in it already are looked for */
    size_t next;                /* which key probably comes next */
    struct gathered_text *text; /* what texts are borrowed from */
    struct text scratch;
    bool failed; /* out of memory */
};
bool gathered_add(struct gathered *gathered, const char *path);
void gathered_fini(struct gathered *gathered);

/* Reads the jobs of a segment themselves. states[SEGMENT_JOBS]: first letter of the state, '-'. */
enum store_status store_segment_gather(sqlite3 *db, int64_t segment, struct gathered *gathered,
                                       char states[SEGMENT_JOBS]);

#endif
