/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_bench_leave_out.h - whole runs of reduced scenes against loops that were written by hand for
 * just that scene (bcd.h, baseline): what a scene does not have should cost neither time nor
 * memory.
 */
#ifndef CLI_BENCH_LEAVE_OUT_H
#define CLI_BENCH_LEAVE_OUT_H

#include "bench_turns.h"

struct leave_out {
    const char *scene, *method;
    int64_t particles;
    struct bench_timing timing; /* the loop first, then the run */
    double bytes[2];            /* per rod: of the loop, of the run in motion */
};

/* One of them; which: index of bcd_baseline_name. Outcomes as of bench_turns. */
enum bench_outcome leave_out_measure(size_t which, bool strang, int64_t n,
                                     struct leave_out *result);

/* The job of the same scene, malloc'ed; NULL = out of memory. `more`: further members, each after a
 * comma. */
char *leave_out_job(size_t which, bool strang, int64_t n, const char *more);

#endif
