/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * closed_forms.h - known results in closed form or as one quadrature.
 *
 * UNITS    the user's own. D = mobility * kT is a diffusion coefficient, t a time.
 * ERRORS   plain values are NaN for arguments without meaning: negative times, rho sigma >= 1.
 *          No memory is kept. */
#ifndef THEORY_CLOSED_FORMS_H
#define THEORY_CLOSED_FORMS_H

#include <stddef.h>
#include <stdint.h>

#include "../bcd.h"

/* ------------------------------------- hard rods without potential (Tonks, Phys. Rev. 50, 955) */

/* P = kT rho / (1 - rho sigma). */
double tonks_pressure(double density, double diameter, double kT);
/* Density of neighbouring pairs in contact, rho^2 / (1 - rho sigma). */
double tonks_contact(double density, double diameter);
/* g(r): sum over j of the density of the sum of j independent exponential gaps, over rho. */
double tonks_pair(double density, double diameter, double r);
/* The same on a ring of N rods (gaps are uniform on a simplex), r in one direction. */
double tonks_pair_ring(int64_t particles, double length, double diameter, double r);

/* --------------------------------------- free single file: tagged hard rod, no potential, no drag
 *
 * A tagged rod moves like a tagged point in a gas of points of density n = rho/(1 - rho sigma):
 * rods that cross are relabelled. X > x when, of all points, as many have come to lie right of x as
 * counts say; for the infinite line
 *   MSD = 4 int_0^inf x P(X > x) dx,  P(X > x) = Q P(S >= 0) + (1 - Q) P(S >= 1),
 *   S ~ Skellam(n h(x), n h(-x)),  Q = erfc(x/sqrt(4 D t))/2,  h(x) = int_x^inf Q.
 * On the ring of free length ell = L - N sigma each of the other N - 1 points contributes an
 * integer c with P(c >= k) = [h(x + (k-1) ell) - h(x + k ell)]/ell, the tagged one its own
 * windings: S is their sum, by its characteristic function. Both are exact at all times; relative
 * error of the quadrature below 1e-9. */
double single_file_msd(double density, double diameter, double D, double t);
double single_file_msd_ring(int64_t particles, double length, double diameter, double D, double t);
/* The same under a watch (may be NULL): seconds where rods are many and times long. NaN when it is
 * ended. */
struct single_file {
    int64_t particles;
    double length, diameter, D;
    struct bcd_watch *watch;
};
double single_file_msd_watched(const struct single_file *ring, double t);
/* What it takes, roughly. */
double single_file_msd_ns(const struct single_file *ring, double t);
/* sqrt(4 D t/pi) (1 - rho sigma)/rho. */
double single_file_msd_long(double density, double diameter, double D, double t);
/* 2 D t/N + ell^2 (N - 1)/(6 N^2): the ring once its rods have been all around. */
double single_file_msd_ring_late(int64_t particles, double length, double diameter, double D,
                                 double t);
/* 2 D t - (8/3) sqrt(2/pi) (contact density/rho) (D t)^(3/2): first effect of collisions, from the
 * mean contact density; exact to this order where the force is zero, and so far also its leading
 * effect with a smooth force. */
double single_file_msd_short(double density, double contact, double D, double t);

/* One free rod between walls, its centre within a stretch of this width, from a uniform start:
 * by reflected waves, width^2/6 in the end. Relative error 1e-12. */
double msd_between_walls(double width, double D, double t);

/* ------------------------------------------------------------ one rod in a periodic potential */

struct one_rod {
    double (*energy)(const void *ctx, double x); /* period `period` */
    const void *ctx;
    double period, kT, D, force;
    double energy_ns;        /* what one U(x) costs, roughly */
    struct bcd_watch *watch; /* may be NULL; ends it with BCD_STOPPED */
};

/* Effective diffusion without force (Lifson, Jackson, J. Chem. Phys. 36, 2410):
 * D / (<exp(U/kT)> <exp(-U/kT)>). */
enum bcd_status lifson_jackson(double *diffusion, const struct one_rod *rod,
                               struct bcd_error *error);
/* Drift velocity (Stratonovich) and effective diffusion (Reimann et al., Phys. Rev. Lett. 87,
 * 010602) under a constant force:
 *   I+(x) = <exp([V(x) - V(x-z)]/kT)>_z, I-(x) = <exp([V(x+z) - V(x)]/kT)>_z,
 *   V = U - f x, z in (0, P)
 *   v = (D/P) (1 - exp(-f P/kT)) / <I+>,   D_eff = D <I+^2 I-> / <I+>^3.
 * Refused when the barrier that is left is higher than 600 kT, or the quadrature does not settle to
 * 1e-10. */
enum bcd_status tilted_drift(double *velocity, double *diffusion, const struct one_rod *rod,
                             struct bcd_error *error);

/* Zero noise: x(t) of one rod in U = (U0/2) cos(2 pi x/lambda + phase) with a drag force,
 * dx/dt = mobility (f - U'(x)), exact at all times. */
struct cosine_flow {
    double amplitude, wavelength, phase, mobility, force;
};
double cosine_flow_position(const struct cosine_flow *flow, double start, double t);
/* Its mean velocity: mobility sqrt(f^2 - f_c^2) beyond f_c = pi U0/lambda, else 0. */
double cosine_flow_velocity(const struct cosine_flow *flow);

/* ------------------------------------------------------------------------ two rods, one step */

/* Mean growth of the gap between two free rods from gap d in time t, elastic collision; D is the
 * diffusion coefficient of the gap itself, the sum of both rods'. */
double two_rods_elastic(double gap, double D, double t);
/* The same for one Monte Carlo step of two normal displacements, refused when they overlap. */
double two_rods_rejection(double gap, double D, double t);

#endif
