/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_bench_observables.h - what measuring costs: the sparse scene with one observable at its
 * default sampling, in turns with the same run that measures nothing until its end.
 */
#ifndef CLI_BENCH_OBSERVABLES_H
#define CLI_BENCH_OBSERVABLES_H

#include "bench_turns.h"

/* Name of the index-th observable that is measured; NULL past the last. */
const char *bench_observable_name(size_t index);

/* The bare run first, then the one with the observable: ratio - 1 is the observable's cost. */
enum bench_outcome bench_observable_measure(size_t index, const char *method, int64_t particles,
                                            struct bench_timing *timing);

#endif
