/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * isotonic.h - isotonic regression on a ring by pooling adjacent violators: the resolver of
 * Brownian cluster dynamics. Fragmentation by mean forces and merging on collision (Antonov et al.,
 * doi 10.1103/PhysRevE.106.054606, Eqs. 4-5 and 13-19; doi 10.1016/j.cpc.2024.109474, Eqs. 4-8 and
 * 18-20) together are the Euclidean projection of the freely displaced rods onto the rings in
 * order.
 */
#ifndef KERNELS_ISOTONIC_H
#define KERNELS_ISOTONIC_H

#include <stddef.h>
#include <stdint.h>

/* A block of rods first .. last that move as one: mean = base + sum / count, sum of z - base. */
struct isotonic_block {
    int64_t first, last;
    double base, sum, mean;
};

/* Workspace for rings of n rods: an array of isotonic_blocks(n) blocks. */
static inline size_t isotonic_blocks(int64_t n)
{
    return (size_t)n / 2 + 1;
}

/* On entry y[i] = freely displaced reduced positions z_i (n >= 1); on return their projection onto
 *     y[0] <= y[1] <= ... <= y[n-1] <= y[0] + ell       (ell >= 0, reduced length of the ring).
 * Rods in contact have bitwise equal y; across the seam y[n-1] == y[0] + ell bitwise. O(n). */
void isotonic_ring(double *y, int64_t n, double ell, struct isotonic_block *blocks);

/* The same between walls, onto low <= y[0] <= ... <= y[n-1] <= high (low <= high): a rod at a wall
 * is bitwise at low or high. O(n). */
void isotonic_walls(double *y, int64_t n, double low, double high, struct isotonic_block *blocks);

#endif
