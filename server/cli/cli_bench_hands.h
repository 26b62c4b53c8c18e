/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_bench_hands.h - what a second thread gains where one large ring is all there is (crew.h).
 */
#ifndef CLI_BENCH_HANDS_H
#define CLI_BENCH_HANDS_H

#include "bench_turns.h"
#include "cli_bench_step.h"

struct bench_hands {
    double ns[2];   /* wall clock, of a rod and step, medians: of one thread and of two */
    double speedup; /* median of the turns' */
};

/* The same run by one thread and by two in turns, about three seconds. To be called without other
 * threads, and on no core in particular. */
enum bench_outcome bench_hands_measure(const struct bench_case *which, struct bench_hands *result);

#endif
