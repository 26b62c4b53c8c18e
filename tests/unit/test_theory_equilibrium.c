/* SPDX-License-Identifier: GPL-3.0-or-later
 * Exact equilibrium references: limits, direct quadratures, and one route against the other. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "../../engine/theory/closed_forms.h"
#include "../../engine/theory/theory.h"

#define PI 3.14159265358979323846

static double cosine(const void *ctx, double x)
{
    const double *amplitude = ctx;
    return *amplitude / 2 * cos(2 * PI * x);
}

static const double u6 = 6, u20 = 20;

static struct theory_system rods(int64_t n, double length, double diameter, const double *u)
{
    return (struct theory_system){.particles = n,
                                  .length = length,
                                  .diameter = diameter,
                                  .temperature = 1,
                                  .period = 1,
                                  .energy = u ? cosine : NULL,
                                  .ctx = u};
}

static struct theory_pair baxter(double gamma)
{
    return (struct theory_pair){.kind = THEORY_BAXTER, .strength = gamma};
}

static struct theory_pair sticky(double gamma, double range, double exponent)
{
    return (struct theory_pair){
        .kind = THEORY_STICKY, .strength = gamma, .range = range, .exponent = exponent};
}

typedef enum bcd_status (*route)(struct theory_result **, const struct theory_system *,
                                 const struct theory_wanted *, struct bcd_error *);

static struct theory_result *solve(route by, const struct theory_system *system,
                                   const struct theory_wanted *wanted)
{
    struct theory_result *result = NULL;
    struct bcd_error error = {0};
    if (by(&result, system, wanted, &error)) {
        fail_msg("%s", error.text);
    }
    assert_true(result->error < 1e-9);
    return result;
}

static void assert_near(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected))) {
        fail_msg("%.15g instead of %.15g: off by %.2g, allowed %.2g", value, expected,
                 fabs(value / expected - 1), relative);
    }
}

/* Largest difference of two profiles over the largest value of the second. */
static double distance(const double *a, const double *b, size_t count)
{
    double difference = 0, largest = 0;
    for (size_t i = 0; i < count; i++) {
        difference = fmax(difference, fabs(a[i] - b[i]));
        largest = fmax(largest, fabs(b[i]));
        assert_true(isfinite(a[i]) && isfinite(b[i]));
    }
    return difference / largest;
}

static void assert_same(const struct theory_result *a, const struct theory_result *b, double bound)
{
    const struct theory_wanted *w = &a->wanted;
    assert_true(distance(a->density, b->density, w->density_bins) < bound);
    assert_true(distance(a->contact, b->contact, w->contact_bins) < bound);
    if (a->contact_window && b->contact_window) {
        assert_true(distance(a->contact_window, b->contact_window, w->contact_bins) < bound);
    }
    if (w->gap_bins && b->wanted.gap_bins) {
        assert_true(distance(a->gap, b->gap, w->gap_bins) < bound);
    }
    if (w->pair_bins && b->wanted.pair_bins) {
        assert_true(distance(a->pair, b->pair, w->pair_bins) < bound);
    }
    assert_true(fabs(a->energy - b->energy) < bound);
    if (!isnan(a->bonded_fraction) || !isnan(b->bonded_fraction)) {
        assert_true(fabs(a->bonded_fraction - b->bonded_fraction) < bound);
    }
}

static const struct theory_wanted profiles = {.density_bins = 50,
                                              .contact_bins = 50,
                                              .contact_gap = 1e-3,
                                              .gap_bins = 20,
                                              .gap_last = .1};

/* ----------------------------------------------------------- no potential: Tonks */

/* Mean over bin i of a Tonks pair distribution, by Simpson's rule; breaks fall on bin edges here. */
static double tonks_bin(double a, double b, double diameter, int64_t ring_particles, double length)
{
    enum { STEPS = 200 };
    double sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        /* The first point is just inside: g jumps where the bin begins. */
        double r = fmin(fmax(a + (b - a) * i / STEPS, a * (1 + 1e-13)), b * (1 - 1e-13));
        double g = ring_particles
                       ? tonks_pair_ring(ring_particles, length, diameter, r)
                       : tonks_pair(.8, diameter, r);
        sum += g * (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) / (3. * STEPS);
    }
    return sum;
}

