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

/* How long to measure: `turns` (1 .. BENCH_TURNS_MAX) of about turn_ns of the slower piece. */
struct bench_effort {
    double turn_ns;
    int turns;
};
enum { BENCH_TURNS_MAX = 15 };
extern const struct bench_effort bench_usual;   /* 7 turns of 20 ms */
extern const struct bench_effort bench_careful; /* 7 turns of 50 ms */

struct bench_timing {
    double ns[2];        /* of a tick of either, medians */
    double ns_stderr[2]; /* of these medians, from the turns' spread */
    double ratio;        /* the second's over the first's, median of the turns' */
    double ratio_stderr;
};

enum bench_outcome {
    BENCH_DONE,
    BENCH_TOO_SLOW, /* a single tick takes more than BENCH_TICK_NS_MAX; only ns[1] is known */
    BENCH_REFUSED,  /* there is no such scene */
    BENCH_FAILED,
};
#define BENCH_TICK_NS_MAX 4e8

enum bench_outcome bench_turns(const struct bench_work work[2], const struct bench_effort *effort,
                               struct bench_timing *timing);

/* Sorts the values; their median. */
double bench_median(double *values, size_t count);

/* Standard error of the median of the values (which it overwrites), by their absolute deviations
 * from it, so that one turn that was disturbed does not tell. */
double bench_median_stderr(double *values, size_t count);

#endif
