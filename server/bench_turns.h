/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bench_turns.h - two pieces of work timed in turns within one process: their ratio holds on a
 * machine whose speed drifts, a time in ns does not. Times are processor time of the thread.
 */
#ifndef BENCH_TURNS_H
#define BENCH_TURNS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Does `ticks` time steps; false = it failed. */
struct bench_work {
    bool (*advance)(void *context, int64_t ticks);
    void *context;
};

struct bench_timing {
    double ns[2]; /* of a tick of either, medians */
    double ratio; /* the second's over the first's, median of the turns' */
};

enum bench_outcome { BENCH_DONE, BENCH_TOO_SLOW, BENCH_FAILED };

/* TOO_SLOW: a single tick takes more than BENCH_TICK_NS_MAX; nothing is known then but
 * timing->ns[1]. */
#define BENCH_TICK_NS_MAX 4e8
enum { BENCH_TURNS = 7 };
enum bench_outcome bench_turns(const struct bench_work work[2], struct bench_timing *timing);

/* Sorts the values; their median. */
double bench_median(double *values, size_t count);

#endif
