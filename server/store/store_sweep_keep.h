/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_sweep_keep.h - jobs of a sweep become rows, by the hundred. For store_sweeps.c only.
 *
 * From keeper_init to keeper_fini triggers, CHECKs and foreign keys of the connection rest, so
 * nothing else may be written in between.
 */
#ifndef STORE_SWEEP_KEEP_H
#define STORE_SWEEP_KEEP_H

#include "store_incoming.h"

struct keeper {
    sqlite3 *db;
    const struct ticket *ticket; /* borrowed */
    int64_t sweep;
    int64_t last, next;  /* the youngest job that was there before; seq of the next new one */
    int64_t jobs, bytes; /* new ones, and what they are expected to need */
    double seconds;
    int64_t
        text_bytes; /* of the sweep itself: its points; texts of the sweep are added by callers */
    struct stmt find, job, point;
    struct incoming *rows;
};

enum store_status keeper_init(struct keeper *keeper, sqlite3 *db, int64_t sweep,
                              const struct ticket *ticket);

/* Must be called whatever keeper_init said. Returns `status`, or what went wrong before. */
enum store_status keeper_fini(struct keeper *keeper, enum store_status status);

/* Points `first` and on, with the jobs that stand or new ones. */
enum store_status keep_points(struct keeper *keeper, const struct sweep_source *source,
                              int64_t first);

/* The job that stands, or a new one of this sweep. */
enum store_status keep_job(struct keeper *keeper, const struct job_new *job, int64_t *seq);

/* What every insertion ends with, after keeper_fini. STORE_QUOTA: the owner may not have so much as
 * *need then says (may be NULL). */
enum store_status keeper_end(const struct keeper *keeper, struct quota_need *need);

/* So many points make a transaction large (store_large_begin): their jobs' index is left to
 * store_settle. */
enum { KEEP_LARGE = 4096 };

/* Triggers, CHECKs and foreign keys of the writing connection rest; statements come after it. */
void store_rest(sqlite3 *db, bool rest);

#endif
