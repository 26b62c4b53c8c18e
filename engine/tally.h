/* SPDX-License-Identifier: GPL-3.0-or-later
 * tally.h - a tally from the inside: running means and squares of every value of a scene. */
#ifndef TALLY_H
#define TALLY_H

#include "arena.h"
#include "scene.h"

/* Arrays of `count` values, observable after observable in the scene's order: number of samples
 * (realizations or blocks) that had a value, their mean, the sum of squared deviations. Behind them
 * in the same piece of memory stands one number: how many whole realizations are in them. */
struct bcd_tally {
    uint64_t identity; /* of the family: jobs that differ in the number of realizations alone */
    size_t count;
    double *samples, *mean, *square, *realizations;
    double *owned; /* memory to free, or NULL when it lies in an arena */
};

/* Values of all observables of one sample. */
size_t tally_count(const struct bcd_scene *scene);

void tally_layout(struct bcd_tally *tally, const struct bcd_scene *scene, size_t count,
                  struct arena *kept);

/* One more sample: values[tally->count], NaN = none. */
void tally_add(struct bcd_tally *tally, const double *values);

/* One section (0, or 1: see step_error_sections) of the index-th observable's part. */
struct moments tally_moments(const struct bcd_tally *tally, const struct bcd_scene *scene,
                             size_t index, size_t section);

/* Makes one tally what another of the same family is. */
void tally_copy(struct bcd_tally *to, const struct bcd_tally *from);

#endif
