/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_bench_scaling.h - what a second worker gains: a job of many chunks on one worker, on two, and
 * whole in each of two processes that share nothing but the machine, in turns. What those two gain
 * is what the machine has to give: cores share power, caches and memory. Wall-clock times, so that
 * they tell something only where nobody else uses the cores; how much others did is measured along
 * with them.
 */
#ifndef CLI_BENCH_SCALING_H
#define CLI_BENCH_SCALING_H

#include "bench_turns.h"

enum bench_way { BENCH_ONE, BENCH_TWO, BENCH_APART, BENCH_WAYS };

struct bench_scaling {
    int64_t particles, realizations, chunks;
    double seconds[BENCH_WAYS];      /* wall clock, medians; APART: until both have ended */
    double core_seconds[BENCH_WAYS]; /* processor time of all together, medians */
    double speedup;                  /* seconds ONE / TWO, median of the turns' */
    double machine;                  /* 2 seconds ONE / APART, likewise */
    double share;                    /* speedup / machine, likewise */
    double possible; /* the speedup if no worker ever waited: 2 core_seconds ONE / TWO */
    double others;   /* cores that others kept busy meanwhile; NaN = not to be had */
};

/* Some turns, each about eight seconds of a core. To be called without other threads. FAILED: words
 * are on stderr. */
enum bench_outcome bench_scaling_measure(struct bench_scaling *result);

#endif
