/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * service.h - what requests are about: the daemon's parts, and a request that met its route.
 */
#ifndef SERVICE_H
#define SERVICE_H

#include "access.h"
#include "feed.h"
#include "http.h"
#include "identity.h"
#include "lease.h"
#include "queue.h"
#include "report_keeper.h"
#include "slurm.h"
#include "store_jobs.h"
#include "store_owners.h"
#include "worker.h"

#include <stdatomic.h>

struct description;
struct aside;
struct metrics;
struct stream_counts;

enum { CALL_ARGS_MAX = 2, CALL_ARG_SIZE = 64 };

/* Where requests that may take seconds are answered (aside.h). */
enum lane {
    LANE_NONE,     /* at once */
    LANE_SWEEPS,   /* that write */
    LANE_DRAWINGS, /* of sweeps, and forecasts: they write nothing */
    LANE_THEORIES,
    LANE_BACKUPS,
    LANE_RESULTS, /* long ones of a job */
    LANES
};

/* What the daemon consists of, as far as requests are concerned. Borrowed. */
struct service {
    struct store *store;
    struct queue *queue;
    struct aside *lane[LANES]; /* NULL = long requests are answered at once, and so is who writes */
    struct access *access;     /* NULL = everybody is OWNER_LOCAL, and may do everything */
    struct feed *feed;
    atomic_flag *backup;                   /* set while one is made or sent; NULL = no limit */
    const struct description *description; /* NULL = made anew each time */
    struct stream_counts *streams;         /* open ones by owner; NULL = not counted */
    struct report_keeper *reports;         /* NULL = there are none */
    struct leases *leases;                 /* NULL = chunks are run here */
    struct slurm *_Atomic slurm;           /* NULL = it starts no workers, or not yet */
    struct workers *workers;               /* NULL = there are none */
    struct metrics *metrics;               /* NULL = nothing is counted */
    _Atomic(struct http *) http;           /* NULL until it is there */
};

/* A request that met its route; arg[i] is what stood in the place of the pattern's i-th {...}. */
struct call {
    const struct request *request;
    struct identity identity; /* who asks */
    const atomic_int *stop;   /* not 0 = nobody waits for the answer any more; NULL = never */
    char arg[CALL_ARGS_MAX][CALL_ARG_SIZE];
};

/* A query parameter, NULL when it was not given. What the route's row says of it holds: a word is
 * one of its words, a number within its range. */
const char *call_query(const struct call *call, const char *name);

#endif
