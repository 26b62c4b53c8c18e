/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * chronological.h - a step of Brownian cluster dynamics, event by event, as first published:
 * Antonov, Schweers, Ryabov, Maass, doi 10.1103/PhysRevE.106.054606.
 *
 * 1. Rods in contact are clusters. A cluster breaks at the contact where the mean force on the rods
 *    to the right exceeds that on the rods to the left most, and so do its parts, until none does
 *    (Eqs. 4-5).
 * 2. All clusters move with the mean velocity of their rods. The two that meet first go on as one;
 *    then the next two, until the step is over (Eqs. 13-19).
 *
 * The published search for the next collision looks at every gap, which makes O(n^2) of n
 * collisions; here gaps play a tournament for it and a collision costs O(log n). What remains
 * O(n^2) at worst is part 1, in a cluster of n rods that breaks off one at a time.
 *
 * The result is that of isotonic.h up to rounding; walls included, for there, too, it is enough to
 * cut off what lies beyond (clusters.h).
 */
#ifndef KERNELS_CHRONOLOGICAL_H
#define KERNELS_CHRONOLOGICAL_H

#include "clusters.h"

/* Workspace, [n] each. */
struct chronological {
    struct cluster *clusters; /* by the first rod */
    int64_t *first_of;        /* first rod of the cluster that ends with rod i */
    double *time;             /* when the contact of rods i and i + 1 closes; INFINITY = not now */
    int64_t *winner;          /* winner[k]: the earlier of the winners of nodes 2 k and 2 k + 1 of
                               * the tournament; node n + i is contact i, node 1 the final */
};

/* y: [n], where the rods are; z: [n], on entry where each would go alone, on return where they
 * go. */
void chronological_step(const struct lane *lane, const double *y, double *z,
                        struct chronological *work);

#endif