static void flat_infinite_is_tonks(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, NULL);
    system.temperature = 2.5;
    struct theory_wanted wanted = profiles;
    wanted.pair_bins = 20;
    wanted.pair_last = 2;
    struct theory_result *r = solve(theory_infinite, &system, &wanted);
    for (size_t i = 0; i < 50; i++) {
        assert_near(r->density[i], .8, 1e-12);
        assert_near(r->contact[i], .64 / .36, 1e-12);
        assert_near(r->contact[i], tonks_contact(.8, .8), 1e-12);
    }
    double p = .8 / .36;
    assert_near(r->contact_window[3], .64 / .36 * -expm1(-p * 1e-3) / (p * 1e-3), 1e-11);
    assert_near(r->pressure, tonks_pressure(.8, .8, 2.5), 1e-12);
    for (size_t i = 0; i < 20; i++) {
        double a = .005 * (double)i, b = a + .005;
        assert_near(r->gap[i], (exp(-p * a) - exp(-p * b)) / .005, 1e-11);
        if (i >= 8) {
            assert_near(r->pair[i], tonks_bin(.1 * (double)i, .1 * ((double)i + 1), .8, 0, 0),
                        1e-9);
        } else {
            assert_true(r->pair[i] < 1e-14);
        }
    }
    theory_result_free(r);
}

static void flat_ring_is_a_simplex(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, NULL);
    struct theory_wanted wanted = profiles;
    wanted.pair_bins = 20;
    wanted.pair_last = 2;
    struct theory_result *r = solve(theory_canonical, &system, &wanted);
    for (size_t i = 0; i < 50; i++) {
        assert_near(r->density[i], .8, 1e-12);
        assert_near(r->contact[i], .8 * 15 / 7.2, 1e-11);
    }
    for (size_t i = 8; i < 20; i++) {
        assert_near(r->pair[i], tonks_bin(.1 * (double)i, .1 * ((double)i + 1), .8, 16, 20), 1e-9);
    }
    for (size_t i = 0; i < 20; i++) {
        double a = 1 - .005 * (double)i / 7.2, b = 1 - .005 * ((double)i + 1) / 7.2;
        assert_near(r->gap[i], (pow(a, 15) - pow(b, 15)) / .005, 1e-10);
    }
    theory_result_free(r);
}

/* Baxter's limit on a ring without potential: k bonds weigh C(N,k) gamma^k ell^(N-k-1)/(N-k-1)!. */
static void bonds_on_a_flat_ring(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, NULL);
    system.pair = baxter(1);
    struct theory_result *r = solve(theory_canonical, &system, &profiles);
    double sum = 0, bonds = 0;
    for (int k = 0; k < 16; k++) {
        double weight = exp(lgamma(17) - lgamma(k + 1) - lgamma(17 - k) + (15 - k) * log(7.2) -
                            lgamma(16 - k));
        sum += weight;
        bonds += k * weight / 16;
    }
    assert_near(r->bonded_fraction, bonds / sum, 1e-11);
    assert_true(fabs(r->bonded_fraction - .50284) < 5e-6); /* physics.md 6 */
    theory_result_free(r);
}

/* --------------------------------------------------------------------- limits */

/* int over [a, b] of f(x) by Simpson with many points. */
static double boltzmann_bin(double amplitude, double a, double b)
{
    enum { STEPS = 400 };
    double sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        double w = exp(-cosine(&amplitude, a + (b - a) * i / STEPS));
        sum += w * (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) / (3. * STEPS);
    }
    return sum;
}

static double boltzmann_energy(double amplitude)
{
    double sum = 0, energy = 0;
    for (int i = 0; i < 1000; i++) {
        double u = cosine(&amplitude, i / 1000.);
        sum += exp(-u);
        energy += u * exp(-u);
    }
    return energy / sum;
}

