/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_watch.h - who is told when jobs come or change their state, however many at once and
 * whichever statement did it.
 */
#ifndef STORE_WATCH_H
#define STORE_WATCH_H

#include "store_jobs.h"

struct job_move {
    int64_t seq;
    char id[JOB_ID_SIZE];
    char owner[OWNER_SIZE];
    enum job_state state;
};

enum { STORE_WATCH_MOVES = 256 }; /* told one by one per transaction */

/* Called after a transaction is on disk, by the thread that wrote, without a lock of the store. The
 * moves in their order; `more` when there were others too many to be told. */
typedef void store_watcher(void *context, const struct job_move *moves, size_t count, bool more);

/* One watcher, from now on; NULL = nobody. Before other threads write, or after. */
enum store_status store_watch(struct store *store, store_watcher *watcher, void *context);

#endif
