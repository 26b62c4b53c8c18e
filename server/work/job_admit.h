/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * job_admit.h - what makes a scene a job that this server takes: its size, its texts, its hash.
 */
#ifndef JOB_ADMIT_H
#define JOB_ADMIT_H

#include "bcd.h"
#include "store_jobs.h"

/* What the operator may set; else as in limits.h. */
struct job_limits {
    double run_bytes; /* of one chunk in motion, or of a theory */
    double overrun_factor, overrun_seconds;
};
struct job_limits job_limits_usual(void);

/* A fault for each limit that the nominal estimate is above. */
void job_admit_check(const struct job_limits *limits, const struct bcd_estimate *estimate,
                     struct bcd_errors *errors);

/* Fills hash, chunks, core_seconds, bytes and the texts job and derived, which are malloc'ed and
 * the caller's, of a completed scene. False = no memory, and nothing to be freed. */
bool job_admit_fill(const struct bcd_scene *scene, const struct bcd_estimate *estimate,
                    struct job_new *job);

#endif
