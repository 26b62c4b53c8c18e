/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_bench_scaling.h - what a second worker gains: a job of many chunks on one worker and on two,
 * in turns. Wall-clock times, so that they tell something only where nobody else uses the cores;
 * how much others did is measured along with them.
 */
#ifndef CLI_BENCH_SCALING_H
#define CLI_BENCH_SCALING_H

#include "bench_turns.h"

struct bench_scaling {
    int64_t particles, realizations, chunks;
    double seconds[2];      /* wall clock with one worker and with two, medians */
    double core_seconds[2]; /* processor time of all workers together, medians */
    double speedup;         /* seconds[0] / seconds[1], median of the turns' */
    double possible;        /* the same if no worker ever waited: 2 core_seconds[0] /
                               core_seconds[1] */
    double others;          /* cores that others kept busy meanwhile; NaN = not to be had */
};

/* Three turns, each about four seconds of a core. FAILED: words are on stderr. */
enum bench_outcome bench_scaling_measure(struct bench_scaling *result);

#endif
