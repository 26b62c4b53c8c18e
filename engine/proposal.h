/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * proposal.h - the first half of an Euler step: noise and forces write displaced positions, which a
 * method's resolver (kernels/) then turns into a legal order of rods. All methods see the same
 * noise.
 */
#ifndef PROPOSAL_H
#define PROPOSAL_H

#include "noise.h"
#include "sim.h"

struct proposal {
    struct noise noise;
    double *z; /* [N] */
};

void proposal_layout(struct proposal *proposal, const struct plan *plan, struct arena *scratch);

/* out[i] += scale * F_i of potential, interaction and drag at the positions y. */
void proposal_add_forces(const struct sim *sim, const double *y, double scale, double *out);

/* z = y + mu h F(y) + sqrt(2 D h) n of the current tick. Returns z: sim->y itself, displaced in
 * place, when no force needs the old positions. */
double *proposal_euler(struct proposal *proposal, struct sim *sim);

/* The resolved z becomes the rods' positions and the tick is over. */
void proposal_accept(struct sim *sim, const double *z);

#endif
