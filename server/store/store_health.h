/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_health.h - how the store is, for /readyz and /metrics.
 */
#ifndef STORE_HEALTH_H
#define STORE_HEALTH_H

#include "store_jobs.h"

#include <stdint.h>

/* Since the start, and as it is. */
struct store_health {
    int64_t commits, rollbacks; /* transactions that changed something or meant to */
    int64_t full, broken;       /* that failed for want of disk; for another fault, fsync's too */
    bool writable;              /* the latest transaction did not fail so */
    int64_t failed_ago_ms;      /* since one did; INT64_MAX = never */
    int64_t database_bytes, log_bytes;     /* files; the second is the write-ahead log */
    int64_t disk_free_bytes, disk_bytes;   /* of the file system, for this user */
};
void store_health(struct store *store, struct store_health *health);

/* Writes something for a trial, unless somebody is writing or has written within `recent_ms`. */
enum store_status store_health_try(struct store *store, int64_t recent_ms);

/* Jobs queued, of the owners with most of them, at most `room`. */
struct owner_queued {
    char owner[OWNER_SIZE];
    int64_t jobs;
    double core_seconds; /* that they, and those that run, are expected to need */
};
enum store_status store_health_queued(struct store *store, struct owner_queued *owners, size_t room,
                                      size_t *count);

#endif
