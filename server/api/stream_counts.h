/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * stream_counts.h - how many event streams each owner has open: nobody takes all there may be.
 *
 * THREADS  Any thread.
 */
#ifndef STREAM_COUNTS_H
#define STREAM_COUNTS_H

#include "identity.h"
#include "limits.h"

#include <pthread.h>

struct stream_counts {
    pthread_mutex_t mutex;
    size_t used;
    struct {
        char owner[OWNER_SIZE];
        size_t open;
    } of[LIMIT_STREAMS_MAX]; /* those who have any */
};
#define STREAM_COUNTS_INIT                                                                         \
    {                                                                                              \
        .mutex = PTHREAD_MUTEX_INITIALIZER                                                         \
    }

/* One more; false = the owner has LIMIT_OWNER_STREAMS_MAX, or all together LIMIT_STREAMS_MAX
 * owners have one. */
bool stream_counts_take(struct stream_counts *counts, const char *owner);
/* One less. */
void stream_counts_give(struct stream_counts *counts, const char *owner);

#endif
