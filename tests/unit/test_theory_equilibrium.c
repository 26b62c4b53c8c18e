/* SPDX-License-Identifier: GPL-3.0-or-later
 * Equilibrium theory against what is known otherwise: Tonks, limits, direct quadratures. */
#include "unit/theory_bench.h"

/* ----------------------------------------------------------- no potential: Tonks */

/* Mean over bin i of a Tonks pair distribution, by Simpson's rule; breaks fall on bin edges here.
 * */
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
