/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * resolve.h - displaced rods back into a legal order, on the ring or between walls: the two
 * resolvers that methods choose from. One lane after another (sim.h), or with all hands.
 */
#ifndef RESOLVE_H
#define RESOLVE_H

#include "sharing.h"
#include "kernels/isotonic.h"
#include "kernels/ring_sort.h"

/* Rods that meet go on together, as in a deterministic flow: the nearest legal order of all.
 * blocks: isotonic_blocks(N). */
static inline void resolve_sticking(const struct sim *sim, double *y, struct isotonic_block *blocks)
{
    const struct plan *plan = sim->plan;
    const int64_t n = plan->particles, whole = arena_whole(n);
    if (sharing(sim)) {
        sharing_stick(sim, y, blocks);
        return;
    }
    for (int64_t lane = 0; lane < sim->lanes; lane++, y += whole)
        if (plan->walls)
            isotonic_walls(y, n, plan->low, plan->low + plan->free_length, blocks);
        else
            isotonic_ring(y, n, plan->free_length, blocks);
}

/* Rods that meet, or meet a wall, are reflected. scratch: [N]. */
static inline void resolve_reflecting(const struct sim *sim, double *y, double *scratch)
{
    const struct plan *plan = sim->plan;
    const int64_t n = plan->particles, whole = arena_whole(n);
    if (sharing(sim)) {
        sharing_reflect(sim, y, scratch);
        return;
    }
    for (int64_t lane = 0; lane < sim->lanes; lane++, y += whole)
        if (plan->walls)
            reflect_walls(y, n, plan->low, plan->low + plan->free_length, scratch);
        else
            ring_sort(y, n, plan->free_length, scratch);
}

#endif
