/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_bench_step.h - what a step of one method in one of the four scenes costs: free, sparse
 * (diameter .5, density .5, amplitude 6), dense (.99, 1, 6), sticky (sparse with gamma 1, range
 * .05), timed in turns with the noise and the force alone.
 */
#ifndef CLI_BENCH_STEP_H
#define CLI_BENCH_STEP_H

#include "bench_turns.h"

struct bench_case {
    const char *scene, *method;
    int64_t particles;
    int64_t realizations; /* of a chunk: more than one go side by side in small rings */
};

struct bench_step {
    struct bench_timing timing; /* noise and force, then the step; of all rods together */
    double bytes_per_rod;       /* of the run in motion, its checkpoint included */
    double peak_bytes_per_rod;  /* by which the process really grew; NaN = not to be had */
    int64_t warm_steps;         /* done before the first that counts */
};

/* Name of the index-th scene; NULL past the last. */
const char *bench_scene_name(size_t index);

enum bench_outcome bench_step_measure(const struct bench_case *which,
                                      const struct bench_effort *effort,
                                      struct bench_step *result);

/* ns of one rod's step, the floor's with k = 0. */
static inline double bench_step_ns(const struct bench_case *which, const struct bench_step *step,
                                   int k)
{
    return step->timing.ns[k] / (double)which->particles;
}

/* Members of a job of that scene up to method and time step, begun with "{" and not ended; NULL =
 * there is no such scene, or out of memory. malloc'ed. */
char *bench_scene_members(const struct bench_case *which);

/* A job of it, far longer than any bench, that looks at nothing before its end; NULL = there is no
 * such scene, or the method refuses it. */
struct bcd_scene *bench_step_scene(const struct bench_case *which);

/* Work of bench_turns: a struct bcd_run. */
bool bench_advance_run(void *run, int64_t ticks);

#endif