static void points_and_single_rods_follow_boltzmann(void **state)
{
    (void)state;
    /* One rod; points without interaction, of which any number is a ring; almost points. */
    const struct {
        int64_t n;
        double length, diameter, bound;
        route by;
    } cases[] = {{1, 3, .8, 1e-10, theory_canonical},
                 {30, 40, 0, 1e-9, theory_contour},
                 {5, 4, 0, 1e-9, theory_chain},
                 {30, 40, 0, 1e-9, theory_infinite},
                 {30, 40, 1e-7, 1e-6, theory_canonical}};
    double whole = boltzmann_bin(6, 0, 1);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct theory_system system = rods(cases[c].n, cases[c].length, cases[c].diameter, &u6);
        struct theory_wanted wanted = {.density_bins = 10};
        struct theory_result *r = solve(cases[c].by, &system, &wanted);
        double expected[10], rho = (double)cases[c].n / cases[c].length;
        for (int i = 0; i < 10; i++) {
            expected[i] = rho * boltzmann_bin(6, i / 10., (i + 1) / 10.) / whole;
        }
        assert_true(distance(r->density, expected, 10) < cases[c].bound);
        assert_near(r->energy, boltzmann_energy(6), cases[c].bound);
        theory_result_free(r);
    }
}

static void weak_stickiness_is_none(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, &u6);
    struct theory_wanted wanted = {.density_bins = 50, .contact_bins = 50};
    for (int infinite = 0; infinite < 2; infinite++) {
        route by = infinite ? theory_infinite : theory_canonical;
        system.pair = (struct theory_pair){0};
        struct theory_result *hard = solve(by, &system, &wanted);
        system.pair = baxter(1e-10);
        struct theory_result *weak = solve(by, &system, &wanted);
        assert_true(distance(weak->density, hard->density, 50) < 2e-9);
        assert_true(distance(weak->contact, hard->contact, 50) < 2e-9);
        theory_result_free(hard);
        theory_result_free(weak);
    }
}

/* With the range the profile tends to Baxter's, in proportion to the range. */
static void short_range_tends_to_baxter(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, &u6);
    struct theory_wanted wanted = {.density_bins = 50};
    system.pair = baxter(1);
    struct theory_result *limit = solve(theory_canonical, &system, &wanted);
    double before = 0;
    for (double range = .01; range > .002; range /= 2) {
        system.pair = sticky(1, range, 3);
        struct theory_result *r = solve(theory_canonical, &system, &wanted);
        double now = distance(r->density, limit->density, 50);
        assert_true(now < range); /* .012 in all at .05 (physics.md 6) */
        if (before > 0) {
            assert_near(before / now, 2, .1);
        }
        before = now;
        theory_result_free(r);
    }
    theory_result_free(limit);
}

/* A sticky interaction given as an energy; other units of length and energy. */
static double as_energy(const void *ctx, double r)
{
    (void)ctx;
    double t = 1 - (r - .8) / .05;
    return t > 0 ? -log1p(1 * 4 / .05 * t * t * t) : 0;
}

static double stretched(const void *ctx, double x)
{
    return 3 * cosine(ctx, x / 2);
}

static void same_physics_in_other_words(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, &u6);
    system.pair = sticky(1, .05, 3);
    struct theory_result *a = solve(theory_canonical, &system, &profiles);
    struct theory_system other = system;
    other.pair = (struct theory_pair){.kind = THEORY_ENERGY, .energy = as_energy, .cutoff = .85};
    struct theory_result *b = solve(theory_canonical, &other, &profiles);
    b->bonded_fraction = a->bonded_fraction; /* not defined for an energy */
    assert_same(a, b, 1e-9);
    theory_result_free(b);
    other = (struct theory_system){.particles = 16,
                                   .length = 40,
                                   .diameter = 1.6,
                                   .temperature = 3,
                                   .period = 2,
                                   .energy = stretched,
                                   .ctx = &u6,
                                   .pair = sticky(2, .1, 3)};
    struct theory_wanted wanted = profiles;
    wanted.contact_gap *= 2;
    wanted.gap_last *= 2;
    b = solve(theory_canonical, &other, &wanted);
    for (size_t i = 0; i < 50; i++) {
        b->density[i] *= 2;
        b->contact[i] *= 4;
        b->contact_window[i] *= 4;
        b->gap[i % 20] *= i < 20 ? 2 : 1;
    }
    b->energy /= 3;
    assert_same(a, b, 1e-9);
    theory_result_free(a);
    theory_result_free(b);
}

/* --------------------------------------------------------- direct quadratures */

