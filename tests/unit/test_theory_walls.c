/* SPDX-License-Identifier: GPL-3.0-or-later
 * The exact theory between walls against closed forms without a potential and against nested
 * quadrature of one, two and three rods in one. */
#include "theory/theory.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_integration.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static struct theory_result *solve(const struct theory_system *system,
                                   const struct theory_wanted *wanted)
{
    struct theory_result *result = NULL;
    struct bcd_error error = {0};
    if (theory_canonical(&result, system, wanted, &error))
        fail_msg("refused: %s", error.text);
    assert_string_equal(result->route, "walls");
    assert_true(result->error <= 1e-9);
    return result;
}

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.12g instead of %.12g, off by %.2g", value, expected, value - expected);
}

/* --------------------------------------------------------- without potential */

/* Share of a beta-distributed reduced place that falls into a bin of x. */
static double beta_share(const double y[2], double a, double b)
{
    return gsl_cdf_beta_P(fmin(fmax(y[1], 0), 1), a, b) -
           gsl_cdf_beta_P(fmin(fmax(y[0], 0), 1), a, b);
}

/* Rod i of N at y: a beta distribution; so are pairs in contact, with N / ell rods fewer. */
static void check_free_rods(int64_t n, double diameter)
{
    enum { BINS = 40 };
    const double length = 1.3 * (double)n, ell = length - (double)n * diameter, gap = 0.05;
    struct theory_system system = {.walls = true, .particles = n, .length = length,
                                   .diameter = diameter, .temperature = 2};
    struct theory_wanted wanted = {.density_bins = BINS, .contact_bins = BINS, .contact_gap = gap};
    struct theory_result *r = solve(&system, &wanted);
    double width = length / BINS, windows = 0, largest = 0;
    for (int bin = 0; bin < BINS; bin++)
        largest = fmax(largest, r->density[bin]);
    for (int bin = 0; bin < BINS; bin++) {
        double density = 0, contact = 0;
        for (int64_t i = 0; i < n; i++) {
            double first = diameter * ((double)i + 0.5);
            const double y[2] = {(bin * width - first) / ell, ((bin + 1) * width - first) / ell};
            density += beta_share(y, (double)i + 1, (double)(n - i)) / width;
            if (i + 1 < n)
                contact += (double)n / ell * beta_share(y, (double)i + 1, (double)(n - 1 - i)) /
                           width;
        }
        assert_near(r->density[bin], density, 1e-9 * largest);
        assert_near(r->contact[bin], contact, 1e-8 * (double)n / ell);
        windows += r->contact_window[bin] * width;
    }
    assert_near(windows, (double)(n - 1) * (1 - pow(1 - gap / ell, (double)n)) / gap,
                1e-8 * windows);
    assert_true(r->energy == 0 && isnan(r->pressure) && isnan(r->bonded_fraction));
    theory_result_free(r);
}

static void test_free_rods_are_beta_distributed(void **state)
{
    (void)state;
    check_free_rods(1, 0.4);
    check_free_rods(2, 0);
    check_free_rods(5, 0.7);
    check_free_rods(60, 1.2);
    check_free_rods(300, 0.2);
}

/* --------------------------------------------------------- nested quadrature */

struct field {
    double slope, stiffness, centre, amplitude;
};

static double field_energy(const void *ctx, double x)
{
    const struct field *f = ctx;
    return f->slope * x + f->stiffness * (x - f->centre) * (x - f->centre) / 2 +
           f->amplitude * cos(2 * 3.14159265358979323846 * x);
}

struct box {
    const struct theory_system *system;
    double ell;
};

static double weight_of(const struct box *box, int rod, double y)
{
    const struct theory_system *s = box->system;
    double x = s->diameter * (rod + 0.5) + y;
    return exp((s->force * x - s->energy(s->ctx, x)) / s->temperature);
}

enum { POINTS = 64 };

/* Rods before `rod` anywhere left of y, depth at most two: nested fixed rules. */
static double left_of(const struct box *box, const gsl_integration_glfixed_table *rule, int rod,
                      double y)
{
    if (rod == 0)
        return 1;
    double sum = 0;
    for (size_t i = 0; i < POINTS; i++) {
        double s, w, inner = 0;
        gsl_integration_glfixed_point(0, y, i, &s, &w, rule);
        for (size_t k = 0; rod == 2 && k < POINTS; k++) {
            double t, v;
            gsl_integration_glfixed_point(0, s, k, &t, &v, rule);
            inner += v * weight_of(box, 0, t);
        }
        sum += w * weight_of(box, rod - 1, s) * (rod == 2 ? inner : 1);
    }
    return sum;
}

