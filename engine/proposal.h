/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * proposal.h - the first half of an Euler step: noise and forces displace the rods, which a
 * method's resolver (kernels/) then turns into a legal order of rods. All methods see the same
 * noise.
 */
#ifndef PROPOSAL_H
#define PROPOSAL_H

#include "noise.h"
#include "sim.h"

struct proposal {
    struct noise noise;
    double *old; /* [N], where pairs see the rods; NULL without */
};

void proposal_layout(struct proposal *proposal, const struct sim *sim, struct arena *scratch);

/* out[i] += scale * F_i of potential, interaction and drag at the positions y. out may be y where
 * there is no interaction. */
void proposal_add_forces(const struct sim *sim, const double *y, double scale, double *out);

/* z[i] += scale * normal(tick, i) of the current tick, from `noise` (noise.h). */
void proposal_add_noise(const struct sim *sim, struct noise *noise, const struct noise_key *key,
                        double scale, double *z);

/* y <- y + mu h F(y) + sqrt(2 D h) n of the current tick, y the rods' own. */
void proposal_euler(struct proposal *proposal, struct sim *sim);

#endif