enum { RULE = 10 };
static const double gauss_x[RULE] = {
    -.9739065285171717, -.8650633666889845, -.6794095682990244, -.4333953941292472,
    -.1488743389816312, .1488743389816312,  .4333953941292472,  .6794095682990244,
    .8650633666889845,  .9739065285171717};
static const double gauss_w[RULE] = {
    .0666713443086881, .1494513491505806, .2190863625159820, .2692667193099964, .2955242247147529,
    .2955242247147529, .2692667193099964, .2190863625159820, .1494513491505806, .0666713443086881};

/* Weight of rods at x and x + r on a ring of length 3, diameter .8: all pairs of x and r. */
static double two_rods_weight(double x, double r, const struct theory_pair *pair)
{
    double f = 1;
    for (int side = 0; side < 2; side++) {
        double gap = (side ? 3 - r : r) - .8;
        if (pair->kind == THEORY_STICKY && gap < pair->range) {
            f *= 1 + pair->strength * (pair->exponent + 1) / pair->range *
                         pow(1 - gap / pair->range, pair->exponent);
        }
    }
    return f * exp(-cosine(&u6, x) - cosine(&u6, x + r));
}

static void two_rods_by_quadrature(void **state)
{
    (void)state;
    const struct theory_pair pairs[] = {{0}, sticky(1, .2, 3)};
    for (int p = 0; p < 2; p++) {
        struct theory_system system = rods(2, 3, .8, &u6);
        system.pair = pairs[p];
        struct theory_wanted wanted = {.density_bins = 5};
        double density[5] = {0}, sum = 0, energy = 0, bonded = 0;
        /* Panels of .05 in r: the bump ends at multiples of it. */
        for (int i = 0; i < 20 * RULE; i++) {
            double x = (i / RULE + .5 + gauss_x[i % RULE] / 2) / 20;
            for (int k = 0; k < 28 * RULE; k++) {
                double r = .8 + (k / RULE + .5 + gauss_x[k % RULE] / 2) * .05;
                double weight = gauss_w[i % RULE] * gauss_w[k % RULE] *
                                two_rods_weight(x, r, &pairs[p]);
                sum += weight;
                density[i / RULE / 4] += weight;
                energy += cosine(&u6, x) * weight;
                bonded += r - .8 < .2 ? weight : 0;
            }
        }
        for (int i = 0; i < 5; i++) {
            density[i] *= 2. / 3 * 5 / sum;
        }
        const route routes[] = {theory_chain, theory_contour};
        for (int by = 0; by < 2; by++) {
            struct theory_result *r = solve(routes[by], &system, &wanted);
            assert_true(distance(r->density, density, 5) < 1e-9);
            assert_near(r->energy, energy / sum, 1e-9);
            if (p == 1) {
                assert_near(r->bonded_fraction, bonded / sum, 1e-9);
            }
            theory_result_free(r);
        }
    }
}

/* Three hard rods on a ring of length 3, diameter .7: gaps on a triangle. */
static void three_rods_by_quadrature(void **state)
{
    (void)state;
    struct theory_system system = rods(3, 3, .7, &u6);
    struct theory_wanted wanted = {.density_bins = 5};
    double density[5] = {0}, sum = 0, energy = 0;
    enum { X = 10, G = 5 };
    for (int i = 0; i < X * RULE; i++) {
        double x = (i / RULE + .5 + gauss_x[i % RULE] / 2) / X;
        for (int k = 0; k < G * RULE; k++) {
            double g = .9 * (k / RULE + .5 + gauss_x[k % RULE] / 2) / G;
            for (int l = 0; l < G * RULE; l++) {
                double left = .9 - g, h = left * (l / RULE + .5 + gauss_x[l % RULE] / 2) / G;
                double weight = gauss_w[i % RULE] * gauss_w[k % RULE] * gauss_w[l % RULE] * left;
                weight *= exp(-cosine(&u6, x) - cosine(&u6, x + .7 + g) -
                              cosine(&u6, x + 1.4 + g + h));
                sum += weight;
                density[i / RULE / 2] += weight;
                energy += weight * cosine(&u6, x);
            }
        }
    }
    for (int i = 0; i < 5; i++) {
        density[i] *= 5 / sum;
    }
    const route routes[] = {theory_chain, theory_contour};
    for (int by = 0; by < 2; by++) {
        struct theory_result *r = solve(routes[by], &system, &wanted);
        assert_true(distance(r->density, density, 5) < 1e-9);
        assert_near(r->energy, energy / sum, 1e-9);
        theory_result_free(r);
    }
}

