/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * resolve.h - displaced rods back into a legal order, on the ring or between walls: the two
 * resolvers that methods choose from.
 */
#ifndef RESOLVE_H
#define RESOLVE_H

#include "plan.h"
#include "kernels/isotonic.h"
#include "kernels/ring_sort.h"

/* Rods that meet go on together, as in a deterministic flow: the nearest legal order of all.
 * blocks: isotonic_blocks(N). */
static inline void resolve_sticking(const struct plan *plan, double *y,
                                    struct isotonic_block *blocks)
{
    if (plan->walls)
        isotonic_walls(y, plan->particles, plan->low, plan->low + plan->free_length, blocks);
    else
        isotonic_ring(y, plan->particles, plan->free_length, blocks);
}

/* Rods that meet, or meet a wall, are reflected. scratch: [N]. */
static inline void resolve_reflecting(const struct plan *plan, double *y, double *scratch)
{
    if (plan->walls)
        reflect_walls(y, plan->particles, plan->low, plan->low + plan->free_length, scratch);
    else
        ring_sort(y, plan->particles, plan->free_length, scratch);
}

#endif
