/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_make.h - the jobs of a sweep, all of them checked before the first is kept.
 *
 * THREADS  Large sweeps are made by two threads, which end before sweep_make returns.
 */
#ifndef SWEEP_MAKE_H
#define SWEEP_MAKE_H

#include "calibration.h"
#include "store_sweeps.h"
#include "sweep_json.h"

/* The new points of a sweep, in order. BCD_INVALID with up to BCD_ERRORS_MAX faults, each naming
 * point, values and field, when any point is no job that this server takes. After
 * LIMIT_SWEEP_FAULTY_MAX points with faults the rest is not looked at. Core seconds are those of
 * this machine, as calibrated. */
struct sweep_made {
    struct sweep_point_new *points;
    size_t count;
};
enum bcd_status sweep_make(const struct sweep *sweep, struct calibration *calibration,
                           struct sweep_made *made, struct bcd_errors *errors);
void sweep_made_fini(struct sweep_made *made);

/* What makes a sweep the same: SHA-256 of owner, pointers and all jobs in order. */
bool sweep_made_hash(const struct sweep *sweep, const struct sweep_made *made, const char *owner,
                     unsigned char hash[JOB_HASH_SIZE]);

#endif