/* ------------------------------------------------------ one route against the other */

static void contour_and_recursion_agree(void **state)
{
    (void)state;
    struct theory_system systems[] = {rods(16, 20, .8, &u6),   rods(8, 10, .8, &u6),
                                      rods(8, 12, 1.3, &u6),   rods(20, 21, .99, &u6),
                                      rods(10, 20, .5, &u20),  rods(16, 20, .8, &u6),
                                      rods(8, 10, .8, &u6),    rods(40, 50, .8, &u6),
                                      rods(20, 20, .7, &u20),  rods(80, 100, 1e-3, &u6)};
    systems[5].pair = baxter(1);
    systems[6].pair = sticky(1, .05, 2.95);
    systems[7].pair = sticky(10, .05, 4.88);
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        struct theory_result *a = solve(theory_contour, &systems[i], &profiles);
        struct theory_result *b = solve(theory_chain, &systems[i], &profiles);
        assert_string_equal(a->route, "contour");
        assert_string_equal(b->route, "chain");
        assert_same(a, b, 1e-9);
        theory_result_free(a);
        theory_result_free(b);
    }
}

static void percus_and_transfer_operator_agree(void **state)
{
    (void)state;
    struct theory_system systems[] = {rods(80, 100, .8, &u6),  rods(100, 105, .99, &u6),
                                      rods(10, 20, 1.3, &u6),  rods(50, 100, 1e-3, &u6),
                                      rods(80, 100, .8, &u6),  rods(80, 100, .8, &u6),
                                      rods(80, 100, .8, &u6),  rods(10, 20, 1.3, &u6),
                                      rods(90, 100, .7, &u20), rods(16, 20, .8, NULL)};
    const double gamma[] = {0, 0, 0, 0, .01, 1, 10, 5, 0, 1};
    struct theory_wanted wanted = {.density_bins = 50, .contact_bins = 50};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        if (gamma[i] > 0) {
            systems[i].pair = baxter(gamma[i]);
        }
        struct theory_result *a = solve(theory_infinite, &systems[i], &wanted);
        struct theory_result *b = solve(theory_percus, &systems[i], &wanted);
        assert_same(a, b, 1e-9);
        assert_near(a->pressure, b->pressure, 1e-9);
        theory_result_free(a);
        theory_result_free(b);
    }
}

/* ---------------------------------------------------------------- consistency */

/* At L = 100 the ring differs from the infinite system by some per cent in the worst bin; not so for
 * many more rods. */
static void ring_tends_to_the_infinite_system(void **state)
{
    (void)state;
    double worst[3] = {0};
    for (int step = 0; step < 3; step++) {
        int64_t factor = step == 0 ? 1 : step == 1 ? 10 : 1000;
        struct theory_system system = rods(80 * factor, 100. * (double)factor, .8, &u6);
        system.pair = sticky(10, .05, 4.88);
        struct theory_wanted wanted = {.density_bins = 50};
        struct theory_result *a = solve(theory_canonical, &system, &wanted);
        struct theory_result *b = solve(theory_infinite, &system, &wanted);
        for (size_t i = 0; i < 50; i++) {
            worst[step] = fmax(worst[step], fabs(a->density[i] / b->density[i] - 1));
        }
        theory_result_free(a);
        theory_result_free(b);
    }
    print_message("worst bin, ring against infinite: %.3g %.3g %.3g\n", worst[0], worst[1],
                  worst[2]);
    assert_true(worst[0] > .01 && worst[0] < .1); /* physics.md 7: up to 8 % */
    assert_near(worst[0] / worst[1], 10, .2);
    assert_near(worst[1] / worst[2], 100, .02);
}

