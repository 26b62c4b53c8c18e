/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * contact_forces.h - with what force rods in contact push each other while they move as one:
 * doi 10.1103/PhysRevE.106.054606, Eq. 8. The forces that are not shared by the whole cluster add
 * up from its free end.
 */
#ifndef KERNELS_CONTACT_FORCES_H
#define KERNELS_CONTACT_FORCES_H

#include "clusters.h"

/* z: [n], where each rod would go alone in a step; y: [n], where the rods go (equal numbers:
 * contact). force[i], i = 0 .. n-1, becomes `scale` times the push of rod i on rod i + 1 (mod n), 0
 * where they are not in contact; never negative. scale: 1 / (mobility * time step).
 *
 * At a wall the cluster is held and pushes add up from the other end. Without room (all rods in
 * contact all the way round, or from wall to wall) pushes are known up to a constant: the least
 * that makes none of them a pull. */
void contact_forces(const struct lane *lane, const double *z, const double *y, double scale,
                    double *force);

#endif
