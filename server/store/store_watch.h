/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_watch.h - who is told when jobs come or change their state, however many at once and
 * whichever statement did it.
 */
#ifndef STORE_WATCH_H
#define STORE_WATCH_H

#include "store_jobs.h"

enum { JOB_MOVE_SWEEPS = 4 };

/* sweeps: seq of those that the job belonged to at the time (of more than JOB_MOVE_SWEEPS, the
 * first), 0 = no more. A job comes before its sweep does: its first move names none. */
struct job_move {
    int64_t seq;
    char id[JOB_ID_SIZE];
    char owner[OWNER_SIZE];
    enum job_state state;
    int64_t sweeps[JOB_MOVE_SWEEPS];
};

bool job_move_in_sweep(const struct job_move *move, int64_t sweep);

enum { STORE_WATCH_MOVES = 256 }; /* told one by one per transaction */

/* Called after a transaction is on disk, by the thread that wrote, without a lock of the store. The
 * moves in their order; `more` when there were others too many to be told. */
typedef void store_watcher(void *context, const struct job_move *moves, size_t count, bool more);

/* One watcher, from now on; NULL = nobody. Before other threads write, or after. */
enum store_status store_watch(struct store *store, store_watcher *watcher, void *context);

/* A job as it is now, as if it had moved there. */
enum store_status store_watch_job(struct store *store, const char *id, struct job_move *move);

/* A sweep's seq, and how many of its points have jobs of each state. */
enum store_status store_watch_sweep(struct store *store, const char *id, int64_t *seq);
enum store_status store_watch_counts(struct store *store, int64_t sweep,
                                     int64_t counts[JOB_STATES]);

#endif
