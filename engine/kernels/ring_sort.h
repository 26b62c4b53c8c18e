/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * ring_sort.h - elastic collisions of rods with equal diffusion coefficients on a ring: rods that
 * cross swap their roles, so that resolving all collisions is sorting (De Michele's scheme in one
 * dimension, doi 10.1063/1.2719190). As a Brownian step exact in law for any time step when the
 * force is zero or constant.
 */
#ifndef KERNELS_RING_SORT_H
#define KERNELS_RING_SORT_H

#include <stdbool.h>
#include <stdint.h>

/* On entry y[i] = freely displaced reduced positions; on return the positions of the rods after all
 * elastic collisions: y[0] <= ... <= y[n-1] <= y[0] + ell, the same points modulo ell, the sum of y
 * unchanged up to rounding. ell > 0: the points that the line of all y + k ell consists of, sorted,
 * handed back to the labels that keep their rank. ell = 0: one rigid body, the mean.
 * scratch[n]. O(n) for small displacements, O(n log n) for large ones. */
void ring_sort(double *y, int64_t n, double ell, double *scratch);

/* The same between walls: folded at low and high, then sorted. low == high: all rods there. */
void reflect_walls(double *y, int64_t n, double low, double high, double *scratch);

/* ring_sort in parts, for several hands at once, with the same bits: each part is sorted, the parts
 * are joined from the left, and the ring is closed. All with ell > 0.
 *
 * join: rods 0 .. at-1 are sorted, and rods at .. end-1; then all are. Few cross from one part to
 * the other; false, with y a permutation, when they are so many that a sort of all is cheaper. */
void ring_sort_part(double *y, int64_t n, double *scratch);
bool ring_sort_join(double *y, int64_t at, int64_t end);
void ring_sort_close(double *y, int64_t n, double ell, double *scratch);

/* Between walls, low < high: each part is folded first, and there is nothing to close. */
void reflect_part(double *y, int64_t n, double low, double high);

#endif
