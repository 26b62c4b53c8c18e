/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * two_sticky_rods.h - exact mean square displacement of each of two rods on a free ring, D = 1,
 * that stick at contact alone.
 *
 * The centre of mass diffuses with D/2; the gap g in [0, ell] is Brownian with 2 D and sticky at
 * both ends: gamma f'' = f' at 0, weight dg + gamma (delta(g) + delta(g - ell)). Only modes odd
 * about the middle, sin k (g - a), a = ell/2, show in g: tan(k a) = 1 / (gamma k). A resistance
 * between gap and bond, of the length l of gap that it is worth, makes that 1 / (gamma k) - l k,
 * and the mode's value in the bond cos(k a) / (gamma k). A walk of steps of deviation s that is
 * caught where it has crossed at the end of a step sees l = -zeta(1/2) / sqrt(2 pi) s = .5826 s.
 */
#ifndef TWO_STICKY_RODS_H
#define TWO_STICKY_RODS_H

double two_sticky_rods_msd(double gamma, double ell, double time, double resistance);

#endif
