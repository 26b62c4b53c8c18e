/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_faults.h - whether the points of a sweep are jobs that this server takes, and what is wrong
 * with those that are not.
 *
 * THREADS  Large sweeps are looked at by two threads, which end before sweep_faults returns.
 */
#ifndef SWEEP_FAULTS_H
#define SWEEP_FAULTS_H

#include "job_admit.h"
#include "sweep_json.h"

/* Where it is looked, and by what limits. */
struct sweep_look {
    struct sweep_walk *walk;
    struct bcd_scene_cache *cache;
    const struct job_limits *limits;
};

/* The job where the walk is: its scene, the caller's, and what it will need, uncalibrated. */
enum bcd_status sweep_faults_point(const struct sweep_look *look, struct bcd_scene **scene,
                                   struct bcd_estimate *estimate, struct bcd_errors *faults);

/* All new points from number `first` on. BCD_INVALID with up to BCD_ERRORS_MAX faults in order of
 * points, each naming point, values and field. After LIMIT_SWEEP_FAULTY_MAX points with faults the
 * rest is not looked at. */
enum bcd_status sweep_faults(const struct sweep *sweep, const struct job_limits *limits,
                             size_t first, struct bcd_errors *errors);

#endif
