/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * premerging.h - a step of Brownian cluster dynamics in O(n), with the clusters that will collide
 * joined before anything moves: the idea of Antonov, Schweers, Ryabov, Maass, Comput. Phys. Commun.
 * 309, 109474 (2025), doi 10.1016/j.cpc.2024.109474.
 *
 * From that paper, as its abstract and summaries tell it: clusters fragment by comparing the mean
 * forces of pairs of neighbouring pieces (a contact holds where the left one pushes the right one,
 * else it opens), clusters that would collide within the step are merged beforehand, and then every
 * cluster moves as a whole, once.
 *
 * Ours, for we had no access to its text: the order in which pairs are compared. Pieces and
 * clusters are kept in a stack from left to right; a new one is compared with the top and joins it
 * as long as the pair holds or will collide. A pair that will collide is joined at once in its
 * common centre of mass: the position at the end of the step depends on that alone, not on when
 * they meet. The seam of the ring comes last: only the clusters at both ends of the stack can still
 * collide there, and whatever follows from it.
 *
 * The result is that of isotonic.h up to rounding.
 */
#ifndef KERNELS_PREMERGING_H
#define KERNELS_PREMERGING_H

#include "clusters.h"

/* y: [n], where the rods are; z: [n], on entry where each would go alone, on return where they go.
 * stack: workspace, [n]. */
void premerging_step(const struct lane *lane, const double *y, double *z, struct cluster *stack);

#endif