static void sums_come_out(void **state)
{
    (void)state;
    const route routes[] = {theory_contour, theory_chain, theory_infinite};
    for (int by = 0; by < 3; by++) {
        struct theory_system system = rods(16, 20, .8, &u6);
        system.pair = sticky(1, .05, 3);
        struct theory_wanted wanted = {.density_bins = 37,
                                       .contact_bins = 20,
                                       .contact_gap = .05,
                                       .gap_bins = 100,
                                       .gap_last = by < 2 ? 7.2 : 7};
        struct theory_result *r = solve(routes[by], &system, &wanted);
        double rods_per_period = 0, gaps = 0, bonds = 0, mean_gap = 0;
        for (size_t i = 0; i < 37; i++) {
            rods_per_period += r->density[i] / 37;
        }
        for (size_t i = 0; i < 100; i++) {
            gaps += r->gap[i] * wanted.gap_last / 100;
            mean_gap += r->gap[i] * ((double)i + .5) * pow(wanted.gap_last / 100, 2);
        }
        for (size_t i = 0; i < 20; i++) {
            bonds += r->contact_window[i] * .05 / 20 / .8;
        }
        assert_near(rods_per_period, .8, 1e-12);
        assert_near(gaps, 1, by < 2 ? 1e-9 : 1e-3);
        assert_near(mean_gap, .45, .03); /* bins of .07: as good as that */
        assert_near(bonds, r->bonded_fraction, 1e-9);
        theory_result_free(r);
    }
}

/* A pair distribution over all of the ring counts every other rod once: on half of it, half of them. */
static void pairs_are_counted_once(void **state)
{
    (void)state;
    const struct theory_pair pairs[] = {{0}, sticky(1, .05, 3)};
    for (int p = 0; p < 2; p++) {
        struct theory_system system = rods(12, 16, .8, &u6);
        system.pair = pairs[p];
        struct theory_wanted wanted = {.pair_bins = 50, .pair_last = 8};
        struct theory_result *r = solve(theory_canonical, &system, &wanted);
        double others = 0;
        for (size_t i = 0; i < 50; i++) {
            others += r->pair[i] * .16 * .75;
        }
        assert_near(others, 5.5, 1e-9);
        theory_result_free(r);
    }
}

/* The first bins of the pair distribution are the gap distribution seen otherwise; bonds are counted
 * where they lie. */
static void neighbours_are_pairs(void **state)
{
    (void)state;
    struct theory_system system = rods(30, 40, .8, &u6);
    for (int sticks = 0; sticks < 2; sticks++) {
        system.pair = sticks ? sticky(1, .05, 3) : (struct theory_pair){0};
        for (int infinite = 0; infinite < 2; infinite++) {
            struct theory_wanted wanted = {
                .gap_bins = 16, .gap_last = .8, .pair_bins = 32, .pair_last = 1.6};
            struct theory_result *r =
                solve(infinite ? theory_infinite : theory_canonical, &system, &wanted);
            for (size_t i = 0; i < 16; i++) {
                assert_near(r->pair[16 + i] * .75, r->gap[i], 1e-7);
            }
            theory_result_free(r);
        }
    }
    system.pair = baxter(1);
    struct theory_wanted wanted = {
        .gap_bins = 16, .gap_last = .8, .pair_bins = 32, .pair_last = 1.6};
    struct theory_result *r = solve(theory_infinite, &system, &wanted);
    for (size_t i = 0; i < 16; i++) {
        assert_near(r->pair[16 + i] * .75, r->gap[i], 1e-7);
    }
    assert_true(r->gap[0] * .05 > r->bonded_fraction);
    theory_result_free(r);
}

/* A window changes a contact density by O(Delta'). */
static void window_shrinks_to_contact(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, &u6);
    double before = 0;
    for (double window = 8e-3; window > 1e-3; window /= 2) {
        struct theory_wanted wanted = {.contact_bins = 20, .contact_gap = window};
        struct theory_result *r = solve(theory_canonical, &system, &wanted);
        double now = distance(r->contact_window, r->contact, 20);
        assert_true(now < 10 * window);
        if (before > 0) {
            assert_near(before / now, 2, .05);
        }
        before = now;
        theory_result_free(r);
    }
}

/* --------------------------------------------------------------------- extremes */

