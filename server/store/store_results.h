/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_results.h - what jobs leave behind: checkpoints and tallies on the way, tables at the end.
 * Blobs are the engine's (bcd_run_save, bcd_tally_save, bcd_table_save), kept as they are.
 * See store.h for threads, errors and memory.
 */
#ifndef STORE_RESULTS_H
#define STORE_RESULTS_H

#include "store_jobs.h"

struct blob {
    void *bytes;
    size_t size;
};
void blob_fini(struct blob *blob);

/* What goes in for `count` chunks from `chunk` on, one each, all together or none. */
struct chunk_new {
    const void *bytes;
    size_t size;
};

/* The newest checkpoints of chunks in motion; they replace the ones before. */
enum store_status store_results_checkpoints(struct store *store, const char *id, int64_t chunk,
                                            const struct chunk_new *checkpoints, int64_t count);
static inline enum store_status store_results_checkpoint(struct store *store, const char *id,
                                                         int64_t chunk, const void *bytes,
                                                         size_t size)
{
    return store_results_checkpoints(store, id, chunk, &(struct chunk_new){bytes, size}, 1);
}
enum store_status store_results_load_checkpoint(struct store *store, const char *id, int64_t chunk,
                                                struct blob *checkpoint);

/* Finished chunks: their tallies are kept, their checkpoints dropped, chunks_done raised, in one
 * transaction. Idempotent: the same chunk again changes nothing. */
enum store_status store_results_put_chunks(struct store *store, const char *id, int64_t chunk,
                                           const struct chunk_new *tallies, int64_t count);
static inline enum store_status store_results_put_chunk(struct store *store, const char *id,
                                                        int64_t chunk, const void *tally,
                                                        size_t size)
{
    return store_results_put_chunks(store, id, chunk, &(struct chunk_new){tally, size}, 1);
}

/* Which chunks are finished (flags[chunks], caller's), and one finished chunk's tally. */
enum store_status store_results_chunks(struct store *store, const char *id, bool *flags,
                                       int64_t chunks);
enum store_status store_results_load_chunk(struct store *store, const char *id, int64_t chunk,
                                           struct blob *tally);

/* A finished chunk turned out damaged: it is to be run again. */
enum store_status store_results_drop_chunk(struct store *store, const char *id, int64_t chunk);

/* running -> done: all tables written, chunk tallies and checkpoints dropped, in one transaction.
 * STORE_CONFLICT, and nothing written, when the job is not running (any more). */
struct result_new {
    const char *observable;
    const void *table;
    size_t size;
};
enum store_status store_results_finish(struct store *store, const char *id,
                                       const struct result_new *results, size_t count);

/* The same, with what the job leaves behind beside its tables: its outcome (JSON), and samples
 * (store_samples.h), which replace those that there are. Blobs are borrowed. */
struct sample_new {
    int64_t realizations, chunks;
    struct blob whole, rest;
};
struct samples_kept {
    const unsigned char *family;
    const char *outcome;
    const struct sample_new *samples;
    size_t count;
};
struct finish_new {
    const struct result_new *results;
    size_t count;
    double core_seconds;             /* used that its attempt lacks yet (store_attempts.h) */
    const struct samples_kept *kept; /* NULL = nothing */
};
enum store_status store_results_finish_with(struct store *store, const char *id,
                                            const struct finish_new *finish);

/* One finished table; STORE_NOT_FOUND when the job has no such observable or no results yet. */
enum store_status store_results_get(struct store *store, const char *id, const char *observable,
                                    struct blob *table);

/* How long the tables of a job are, or (observable not NULL) one of them; 0 = there are none. */
enum store_status store_results_bytes(struct store *store, const char *id, const char *observable,
                                      int64_t *bytes);

/* Names of a finished job's observables, in the result's order (malloc'ed strings and array). */
enum store_status store_results_names(struct store *store, const char *id, char ***names,
                                      size_t *count);

#endif
