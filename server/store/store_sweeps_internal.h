/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sweeps_internal.h - what the store_sweep*.c files share, inside a transaction. */
#ifndef STORE_SWEEPS_INTERNAL_H
#define STORE_SWEEPS_INTERNAL_H

#include "store_internal.h"
#include "store_sweeps.h"

#include <stdlib.h>

/* By id, or where that is NULL by seq. */
enum store_status store_sweeps_find(sqlite3 *db, const char *id, int64_t seq,
                                    struct sweep_record *record);

/* By id; STORE_CONFLICT, with the record filled in, when it was cancelled. */
enum store_status store_sweeps_find_alive(sqlite3 *db, const char *id, struct sweep_record *record);

/* A line of the audit log: what was done to so many points. by NULL = none. */
enum store_status store_sweeps_audit(sqlite3 *db, const struct identity *by, const char *action,
                                     const struct sweep_record *sweep, int64_t points);

/* What a job was expected to need. */
enum store_status store_sweeps_costs(sqlite3 *db, int64_t job, struct job_new *costs);

#endif
