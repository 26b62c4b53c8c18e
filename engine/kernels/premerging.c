/* SPDX-License-Identifier: GPL-3.0-or-later
 * premerging.c - see premerging.h. */
#include "premerging.h"

/* Pieces of the present clusters, from the rod `start` on round the ring. Returns how many. */
static int64_t fragment_pairs(const struct lane *lane, const double *y, const double *z,
                              struct cluster *stack, int64_t start)
{
    int64_t count = 0, cluster = 0, i = start; /* cluster: where its first piece is */
    do {
        int64_t before = lane_previous(lane, i);
        if (i == start || !lane_contact(lane, y, before))
            cluster = count;
        stack[count++] = cluster_of_one(y, z, i);
        while (count - 1 > cluster && stack[count - 2].velocity >= stack[count - 1].velocity) {
            cluster_join(lane, &stack[count - 2], &stack[count - 1]);
            count--;
        }
        i = lane_next(lane, i);
    } while (i != start);
    return count;
}

/* Would b, right of a, be met or passed by a within the step? */
static bool collide(const struct lane *lane, const struct cluster *a, const struct cluster *b)
{
    return cluster_at(a, 1) >= cluster_at(b, 1) + cluster_offset(lane, a, b);
}

/* The top of stack[low .. count-1] joins those below as long as they collide. Returns the count. */
static int64_t premerge_top(const struct lane *lane, struct cluster *stack, int64_t low,
                            int64_t count)
{
    while (count - low > 1 && collide(lane, &stack[count - 2], &stack[count - 1])) {
        cluster_join(lane, &stack[count - 2], &stack[count - 1]);
        count--;
    }
    return count;
}

void premerging_step(const struct lane *lane, const double *y, double *z, struct cluster *stack)
{
    int64_t start = lane_start(lane, y);
    if (start < 0) {
        lane_move_rigid(lane, y, z);
        return;
    }
    int64_t pieces = fragment_pairs(lane, y, z, stack, start), count = 0, low = 0;
    for (int64_t k = 0; k < pieces; k++) {
        stack[count++] = stack[k];
        count = premerge_top(lane, stack, 0, count);
    }
    /* The first cluster is the right neighbour of the last. */
    while (!lane->walls && count - low > 1 && collide(lane, &stack[count - 1], &stack[low])) {
        cluster_join(lane, &stack[count - 1], &stack[low]);
        low++;
        count = premerge_top(lane, stack, low, count);
    }
    for (int64_t k = low; k < count; k++)
        cluster_write(lane, &stack[k], z);
    lane_settle(lane, z);
}
