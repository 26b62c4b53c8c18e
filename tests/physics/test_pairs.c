/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pair interactions in motion: equilibrium against exact theory and against quadratures done here,
 * at given and at automatic time steps; the order of rods that repel each other strongly. */
#include "support/experiment.h"
#include "equilibrium.h"
#include "scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define FIELD "'potential': {'type': 'cosine', 'amplitude': 3}, "

/* Each row within so many standard errors and what the run itself says about its time step. */
static void assert_rows(const struct bcd_table *t, const double *exact, double sigmas)
{
    const double *value = column_of(t, BCD_ROLE_VALUE), *error = column_of(t, BCD_ROLE_STDERR),
                 *step = column_of(t, BCD_ROLE_TIME_STEP_ERROR);
    for (size_t i = 0; i < t->rows; i++)
        assert_within(value[i], exact[i], error[i], sigmas, step[i]);
}

static void check_table(const struct experiment *e, const char *observable, double sigmas)
{
    struct bcd_table *t = experiment_table(e, observable);
    assert_rows(t, column_of(t, BCD_ROLE_THEORY), sigmas);
    bcd_table_free(t);
}

/* --------------------------------------------------- against exact theory */

/* Rods whose interaction ends before second neighbours, in a field. */
static void check_field(const char *interaction)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 8, 'length': 10, 'diameter': 0.5, " FIELD "'interaction': "
                         "%s, 'method': 'strang', 'time_step': 1e-3, 'equilibration_time': 1, "
                         "'time': 10, 'realizations': 32, 'observables': {'energy': {}, 'density': "
                         "{'bins': 10}}}",
                         interaction),
        0);
    check_table(&e, "energy", 5);
    check_table(&e, "density", 5);
    experiment_end(&e);
}

static void test_profiles_in_a_field(void **state)
{
    (void)state;
    check_field("{'type': 'yukawa', 'strength': 3, 'screening': 1, 'cutoff': 1}");
    check_field("{'type': 'yukawa', 'strength': -2, 'screening': 2, 'cutoff': 0.9}");
    check_field("{'type': 'power', 'strength': -0.02, 'exponent': 6, 'cutoff': 1}");
    check_field("{'type': 'table', 'first': 0.5, 'last': 1, 'values': [2, 1.9, 1, 0.3, 0]}");
    check_field("{'type': 'expression', 'energy': '8*(1-r)^2', 'cutoff': 1}");
}

/* The interaction decides about these profiles: without it they are far from what is measured. */
static void test_the_interaction_is_seen(void **state)
{
    (void)state;
    struct bcd_scene *with = experiment_scene(
        "{'particles': 8, 'length': 10, 'diameter': 0.5, " FIELD "'interaction': {'type': 'yukawa',"
        " 'strength': 3, 'screening': 1, 'cutoff': 1}, 'time': 1, 'observables': {'energy': {}}}");
    struct theory_system system = equilibrium_system(&with->plan);
    struct theory_wanted wanted = {0};
    struct theory_result *on = NULL, *off = NULL;
    assert_int_equal(theory_canonical(&on, &system, &wanted, NULL), BCD_OK);
    system.pair = (struct theory_pair){.kind = THEORY_HARD};
    assert_int_equal(theory_canonical(&off, &system, &wanted, NULL), BCD_OK);
    assert_true(fabs(on->energy - off->energy) > 0.05);
    theory_result_free(on), theory_result_free(off);
    bcd_scene_free(with);
}

/* The pair distribution, whose theory reaches but a tolerance of 1e-5 in a short time. */
static void check_pairs(const char *interaction)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 4, 'length': 5, 'diameter': 0.6, 'interaction': %s, "
                         "'method': 'strang', 'time_step': 5e-4, 'equilibration_time': 1, 'time': "
                         "20, 'realizations': 32, 'observables': {'pair_distribution': {'bins': 8,"
                         " 'last': 2}}}",
                         interaction),
        0);
    struct theory_system system = equilibrium_system(&e.scene->plan);
    struct theory_wanted wanted = {.pair_bins = 8, .pair_last = 2, .tolerance = 1e-5};
    struct theory_result *exact = NULL;
    assert_int_equal(theory_canonical(&exact, &system, &wanted, NULL), BCD_OK);
    struct bcd_table *t = experiment_table(&e, "pair_distribution");
    assert_rows(t, exact->pair, 5);
    bcd_table_free(t);
    theory_result_free(exact);
    experiment_end(&e);
}

