/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * ring_sort.h - elastic collisions of rods with equal diffusion coefficients on a ring: rods that
 * cross swap their roles, so that resolving all collisions is sorting (De Michele's scheme in one
 * dimension, doi 10.1063/1.2719190). As a Brownian step exact in law for any time step when the
 * force is zero or constant.
 */
#ifndef KERNELS_RING_SORT_H
#define KERNELS_RING_SORT_H

#include <stdint.h>

/* On entry y[i] = freely displaced reduced positions; on return the positions of the rods after all
 * elastic collisions: y[0] <= ... <= y[n-1] <= y[0] + ell, the same points modulo ell, the sum of y
 * unchanged up to rounding. ell > 0: the points that the line of all y + k ell consists of, sorted,
 * handed back to the labels that keep their rank. ell = 0: one rigid body, the mean.
 * scratch[n]. O(n) for small displacements, O(n log n) for large ones. */
void ring_sort(double *y, int64_t n, double ell, double *scratch);

/* The same between walls: folded at low and high, then sorted. low == high: all rods there. */
void reflect_walls(double *y, int64_t n, double low, double high, double *scratch);

#endif
