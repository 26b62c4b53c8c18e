/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd_forms.h - what the three forms of the BCD step share. They differ in how displaced rods are
 * brought back into order, and not in the result but for rounding: one isotonic regression
 * (methods/bcd.c), collisions event by event (bcd_chronological.c), premerging (bcd_premerging.c).
 */
#ifndef BCD_FORMS_H
#define BCD_FORMS_H

#include "part.h"
#include "proposal.h"
#include "kernels/clusters.h"

/* Displaced rods z back into order, in place; y: where they were. */
typedef void bcd_resolver(struct sim *sim, const double *y, double *z);

/* What a form needs beside its resolver: the first member of its work. */
struct bcd_step {
    struct proposal proposal;
    double *start;            /* [N], where the rods were; of forms that ask for it */
    double *ahead, *resolved; /* [N], of runs that ask for contact forces: the next step */
};

void bcd_step_layout(struct bcd_step *step, const struct sim *sim, bool start,
                     struct arena *scratch);

/* L1 error of the density of .005: in the smooth part as measured, at contacts from how much
 * shorter rods seem against the mean gap. */
struct step_limit bcd_time_step(const struct plan *plan);

/* advance and contact_forces of a method with that resolver (part.h). */
void bcd_step_advance(struct sim *sim, struct bcd_step *step, bcd_resolver *resolve, int64_t ticks);
void bcd_step_contact_forces(const struct sim *sim, struct bcd_step *step, bcd_resolver *resolve,
                             double *force);

static inline struct lane bcd_lane(const struct plan *plan)
{
    return (struct lane){plan->particles, plan->free_length, plan->walls, plan->low};
}

#endif
