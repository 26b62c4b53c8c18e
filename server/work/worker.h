/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker.h - the threads that run chunks: claim, advance in slices, checkpoint, put the tally away;
 * whoever finishes a job's last chunk makes its tables. The clock is read here, never in the
 * engine.
 *
 * THREADS  A worker owns its run alone; it meets the others only in queue.h and store.h, and in
 *          crew.h, where those for whom there is no chunk help with large rings.
 */
#ifndef WORKER_H
#define WORKER_H

#include "queue.h"
#include "store.h"

struct workers;

/* Starts `count` threads (1..LIMIT_WORKERS_MAX), which borrow queue and store until workers_stop.
 * All signals are blocked in them. NULL when the threads cannot be had (the cause is logged). */
struct workers *workers_start(size_t count, struct queue *queue, struct store *store);

/* The same, but chunks are lent to workers elsewhere, each by a thread that waits for it: more are
 * started as chunks are taken, `count` at most. Those that are too large to be lent are run here
 * all the same. */
struct leases;
struct workers *workers_start_lending(size_t count, struct queue *queue, struct store *store,
                                      struct leases *leases);

/* Lets others go first: adds to the threads' nice values. Requests take little, and somebody waits
 * for their answers. Where that is not allowed, all stay equal. */
void workers_step_back(struct workers *workers, int nice);

/* What they have done since the start, and what they are at. Any thread. */
struct workers_counts {
    size_t started, alive, busy; /* threads; busy = with a task */
    size_t most;                 /* that there may be */
    size_t helping;              /* without a task, with another's large ring */
    int64_t chunks;              /* finished */
    double rod_steps, core_seconds;
    int64_t checkpoints;   /* made, */
    double saving_seconds; /* and what that took of the processor */
    int64_t silent_ms; /* the longest that a busy one has not come by its clock */
};
void workers_count(const struct workers *workers, struct workers_counts *counts);

/* Stops the queue for good and waits until every chunk in motion has left a checkpoint behind: a
 * few slices of LIMIT_SLICE_MS. Accepts NULL. */
void workers_stop(struct workers *workers);

#endif
