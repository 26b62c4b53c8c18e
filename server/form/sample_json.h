/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sample_json.h - a smaller job made of a job: the same physics and numerics, run for less.
 */
#ifndef SAMPLE_JSON_H
#define SAMPLE_JSON_H

#include "bcd.h"

struct sample_size {
    int64_t realizations;
    double time, equilibration_time; /* whole numbers of steps */
    double lag_max;                  /* msd with longer lags is left out; INFINITY = none is */
};

/* A completed scene, not prepared, of another completed one: its method and time step, what it
 * measures but trajectories, no target, no second step. BCD_INVALID where that is no job. */
enum bcd_status sample_json_shrink(const struct bcd_scene *scene, const struct sample_size *size,
                                   struct bcd_scene **sample);

#endif
