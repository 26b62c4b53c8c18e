/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * theory.h - exact equilibrium references for rods on a ring in a periodic potential, or between
 * two walls in any potential.
 *
 * N rods of length sigma on a ring of length L, in an external potential U(x) of which L is a whole
 * number of periods, with any interaction of nearest neighbours:
 *
 *   weight of a configuration = prod_i exp(-U(x_i)/kT) f(g_i),   g_i = x_{i+1} - x_i - sigma >= 0
 *
 * f = 1                                     hard rods
 * f = 1 + gamma delta(g)                    sticky rods in Baxter's limit
 * f = 1 + gamma (q+1)/eps (1 - g/eps)^q     sticky rods of range eps and exponent q, for g < eps
 *                                           ([1] Eq. 32; the integral of f - 1 is gamma)
 * f = exp(-V(sigma + g)/kT)                 any pair energy that ends before 2 sigma
 *
 * [1] Antonov, Schweers, Ryabov, Maass, Phys. Rev. E 106, 054606 (2022),
 * 10.1103/PhysRevE.106.054606.
 *
 * Between walls, 0 and L, centres stay within [sigma/2, L - sigma/2]; a wall is not a neighbour: f
 * acts between the N - 1 pairs of rods alone.
 *
 * Two references are given: the canonical ring of N rods, which is what a simulation samples, and
 * the infinite system at the same mean density. Every answer carries an estimate of its own error,
 * from a computation on a coarser grid; what does not reach the tolerance is refused in words.
 *
 * UNITS    the user's own: lengths, energies. Densities are per unit length.
 * MEMORY   results are owned by the caller and ended with theory_result_free, which accepts NULL.
 * ERRORS   BCD_INVALID: no exact reference, or not to the tolerance; BCD_NO_MEMORY; BCD_STOPPED by
 *          the system's watch. The text says why. Outputs are untouched on failure.
 * THREADS  no globals; every call stands alone.
 */
#ifndef THEORY_H
#define THEORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../bcd.h"

enum theory_pair_kind { THEORY_HARD, THEORY_BAXTER, THEORY_STICKY, THEORY_ENERGY };

struct theory_pair {
    enum theory_pair_kind kind;
    double strength;                                    /* gamma > 0, a length; BAXTER and STICKY */
    double range;                                       /* eps > 0; STICKY */
    double exponent;                                    /* q >= 0; STICKY */
    double (*energy)(const void *ctx, double distance); /* V(r), r between centres; ENERGY */
    const void *ctx;
    double cutoff; /* V = 0 from here on; sigma < cutoff <= 2 sigma; ENERGY */
};

struct theory_system {
    bool walls;         /* not a ring */
    int64_t particles;  /* N >= 1 */
    double length;      /* L > N sigma */
    double diameter;    /* sigma >= 0 */
    double temperature; /* kT > 0 */
    double tolerance;   /* relative error that can be reached, where nothing is wanted; 0: 1e-9 */
    double period;      /* of U; L is a whole number of them; unused without energy. Between walls
                         * any length over which U is smooth: grids start from it */
    double (*energy)(const void *ctx, double x); /* U(x); NULL: none */
    const void *ctx;
    double force; /* on every rod, between walls: the weight is that of U - f x, the energy U's */
    struct theory_pair pair;
    double energy_ns;        /* what one U(x) costs, roughly; 0: as a cosine */
    double curvature;        /* max |U''|, for estimates of costs alone */
    struct bcd_watch *watch; /* borrowed while something is computed; may be NULL */
};

/* What is wanted; a count of 0 leaves a profile out. Bins divide one period (without a potential:
 * the ring) and the stretches [0, last] into equal parts. */