static void test_pair_distributions(void **state)
{
    (void)state;
    check_pairs("{'type': 'yukawa', 'strength': 3, 'screening': 1, 'cutoff': 1.2}");
    check_pairs("{'type': 'yukawa', 'strength': -1.5, 'screening': 1, 'cutoff': 1.2}");
}

static void test_theory_beyond_neighbours_is_refused(void **state)
{
    (void)state;
    struct bcd_scene *scene = experiment_scene(
        "{'particles': 8, 'length': 10, 'diameter': 0.5, 'interaction': {'type': 'yukawa', "
        "'strength': 3, 'screening': 1, 'cutoff': 1.01}, 'time': 1, 'observables': {'density': "
        "{}}}");
    struct bcd_theory *theory = NULL;
    struct bcd_table *t = NULL;
    assert_int_equal(bcd_theory_create(&theory, scene, BCD_THEORY_RING, NULL, NULL), BCD_OK);
    assert_int_equal(bcd_theory_table(theory, scene, 0, &t), BCD_OK);
    const struct bcd_column *column = bcd_table_column(t, BCD_ROLE_THEORY);
    assert_null(column->values);
    assert_non_null(strstr(column->reason, "beyond nearest neighbours"));
    bcd_table_free(t);
    bcd_theory_free(theory);
    bcd_scene_free(scene);
}

/* ------------------------------------------------- against quadratures done here */

enum { BINS = 10, PER_BIN = 40, POINTS = BINS * PER_BIN };

/* Three points on a ring of length L, V shifted at L/2 and acting between all three: Boltzmann
 * weights of two gaps on a grid of midpoints. g of pairs, counted in one direction up to L/2. */
static void three_points(double (*energy)(double r), double length, double *g)
{
    double cell = length / (2 * POINTS), v[2 * POINTS + 1], norm = 0;
    for (int i = 0; i < 2 * POINTS; i++) {
        double r = (i + 0.5) * cell;
        v[i] = exp(energy(length / 2) - energy(fmin(r, length - r)));
    }
    memset(g, 0, BINS * sizeof *g);
    for (int i = 0; i < 2 * POINTS; i++) { /* second rod in cell i, third in cell j */
        for (int j = 0; j < 2 * POINTS; j++) {
            double apart = fabs((double)(i - j)) * cell;
            double between = i == j ? 0 : exp(energy(length / 2) -
                                              energy(fmin(apart, length - apart)));
            double weight = v[i] * v[j] * between;
            norm += weight;
            if (i < POINTS)
                g[i / PER_BIN] += 2 * weight; /* of the first rod with either other one */
        }
    }
    double density = 3 / length, width = length / (2 * BINS);
    for (int b = 0; b < BINS; b++)
        g[b] /= norm * density * width;
}

static void two_points(double (*energy)(double r), double length, double *g)
{
    double cell = length / (2 * POINTS), norm = 0;
    memset(g, 0, BINS * sizeof *g);
    for (int i = 0; i < POINTS; i++) {
        double weight = exp(energy(length / 2) - energy((i + 0.5) * cell));
        norm += 2 * weight;
        g[i / PER_BIN] += weight;
    }
    for (int b = 0; b < BINS; b++)
        g[b] /= norm * (2 / length) * (length / (2 * BINS));
}

static double strong(double r)
{
    return 1.5 * exp(-0.5 * r) / r;
}

static double soft(double r)
{
    return 4 * exp(-r * r);
}

