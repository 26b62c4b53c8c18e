/* SPDX-License-Identifier: GPL-3.0-or-later
 * tally.h - a tally from the inside: running means and squares of every value of a scene. */
#ifndef TALLY_H
#define TALLY_H

#include "arena.h"
#include "scene.h"

/* Arrays of `count` values, observable after observable in the scene's order: number of samples
 * (realizations or blocks) that had a value, their mean, the sum of squared deviations. */
struct bcd_tally {
    uint64_t identity;
    size_t count;
    double *samples, *mean, *square;
    double *owned; /* memory to free, or NULL when it lies in an arena */
};

/* Values of all observables of one sample. */
size_t tally_count(const struct bcd_scene *scene);

void tally_layout(struct bcd_tally *tally, const struct bcd_scene *scene, size_t count,
                  struct arena *kept);

/* One more sample: values[tally->count], NaN = none. */
void tally_add(struct bcd_tally *tally, const double *values);

#endif