struct theory_wanted {
    size_t density_bins;
    size_t contact_bins;
    double contact_gap; /* window Delta' of a measured contact density; 0: none */
    size_t pair_bins;
    double pair_last; /* largest distance of the pair distribution, at most L/2; L between walls */
    size_t gap_bins;
    double gap_last;  /* largest gap of the gap distribution, at most L - N sigma */
    double tolerance; /* relative error to be reached; 0: the system's */
};

struct theory_result {
    struct theory_wanted wanted; /* sizes of the arrays below */
    /* rho(x), mean over each bin. */
    double *density; /* [density_bins] */
    /* Density of pairs of neighbours at x and x + sigma + 0 ([1] Eq. 23), mean over bins of x. In
     * Baxter's limit this is the part beside the delta function: bonds / gamma. */
    double *contact; /* [contact_bins] */
    /* The same as a window measures it ([1] Eq. 26): pairs of neighbours with 0 <= g < Delta', per
     * Delta'; bonds of Baxter's limit included. NULL without contact_gap. */
    double *contact_window; /* [contact_bins] */
    /* Pair distribution g(r), both rods anywhere: (density of pairs at x and x + r) / rho^2, mean
     * over x and over each bin of r. All pairs of rods, not only neighbours; r is counted in one
     * direction round the ring; tends to 1 - 1/N, to 1 in the infinite system. Bonds of Baxter's
     * limit are delta functions at multiples of sigma: they count in their bin. Between walls:
     * (number of pairs per dr) A^2 / (N^2 (A - r)), A = L - sigma. */
    double *pair; /* [pair_bins] */
    /* Probability density of the gap between neighbours, mean over each bin; bonds included. */
    double *gap;            /* [gap_bins] */
    double energy;          /* mean external energy per rod */
    double pressure;        /* of the infinite system; NaN for the ring: U makes it ambiguous */
    double bonded_fraction; /* of gaps: g = 0 (BAXTER) or g < eps (STICKY); NaN otherwise */
    /* Largest change on the last refinement, all of the above: profiles relative to their largest
     * bin (contact and gap densities: or to 1e-6 of an even spread if that is more), energy
     * relative to |energy| + kT. */
    double error;
    size_t points;     /* grid points per period that were used */
    const char *route; /* "infinite", "contour", "chain", "percus" or "walls"; static text */
};

void theory_result_free(struct theory_result *result);
size_t theory_result_bytes(const struct theory_result *result); /* 0 of NULL */
enum bcd_status theory_result_copy(struct theory_result **copy, const struct theory_result *from);

/* The infinite system at mean density N/L: leading eigenvectors of the transfer operator. */
enum bcd_status theory_infinite(struct theory_result **result, const struct theory_system *system,
                                const struct theory_wanted *wanted, struct bcd_error *error);

/* The N rods themselves: between walls, or on the ring by one of the two routes below. */
enum bcd_status theory_canonical(struct theory_result **result, const struct theory_system *system,
                                 const struct theory_wanted *wanted, struct bcd_error *error);

/* The ring by a contour integral over powers of the transfer operator: for many rods. */
enum bcd_status theory_contour(struct theory_result **result, const struct theory_system *system,
                               const struct theory_wanted *wanted, struct bcd_error *error);

/* The ring by recursion rod by rod: for few rods, and for Baxter's limit. */
enum bcd_status theory_chain(struct theory_result **result, const struct theory_system *system,
                             const struct theory_wanted *wanted, struct bcd_error *error);

/* N rods between walls, by recursion from both of them. Gap distributions are refused. */
enum bcd_status theory_walls(struct theory_result **result, const struct theory_system *system,
                             const struct theory_wanted *wanted, struct bcd_error *error);

/* The infinite system from Percus' functional (HARD) and its extension to sticky rods (BAXTER):
 * an independent second route. Fills density, contact, energy, pressure, bonded_fraction; window,
 * pair and gap distributions are refused. */
enum bcd_status theory_percus(struct theory_result **result, const struct theory_system *system,
                              const struct theory_wanted *wanted, struct bcd_error *error);

#endif