static void check_points(const char *interaction, int particles, double length, const double *g)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': %d, 'length': %.17g, 'interaction': %s, 'method': 'strang',"
                         " 'time_step': 5e-4, 'sample_every': 2.5e-3, 'equilibration_time': 1, "
                         "'time': 25, 'realizations': 10, 'observables': "
                         "{'pair_distribution': {'bins': %d, 'last': %.17g}}}",
                         particles, length, interaction, BINS, length / 2),
        0);
    struct bcd_table *t = experiment_table(&e, "pair_distribution");
    assert_rows(t, g, 5);
    bcd_table_free(t);
    experiment_end(&e);
}

/* All pairs on a ring as small as the cutoff allows: second neighbours and the seam count. */
static void test_points_on_a_small_ring(void **state)
{
    (void)state;
    double g[BINS];
    two_points(strong, 3, g);
    check_points("{'type': 'yukawa', 'strength': 1.5, 'screening': 0.5, 'cutoff': 1.5}", 2, 3, g);
    three_points(strong, 4, g);
    check_points("{'type': 'yukawa', 'strength': 1.5, 'screening': 0.5, 'cutoff': 2}", 3, 4, g);
    three_points(soft, 4, g);
    check_points("{'type': 'expression', 'energy': '4*exp(-r^2)', 'cutoff': 2}", 3, 4, g);
}

/* Two rods in a box: density over [0, L] from the weight of both positions. */
static void test_two_rods_between_walls(void **state)
{
    (void)state;
    enum { CELLS = 600 };
    const double length = 2, diameter = 0.2, cell = length / CELLS;
    double density[BINS] = {0}, norm = 0;
    for (int i = 0; i < CELLS; i++) {
        for (int j = i; j < CELLS; j++) {
            double x = (i + 0.5) * cell, apart = (j - i) * cell;
            bool fits = x > diameter / 2 && x + apart < length - diameter / 2;
            if (!fits || apart < diameter)
                continue;
            double weight = exp(-strong(apart)) * (j - i == CELLS / 10 ? 0.5 : 1);
            norm += weight;
            density[i * BINS / CELLS] += weight;
            density[j * BINS / CELLS] += weight;
        }
    }
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 2, 'length': 2, 'diameter': 0.2, 'boundary': 'walls', "
                         "'interaction': {'type': 'yukawa', 'strength': 1.5, 'screening': 0.5, "
                         "'cutoff': 2.5}, 'method': 'strang', 'time_step': 2e-4, 'time': 25, "
                         "'equilibration_time': 1, 'realizations': 16, 'observables': {'density': "
                         "{'bins': 10}}}"),
        0);
    for (int b = 0; b < BINS; b++)
        density[b] /= norm * length / BINS;
    struct bcd_table *t = experiment_table(&e, "density");
    assert_rows(t, density, 5);
    bcd_table_free(t);
    experiment_end(&e);
}

/* Several orders of neighbours in a field against Metropolis' chain, which has no error of the
 * step: it asks for energies, the dynamics for forces. */
static void test_far_neighbours_against_metropolis(void **state)
{
    (void)state;
    static const char *const methods[] = {"strang", "metropolis"};
    static const double steps[] = {1e-3, 2e-3};
    double value[2], error[2], step = 0;
    for (int m = 0; m < 2; m++) {
        struct experiment e = experiment_run(
            experiment_scene("{'particles': 12, 'length': 8, " FIELD "'interaction': {'type': "
                             "'expression', 'energy': '6*exp(-r^2)', 'cutoff': 3}, 'method': '%s', "
                             "'time_step': %.17g, 'equilibration_time': 1, 'time': 5, "
                             "'realizations': 16, 'observables': {'energy': {}}}",
                             methods[m], steps[m]),
            0);
        struct bcd_table *t = experiment_table(&e, "energy");
        value[m] = column_of(t, BCD_ROLE_VALUE)[0];
        error[m] = column_of(t, BCD_ROLE_STDERR)[0];
        step = m == 0 ? column_of(t, BCD_ROLE_TIME_STEP_ERROR)[0] : step;
        bcd_table_free(t);
        experiment_end(&e);
    }
    assert_true(step < 0.02);
    assert_within(value[0], value[1], hypot(error[0], error[1]), 5, step);
}

