/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * overlap_sweep.h - overlaps undone at the end of a step (Strating, doi 10.1103/PhysRevE.59.2175):
 * each overlapping pair of neighbours is put where an elastic collision within the step would have
 * taken it, pair after pair along the chain, again and again until no overlap is left. For rods of
 * equal mobility on a line such a collision swaps the two reduced positions (and a wall mirrors
 * one), so that the sweeps are a bubble sort: in whatever order pairs are taken, it ends in the
 * sorted configuration, the one of elastic collisions in order of time (ring_sort.h).
 */
#ifndef KERNELS_OVERLAP_SWEEP_H
#define KERNELS_OVERLAP_SWEEP_H

#include <stdint.h>

/* y[i] = freely displaced reduced positions in, ring_sort's result out up to rounding: y[0] <= ...
 * <= y[n-1] <= y[0] + ell. Always ends: what a bounded number of sweeps leaves, from rods that
 * jumped over many others, is sorted at once. ell = 0: one rigid body, the mean. scratch[n]. */
void sweep_ring(double *y, int64_t n, double ell, double *scratch);

/* The same between walls, as reflect_walls. */
void sweep_walls(double *y, int64_t n, double low, double high, double *scratch);

#endif