static double right_of(const struct box *box, const gsl_integration_glfixed_table *rule, int rod,
                       double y)
{
    int last = (int)box->system->particles - 1;
    if (rod == last)
        return 1;
    double sum = 0;
    for (size_t i = 0; i < POINTS; i++) {
        double s, w, inner = 0;
        gsl_integration_glfixed_point(y, box->ell, i, &s, &w, rule);
        for (size_t k = 0; rod + 2 == last && k < POINTS; k++) {
            double t, v;
            gsl_integration_glfixed_point(s, box->ell, k, &t, &v, rule);
            inner += v * weight_of(box, last, t);
        }
        sum += w * weight_of(box, rod + 1, s) * (rod + 2 == last ? inner : 1);
    }
    return sum;
}

/* Density and contacts of one rod over one bin of x, energy added to *energy. */
static void add_bin(const struct box *box, const gsl_integration_glfixed_table *rule, int rod,
                    const double x[2], double sums[3])
{
    double first = box->system->diameter * (rod + 0.5);
    double from = fmax(x[0] - first, 0), to = fmin(x[1] - first, box->ell);
    for (size_t i = 0; i < POINTS && to > from; i++) {
        double y, w;
        gsl_integration_glfixed_point(from, to, i, &y, &w, rule);
        double here = w * weight_of(box, rod, y) * left_of(box, rule, rod, y);
        double density = here * right_of(box, rule, rod, y);
        sums[0] += density;
        sums[1] += density * box->system->energy(box->system->ctx, first + y);
        if (rod + 1 < box->system->particles)
            sums[2] += here * weight_of(box, rod + 1, y) * right_of(box, rule, rod + 1, y);
    }
}

static void check_few_rods(const struct theory_system *system)
{
    enum { BINS = 12 };
    struct theory_wanted wanted = {.density_bins = BINS, .contact_bins = BINS};
    struct theory_result *r = solve(system, &wanted);
    const struct box box = {system, system->length - (double)system->particles * system->diameter};
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(POINTS);
    double width = system->length / BINS, bins[BINS][3], norm = 0, energy = 0;
    memset(bins, 0, sizeof bins);
    for (int bin = 0; bin < BINS; bin++) {
        const double x[2] = {bin * width, (bin + 1) * width};
        for (int rod = 0; rod < system->particles; rod++)
            add_bin(&box, rule, rod, x, bins[bin]);
        norm += bins[bin][0] / (double)system->particles;
        energy += bins[bin][1];
    }
    for (int bin = 0; bin < BINS; bin++) {
        assert_near(r->density[bin], bins[bin][0] / norm / width, 2e-9 / width);
        assert_near(r->contact[bin], bins[bin][2] / norm / width, 2e-9 / width / box.ell);
    }
    assert_near(r->energy, energy / norm / (double)system->particles,
                2e-9 * (fabs(r->energy) + system->temperature));
    gsl_integration_glfixed_table_free(rule);
    theory_result_free(r);
}

static void test_few_rods_in_a_field(void **state)
{
    (void)state;
    static const struct field fields[] = {
        {.slope = 3}, {.stiffness = 8, .centre = 1.3}, {.slope = -1, .amplitude = 2}};
    for (int64_t n = 1; n <= 3; n++)
        for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
            struct theory_system system = {.walls = true, .particles = n, .length = 2.9,
                                           .diameter = 0.4, .temperature = 0.8, .period = 1,
                                           .energy = field_energy, .ctx = &fields[i]};
            check_few_rods(&system);
            system.force = 1.7; /* counts in the weight, not in the energy */
            check_few_rods(&system);
        }
}

/* A force alone is gravity: the barometer for one rod, and the same as a linear potential. */
static void test_force_is_a_linear_potential(void **state)
{
    (void)state;
    enum { BINS = 30 };
    struct theory_wanted wanted = {.density_bins = BINS};
    struct theory_system pulled = {.walls = true, .particles = 20, .length = 30, .diameter = 0.9,
                                   .temperature = 1.5, .force = -0.8};
    const struct field gravity = {.slope = 0.8};
    struct theory_system falling = pulled;
    falling.force = 0;
    falling.energy = field_energy;
    falling.ctx = &gravity;
    struct theory_result *a = solve(&pulled, &wanted), *b = solve(&falling, &wanted);
    double heights = 0;
    for (int bin = 0; bin < BINS; bin++) {
        assert_near(a->density[bin], b->density[bin], 1e-8);
        heights += a->density[bin];
    }
    assert_near(heights, 20, 1e-9);
    assert_true(a->energy == 0 && b->energy > 0.8 * 0.45);
    theory_result_free(a);
    theory_result_free(b);
    pulled.particles = 1;
    a = solve(&pulled, &wanted);
    double slope = 0.8 / 1.5, all = exp(-slope * 0.45) - exp(-slope * 29.55);
    for (int bin = 1; bin < 29; bin++)
        assert_near(a->density[bin], (exp(-slope * bin) - exp(-slope * (bin + 1))) / all, 1e-9);
    theory_result_free(a);
}

/* -------------------------------------------------------------------- bonds */