/* ----------------------------------------------------------- automatic time step */

static void check_automatic(const char *job, const char *why)
{
    struct bcd_scene *scene = experiment_scene("%s", job);
    const struct bcd_fact *fact;
    bool found = false;
    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)) != NULL; i++) {
        if (strcmp(fact->name, "time_step_limited_by") == 0) {
            assert_string_equal(fact->text, why);
            found = true;
        }
    }
    assert_true(found);
    struct experiment e = experiment_run(scene, 0);
    check_table(&e, "energy", 3);
    check_table(&e, "density", 3);
    experiment_end(&e);
}

static void test_automatic_steps_are_right(void **state)
{
    (void)state;
    check_automatic("{'particles': 6, 'length': 6, 'diameter': 0.5, " FIELD "'interaction': "
                    "{'type': 'yukawa', 'strength': 20, 'screening': 8, 'cutoff': 1}, 'time': 10, "
                    "'equilibration_time': 1, 'realizations': 24, 'method': 'strang', "
                    "'observables': {'energy': {}, 'density': {'bins': 8}}}",
                    "stiffness of the interaction");
    check_automatic("{'particles': 6, 'length': 6, 'diameter': 0.5, " FIELD "'interaction': "
                    "{'type': 'power', 'strength': -0.01, 'exponent': 8, 'cutoff': 1}, 'time': 10, "
                    "'equilibration_time': 1, 'realizations': 24, 'method': 'strang', "
                    "'observables': {'energy': {}, 'density': {'bins': 8}}}",
                    "stiffness of the interaction");
    check_automatic("{'particles': 6, 'length': 6, 'diameter': 0.5, " FIELD "'interaction': "
                    "{'type': 'yukawa', 'strength': 0.5, 'screening': 1, 'cutoff': 1}, 'time': 10, "
                    "'equilibration_time': 1, 'realizations': 24, 'method': 'strang', "
                    "'observables': {'energy': {}, 'density': {'bins': 8}}}",
                    "curvature of the potential");
}

/* ------------------------------------------------------------------------ order */

/* Steps far too long for repulsion of thousands of kT: positions stay numbers and in order. */
static void check_order(const char *method, const char *boundary)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 20, 'length': 20, 'boundary': '%s', 'diameter': 0.3, "
                         "'interaction': {'type': 'power', 'strength': 10, 'exponent': 9, "
                         "'cutoff': 3}, 'method': '%s', 'stability': 'ignored', 'time_step': 1e-3, "
                         "'time': 0.5, 'observables': {'trajectory': {'every': 1e-3}}}",
                         boundary, method),
        0);
    struct bcd_table *t = experiment_table(&e, "trajectory");
    const double *x = column_of(t, BCD_ROLE_VALUE);
    size_t each = t->rows / 20; /* rod by rod */
    assert_true(each > 100);
    for (size_t i = 0; i < each; i++) {
        for (size_t rod = 0; rod < 20; rod++) {
            double next = rod < 19 ? x[(rod + 1) * each + i] : x[i] + 20;
            assert_true(next - x[rod * each + i] >= 0.3 - 1e-9);
        }
    }
    bcd_table_free(t);
    experiment_end(&e);
}

static void test_rods_stay_in_order(void **state)
{
    (void)state;
    check_order("strang", "periodic");
    check_order("bcd", "periodic");
    check_order("strang", "walls");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_profiles_in_a_field),
        cmocka_unit_test(test_the_interaction_is_seen),
        cmocka_unit_test(test_pair_distributions),
        cmocka_unit_test(test_theory_beyond_neighbours_is_refused),
        cmocka_unit_test(test_points_on_a_small_ring),
        cmocka_unit_test(test_two_rods_between_walls),
        cmocka_unit_test(test_far_neighbours_against_metropolis),
        cmocka_unit_test(test_automatic_steps_are_right),
        cmocka_unit_test(test_rods_stay_in_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
