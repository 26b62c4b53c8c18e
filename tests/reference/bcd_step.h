/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd_step.h - what the engine's isotonic step is tested against: slow implementations that share
 * nothing with it, neither code nor idea. Tests only.
 *
 * Both take reduced positions of n rods on a ring of reduced length ell >= 0 (1 <= n <=
 * REFERENCE_RODS_MAX) with y[0] <= ... <= y[n-1] <= y[0] + ell, equal numbers meaning contact, and
 * the displacement every rod would make in the step if it were alone. y is replaced by the
 * positions at the end of the step.
 */
#ifndef REFERENCE_BCD_STEP_H
#define REFERENCE_BCD_STEP_H

enum { REFERENCE_RODS_MAX = 64, REFERENCE_PROJECTION_MAX = 12 };

/* The step as the 2022 paper tells it (doi 10.1103/PhysRevE.106.054606): clusters of rods in
 * contact fragment at the contact with the largest difference of mean forces, again and again (Eqs.
 * 4-5); then the clusters move with their mean velocities, and whenever two of them collide they go
 * on as one with the mean velocity of all its rods (Eqs. 13-19), until the step is over. Real
 * coordinates, long double, all neighbours searched before every event. */
void reference_bcd_step(double *y, const double *displacement, int n, double ell);

/* The step as an optimisation problem: of all rings in order the one nearest to y + displacement
 * (least sum of squares), found by trying all 2^n sets of closed contacts. n <=
 * REFERENCE_PROJECTION_MAX. */
void reference_projection(double *y, const double *displacement, int n, double ell);

#endif