static void test_bonds_of_two_and_three_rods(void **state)
{
    (void)state;
    const double gamma = 0.7, ell = 2.5, eps = 0.3;
    for (int64_t n = 2; n <= 3; n++) {
        struct theory_system system = {.walls = true, .particles = n, .diameter = 0.5,
                                       .length = ell + 0.5 * (double)n, .temperature = 1};
        struct theory_wanted wanted = {.density_bins = 10, .contact_bins = 10,
                                       .contact_gap = eps};
        system.pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = gamma};
        struct theory_result *r = solve(&system, &wanted);
        double open = n == 2 ? ell * ell / 2 : ell * ell * ell / 6;
        double one = n == 2 ? gamma * ell : 2 * gamma * ell * ell / 2;
        double two = n == 2 ? 0 : gamma * gamma * ell;
        assert_near(r->bonded_fraction, (one / (double)(n - 1) + two) / (open + one + two), 1e-9);
        theory_result_free(r);

        /* (1 - g/eps)^q and 1 below eps, times the room that is left for the pair. */
        static const double exponents[] = {0, 1, 2.5, 3};
        for (size_t k = 0; k < 4; k++) {
            double q = exponents[k], c = gamma * (q + 1) / eps;
            system.pair = (struct theory_pair){
                .kind = THEORY_STICKY, .strength = gamma, .range = eps, .exponent = q};
            r = solve(&system, &wanted);
            double windows = 0;
            for (int bin = 0; bin < 10; bin++)
                windows += r->contact_window[bin] * system.length / 10;
            assert_near(windows * eps, r->bonded_fraction * (double)(n - 1), 1e-8);
            if (n == 2) {
                double near = ell * eps - eps * eps / 2 +
                              c * (ell * eps / (q + 1) - eps * eps / ((q + 1) * (q + 2)));
                double far = (ell - eps) * (ell - eps) / 2;
                assert_near(r->bonded_fraction, near / (near + far), 1e-9);
            }
            theory_result_free(r);
        }
    }
}

/* A short range tends to Baxter's limit, in a field and for more rods. */
static void test_short_range_is_baxter(void **state)
{
    (void)state;
    const struct field field = {.amplitude = 1};
    struct theory_system system = {.walls = true, .particles = 6, .diameter = 0.5, .length = 6,
                                   .temperature = 1, .period = 1, .energy = field_energy,
                                   .ctx = &field};
    struct theory_wanted wanted = {.density_bins = 10};
    system.pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = 0.5};
    struct theory_result *limit = solve(&system, &wanted);
    double before = INFINITY;
    for (double range = 0.08; range > 0.015; range /= 2) {
        system.pair = (struct theory_pair){
            .kind = THEORY_STICKY, .strength = 0.5, .range = range, .exponent = 2};
        struct theory_result *r = solve(&system, &wanted);
        double off = fabs(r->bonded_fraction - limit->bonded_fraction);
        assert_true(off < 0.6 * before && off < range);
        before = off;
        theory_result_free(r);
    }
    theory_result_free(limit);
}

/* ------------------------------------------------------------------ refusals */

static void check_refused(const struct theory_system *system, const struct theory_wanted *wanted,
                          const char *word)
{
    struct theory_result *result = NULL;
    struct bcd_error error = {0};
    assert_int_equal(theory_canonical(&result, system, wanted, &error), BCD_INVALID);
    assert_null(result);
    assert_non_null(strstr(error.text, word));
}

static double singular(const void *ctx, double x)
{
    (void)ctx;
    return 1 / (x - 1);
}

static void test_refusals_are_clear(void **state)
{
    (void)state;
    struct theory_system system = {.walls = true, .particles = 4, .length = 4, .diameter = 0.5,
                                   .temperature = 1};
    struct theory_wanted wanted = {.density_bins = 4};
    struct theory_result *result = NULL;
    struct bcd_error error = {0};
    assert_int_equal(theory_infinite(&result, &system, &wanted, &error), BCD_INVALID);
    assert_non_null(strstr(error.text, "between walls there is no infinite system"));
    assert_int_equal(theory_chain(&result, &system, &wanted, &error), BCD_INVALID);
    assert_int_equal(theory_contour(&result, &system, &wanted, &error), BCD_INVALID);
    assert_int_equal(theory_percus(&result, &system, &wanted, &error), BCD_INVALID);
    struct theory_wanted gaps = {.gap_bins = 4, .gap_last = 1};
    check_refused(&system, &gaps, "gap distribution");
    system.particles = 1000000;
    system.length = 1e6;
    check_refused(&system, &wanted, "too long a computation");
    system.particles = 3;
    system.length = 5;
    system.energy = singular;
    system.diameter = 0;
    check_refused(&system, &wanted, ""); /* an abyss at x = 1: whatever words, but refused */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_rods_are_beta_distributed),
        cmocka_unit_test(test_few_rods_in_a_field),
        cmocka_unit_test(test_force_is_a_linear_potential),
        cmocka_unit_test(test_bonds_of_two_and_three_rods),
        cmocka_unit_test(test_short_range_is_baxter),
        cmocka_unit_test(test_refusals_are_clear),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
