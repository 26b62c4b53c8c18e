/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * coverage.h - does time_step_error tell the truth? Scenes whose exact results are known, run with
 * coarse steps: the share of values with |value - exact| <= time_step_error + 2 standard errors.
 */
#ifndef COVERAGE_H
#define COVERAGE_H

#include <stddef.h>

/* A job without method, time step, time and realizations, which coverage_of fills in. */
struct coverage_scene {
    const char *name, *members;
    double time; /* measured in each realization */
};

struct coverage {
    size_t values, covered;
    size_t resolved;  /* values off by more than 3 standard errors: the step's error shows */
    size_t caught;    /* of these, covered */
};

/* Runs the scene with a method and `factor` times its automatic step, and adds to the counts; a
 * method that refuses the scene adds nothing. `realizations` independent runs. */
void coverage_add(struct coverage *coverage, const struct coverage_scene *scene, const char *method,
                  double factor, int realizations);

#endif
