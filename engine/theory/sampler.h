/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sampler.h - exact equilibrium configurations of N rods on the ring; between walls see
 * walls_draw.h.
 *
 * A first rod is drawn from the infinite system's density. To its left a run of bonded rods is
 * drawn from the chain read backwards, up to the first gap that is not a bond; to its right the
 * chain continues, gap after gap, with the infinite system's transition probabilities, up to N
 * rods. The gap that closes the ring is what is left. Products of transition probabilities are, but
 * for factors at the ends, the canonical weight of the configuration; an acceptance step makes up
 * for the factors and for the closing gap:
 *
 *   accept with probability ~ exp(-p g) / (h*(x_l - sigma) phi(x_r)),   g = x_l + L - sigma - x_r
 *
 * (phi, h*: what lies right of a rod, left of an empty place; x_l, x_r: the ends of the chain). So
 * accepted configurations follow the canonical law exactly, whatever p. The interaction f = 1 +
 * bump is read as a mixture: a gap is a bond when it was drawn from the bump. What is not exact:
 * interpolation in tables of 8192 points per period, relative errors of some 1e-10; and places
 * where the density is below 1e-12 of its maximum, which do not count for the bound of the
 * acceptance.
 *
 * About sqrt(N) attempts are needed per draw. Where rods are locked to wells, or at very high
 * density, chains hardly ever close: found out by a trial at creation, at a fixed seed. Such rings
 * are drawn by the recursion instead, exactly too, up to some 4e8 operations a draw (backward.h).
 * Hard rods, Baxter's limit and sticky rods of finite range; other pair energies are refused on the
 * ring.
 *
 * UNITS    the user's own lengths. */
#ifndef THEORY_SAMPLER_H
#define THEORY_SAMPLER_H

#include "theory.h"

#define THEORY_PLACED_NS 400. /* nominal, of one rod placed */

/* Uniform deviates within (0, 1), both ends excluded. */
struct theory_uniforms {
    double (*next)(void *ctx);
    void *ctx;
    struct bcd_watch *watch; /* over the draw; may be NULL */
};

struct theory_sampler;

/* Tables only: immutable, may be shared. Takes up to some seconds, under the system's watch, which
 * it forgets. Refused in words when neither way of drawing works. */
enum bcd_status theory_sampler_create(struct theory_sampler **sampler,
                                      const struct theory_system *system, struct bcd_error *error);
void theory_sampler_free(struct theory_sampler *sampler);

/* Draws reduced coordinates y[0 .. N-1]: rod i sits at x_i = y_i + i sigma; y_0 is within [0, L),
 * y_0 <= y_1 <= ... <= y_{N-1} <= y_0 + ell; bonds of Baxter's limit have bitwise equal y. Rod 0 is
 * any rod, all alike. Between walls sigma/2 <= y_0 <= ... <= y_{N-1} <= sigma/2 + ell.
 * The same uniforms give the same configuration; on machines whose exp and log
 * differ in the last bit, all but once in some 1e6 rods. Refused (BCD_INVALID) when no
 * ring closes within a budget of 2e8 rods placed: y then holds no configuration; nor when the watch
 * of the uniforms stops it. */
enum bcd_status theory_sampler_draw(const struct theory_sampler *sampler, double *y,
                                    const struct theory_uniforms *uniforms,
                                    struct bcd_error *error);

#endif
