/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * metrics.h - what is counted of requests, for GET /metrics. Counted with atomics by the threads of
 * http.c; a page is printed from whatever they are at the moment.
 */
#ifndef METRICS_H
#define METRICS_H

#include "http.h"

#include <stdatomic.h>

enum {
    METRICS_ROUTES_MAX = 128, /* the last stands for paths that met no route */
    METRICS_CLASSES = 6,      /* 1xx..5xx at their first digit */
    METRICS_BUCKETS = 13,
};

struct metrics {
    int64_t started_s; /* seconds since 1970; before the first request */
    atomic_uint_least64_t requests[METRICS_ROUTES_MAX][METRICS_CLASSES];
    atomic_uint_least64_t latency[METRICS_BUCKETS + 1]; /* the last has no upper bound */
    atomic_uint_least64_t latency_us, bytes, cut;
};

/* A request is over. */
void metrics_observe(struct metrics *metrics, const struct http_done *done);

#endif
