/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * feed.h - what happens to jobs, for those who listen: the latest changes of states, numbered from
 * the server's start, and how far the jobs in motion are. Nothing is sampled while nobody asks.
 *
 * THREADS  One mutex inside. Any thread may call anything.
 */
#ifndef FEED_H
#define FEED_H

#include "queue.h"
#include "store_watch.h"

struct feed;

/* Watches the store (its only watcher) from here on, until feed_free, which nobody may be writing
 * at. queue may be NULL: then no job is in motion. */
enum store_status feed_create(struct feed **feed, struct store *store, struct queue *queue);
void feed_free(struct feed *feed);

/* `wake` is called after each change, by whatever thread made it; NULL = nobody. It must not call
 * the feed. Once this returns, the one before is not called any more. */
void feed_wake(struct feed *feed, void (*wake)(void *context), void *context);

/* A number that other starts of the server do not have, with the numbers of changes. */
uint64_t feed_start(const struct feed *feed);

/* The number of the newest change; they count from 1. */
uint64_t feed_now(struct feed *feed);

/* Whether the job's state has changed, or may have, after change number *since; if not, *since is
 * moved on to the newest. */
bool feed_moved(struct feed *feed, uint64_t *since, int64_t seq);

/* As *since: a number that nobody knows any more; feed_read then says lost. */
#define FEED_UNKNOWN UINT64_MAX

/* The changes after number *since, at most `room`, and *since moves on with them. *lost: some are
 * not known any more, or were too many to be noted. */
size_t feed_read(struct feed *feed, uint64_t *since, struct job_move *moves, size_t room,
                 bool *lost);

/* The jobs in motion, at most `room`; looked at LIMIT_FEED_SAMPLE_MS ago at the most. */
struct feed_progress {
    struct job_move job;
    double progress;
};
size_t feed_progress(struct feed *feed, struct feed_progress *jobs, size_t room);

#endif
