/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plan_step.h - the part of a plan that is about the time step: its choice, what it must not
 * exceed, and the second plan with twice the step from which its error is told. Used by plan.c.
 */
#ifndef PLAN_STEP_H
#define PLAN_STEP_H

#include "scene.h"

/* time_step, steps, equilibration_steps; needs the method. */
void plan_time_step(struct bcd_scene *scene, struct bcd_errors *errors);

/* The longest step that neither melts the profile nor silences the interaction nor jumps. */
double plan_longest_step(const struct plan *plan);

/* The longest step that resolves what an observable asks. */
double plan_step_resolving(const struct bcd_scene *scene, const struct observable_type *type,
                           const void *par);

/* Time steps of that many realizations, pairs included, times the number of rods. */
double plan_rod_steps(const struct bcd_scene *scene, int64_t realizations);

/* paired, fine, and scene->coarse; needs all else. */
void plan_pairs(struct bcd_scene *scene);

#endif