static void dense_and_deep_systems(void **state)
{
    (void)state;
    static const double u100 = 100;
    const struct theory_system systems[] = {
        rods(100, 105, .99, &u6), rods(80, 100, .8, &u20),    rods(60, 80, 1.3, &u20),
        rods(50, 100, 1e-3, &u20), rods(40, 100, .5, &u100),  rods(50, 50, .7, &u100),
        rods(1000, 1250, .8, &u6), rods(1000000, 1250000, .8, &u6)};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        struct theory_wanted wanted = {.density_bins = 50};
        struct theory_result *r = solve(theory_canonical, &systems[i], &wanted);
        double sum = 0;
        for (size_t bin = 0; bin < 50; bin++) {
            assert_true(r->density[bin] >= 0);
            sum += r->density[bin] / 50;
        }
        assert_near(sum, (double)systems[i].particles / systems[i].length, 1e-10);
        theory_result_free(r);
    }
}

static void speed(void **state)
{
    (void)state;
    struct theory_system system = rods(80, 100, .8, &u6);
    system.pair = sticky(10, .05, 4.88);
    clock_t start = clock();
    struct theory_wanted wanted = profiles;
    wanted.pair_bins = 50;
    wanted.pair_last = 2;
    struct theory_result *r = solve(theory_canonical, &system, &wanted);
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    print_message("N = 80, L = 100, gamma = 10, range .05: %.2f s, %zu points, error %.1e\n",
                  seconds, r->points, r->error);
    assert_true(seconds < 20);
    theory_result_free(r);
}

static double not_finite(const void *ctx, double x)
{
    (void)ctx;
    return x > .5 ? NAN : 0;
}

static double step(const void *ctx, double x)
{
    (void)ctx;
    return x - floor(x) < .37 ? 0 : 2;
}

static void hopeless_is_refused_in_words(void **state)
{
    (void)state;
    struct theory_system system[13];
    struct theory_wanted wanted[13];
    const route routes[] = {theory_canonical, theory_infinite};
    for (size_t i = 0; i < 13; i++) {
        system[i] = rods(8, 10, .8, &u6);
        wanted[i] = (struct theory_wanted){.density_bins = 10};
    }
    system[0].temperature = 0;
    system[1].diameter = 1.25;
    system[2].diameter = 1.3;
    system[3].length = 10.5;
    system[4].particles = 0;
    system[5].energy = not_finite;
    system[6].energy = step; /* never resolved to 1e-9 */
    system[7].pair = sticky(1, .9, 3);
    system[8].pair = (struct theory_pair){.kind = THEORY_ENERGY, .energy = as_energy, .cutoff = 2};
    system[9].pair = baxter(NAN);
    system[10].temperature = NAN;
    wanted[11].tolerance = 1e-15;
    wanted[12].pair_bins = 10; /* without a last distance */
    for (size_t i = 0; i < 13; i++) {
        for (int by = 0; by < 2; by++) {
            struct theory_result *result = (struct theory_result *)&system;
            struct bcd_error error = {0};
            assert_int_equal(routes[by](&result, &system[i], &wanted[i], &error), BCD_INVALID);
            assert_int_equal(error.code, BCD_INVALID);
            assert_true(strlen(error.text) > 10);
            assert_ptr_equal(result, &system);
            assert_int_equal(routes[by](&result, &system[i], &wanted[i], NULL), BCD_INVALID);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_infinite_is_tonks),
        cmocka_unit_test(flat_ring_is_a_simplex),
        cmocka_unit_test(bonds_on_a_flat_ring),
        cmocka_unit_test(points_and_single_rods_follow_boltzmann),
        cmocka_unit_test(weak_stickiness_is_none),
        cmocka_unit_test(short_range_tends_to_baxter),
        cmocka_unit_test(same_physics_in_other_words),
        cmocka_unit_test(two_rods_by_quadrature),
        cmocka_unit_test(three_rods_by_quadrature),
        cmocka_unit_test(contour_and_recursion_agree),
        cmocka_unit_test(percus_and_transfer_operator_agree),
        cmocka_unit_test(ring_tends_to_the_infinite_system),
        cmocka_unit_test(sums_come_out),
        cmocka_unit_test(pairs_are_counted_once),
        cmocka_unit_test(neighbours_are_pairs),
        cmocka_unit_test(window_shrinks_to_contact),
        cmocka_unit_test(dense_and_deep_systems),
        cmocka_unit_test(speed),
        cmocka_unit_test(hopeless_is_refused_in_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
