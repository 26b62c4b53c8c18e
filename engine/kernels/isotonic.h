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

/* ---------------------------------------------------------------- in pieces
 *
 * The same for several hands at once, and the same bits. A line may be cut where nothing that pools
 * rods on one side ever comes to compare itself with the other side and find it in its way: where
 * the mean of any rods up to there is below that of any from there on, by more than rounding can
 * make of it. The regression of each piece is then what the whole line's does there, operation by
 * operation. */

/* Rods first .. end-1, and the blocks they have pooled into, which count rods from `first`. */
struct isotonic_piece {
    int64_t first, end, count;
    struct isotonic_block *blocks; /* [isotonic_blocks(end - first)] */
};

/* Whether ISOTONIC_WINDOW rods in a row can be cut: before rod `at` of them, 0 = no; then no mean
 * that ends there exceeds level - clear, and none that begins there is below level + clear, of
 * these rods. Where all rods before are below level - clear and all after them above level + clear,
 * that holds for the whole line. */
enum { ISOTONIC_WINDOW = 256 };
struct isotonic_cut {
    int64_t at;
    double level, clear;
};
struct isotonic_cut isotonic_cut(const double *y);

/* How clear a cut must be among n rods that all lie between low and high. */
double isotonic_clearance(int64_t n, double low, double high);

/* One piece, the walls or the seam left out; y[0] is the line's first rod. */
void isotonic_piece(double *y, struct isotonic_piece *piece);

/* What is left to do when all pieces are done: the seam, or the walls. */
void isotonic_close_ring(double *y, double ell, const struct isotonic_piece *pieces, int64_t count);
void isotonic_close_walls(double *y, int64_t n, double low, double high);

#endif
