/* SPDX-License-Identifier: GPL-3.0-or-later
 * Simulations between walls against the exact theory. Fixed seeds; bounds are five standard errors
 * of the simulation plus, in a field, the time step's error as the result itself estimates it. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include <cmocka.h>

/* Every row within five standard errors, and the time step's error if that is to count. */
static void check_rows(const struct experiment *e, const char *observable, bool finite_step)
{
    struct bcd_table *t = experiment_table(e, observable);
    const double *exact = column_of(t, BCD_ROLE_THEORY), *value = column_of(t, BCD_ROLE_VALUE),
                 *error = column_of(t, BCD_ROLE_STDERR);
    const double *step = finite_step ? column_of(t, BCD_ROLE_TIME_STEP_ERROR) : NULL;
    for (size_t i = 0; i < t->rows; i++)
        assert_within(value[i], exact[i], error[i], 5, step ? step[i] : 0);
    bcd_table_free(t);
}

/* Without a field a step of any length is exact in law: no slack. */
static void test_free_rods(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 6, 'length': 9, 'diameter': 0.6, 'boundary': 'walls', "
                         "'method': 'elastic', 'time_step': 0.05, 'time': 20, 'realizations': 200, "
                         "'observables': {'density': {'bins': 18}, 'energy': {}, "
                         "'contact_density': {'bins': 9, 'gap': 0.1}}}"),
        0);
    check_rows(&e, "density", false);
    check_rows(&e, "energy", false);
    check_rows(&e, "contact_density", false);
    experiment_end(&e);
}

/* Pairs of two free rods: P(r) = 2 (A - r) / ell^2 beyond contact, so g is flat. */
static void test_pairs_of_two_free_rods(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 2, 'length': 4, 'diameter': 0.5, 'boundary': 'walls', "
                         "'method': 'elastic', 'time_step': 0.2, 'time': 80, 'realizations': 200, "
                         "'observables': {'pair_distribution': {'bins': 7, 'last': 3.5}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "pair_distribution");
    const double *value = column_of(t, BCD_ROLE_VALUE), *error = column_of(t, BCD_ROLE_STDERR);
    assert_true(value[0] == 0);
    for (size_t i = 1; i < t->rows; i++)
        assert_within(value[i], 2 * 3.5 * 3.5 / (4 * 3.0 * 3.0), error[i], 5, 0);
    bcd_table_free(t);
    experiment_end(&e);
}

static void check_cosine(const char *method, double step)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 4, 'length': 5, 'diameter': 0.6, 'boundary': 'walls', "
                         "'potential': {'type': 'cosine', 'amplitude': 3, 'phase': 0.7}, 'method': "
                         "'%s', 'time_step': %g, 'initial': 'equilibrium', 'time': 15, "
                         "'realizations': 60, 'observables': {'density': {'bins': 20}, 'energy': "
                         "{}}}",
                         method, step),
        0);
    check_rows(&e, "density", true);
    check_rows(&e, "energy", true);
    experiment_end(&e);
}

static void test_hard_rods_in_a_cosine(void **state)
{
    (void)state;
    check_cosine("strang", 1e-3);
    check_cosine("elastic", 5e-4);
    check_cosine("bcd", 2e-4);
}

static void test_sticky_rods(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 4, 'length': 5, 'diameter': 0.6, 'boundary': 'walls', "
                         "'interaction': {'type': 'sticky', 'strength': 0.5, 'range': 0.1, "
                         "'exponent': 3}, 'potential': {'type': 'cosine', 'amplitude': 2}, "
                         "'method': 'strang', 'initial': 'equilibrium', 'time': 4, "
                         "'realizations': 40, 'observables': {'density': {'bins': 10}, 'energy': "
                         "{}, 'contact_density': {'bins': 3, 'gap': 0.1}}}"),
        0);
    check_rows(&e, "density", true);
    check_rows(&e, "energy", true);
    check_rows(&e, "contact_density", true);
    experiment_end(&e);
}

/* The barometer: a constant force between walls is in equilibrium. */
static void test_rods_under_gravity(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 5, 'length': 8, 'diameter': 0.5, 'boundary': 'walls', "
                         "'force': -0.8, 'time_step': 2e-4, 'initial': 'equilibrium', 'time': 4, "
                         "'realizations': 100, 'observables': {'density': {'bins': 16}, 'energy': "
                         "{}, 'current': {}}}"),
        0);
    check_rows(&e, "density", true);
    check_rows(&e, "current", false);
    struct bcd_table *t = experiment_table(&e, "energy");
    assert_true(column_of(t, BCD_ROLE_VALUE)[0] == 0 && column_of(t, BCD_ROLE_THEORY)[0] == 0);
    bcd_table_free(t);
    experiment_end(&e);
}

/* Exact draws: seen one tiny step after them, realizations independent, chi-square holds. */
static void check_start(const char *interaction, double force)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 12, 'length': 12, 'diameter': 0.7, 'boundary': 'walls', "
                         "'initial': 'equilibrium', 'potential': {'type': 'cosine', 'amplitude': "
                         "4}, 'force': %g, 'interaction': %s, 'time_step': 1e-9, 'time': 1e-9, "
                         "'realizations': 3000, 'observables': {'density': {'bins': 24}, 'energy': "
                         "{}, 'contact_density': {'bins': 4, 'gap': 0.03}}}",
                         force, interaction),
        0);
    static const char *const observables[] = {"density", "energy", "contact_density"};
    for (size_t i = 0; i < 3; i++) {
        struct bcd_table *t = experiment_table(&e, observables[i]);
        double square = NAN, freedom = NAN;
        for (size_t k = 0; k < t->notes; k++) {
            square = strcmp(t->note[k].name, "chi_square") ? square : t->note[k].number;
            freedom = strcmp(t->note[k].name, "degrees_of_freedom") ? freedom : t->note[k].number;
        }
        assert_true(freedom >= 1);
        assert_true(square < freedom + 5 * sqrt(2 * freedom));
        bcd_table_free(t);
    }
    experiment_end(&e);
}

static void test_equilibrium_start(void **state)
{
    (void)state;
    check_start("null", 0);
    check_start("null", 1.5);
    check_start("{'type': 'sticky', 'strength': 1, 'range': 0.05}", 0);
}

/* Without noise a force drives all rods against the wall and each other: exact contacts, one
 * cluster of all. */
static void test_rods_pile_up_without_noise(void **state)
{
    (void)state;
    static const char *const methods[] = {"bcd", "strang"};
    for (size_t m = 0; m < 2; m++) {
        struct experiment e = experiment_run(
            experiment_scene("{'particles': 7, 'length': 10, 'diameter': 0.6, 'boundary': "
                             "'walls', 'temperature': 0, 'force': 3, 'method': '%s', 'time_step': "
                             "0.01, 'equilibration_time': 6, 'time': 1, 'initial': 'lattice', "
                             "'observables': {'density': {'bins': 200}, 'cluster_sizes': {}, "
                             "'current': {}}}",
                             methods[m]),
            0);
        struct bcd_table *t = experiment_table(&e, "cluster_sizes");
        assert_int_equal(t->rows, 7);
        assert_true(column_of(t, BCD_ROLE_VALUE)[6] == 1); /* all clusters are of seven rods */
        bcd_table_free(t);
        t = experiment_table(&e, "density");
        for (int i = 0; i < 7; i++) { /* centres at 9.7, 9.1, ...: a bin is 0.05 wide */
            size_t bin = (size_t)((9.7 - 0.6 * i) / 0.05 - 1e-6);
            const double *value = column_of(t, BCD_ROLE_VALUE);
            assert_true(fabs(value[bin] + value[bin + 1] - 20) < 1e-9);
        }
        bcd_table_free(t);
        t = experiment_table(&e, "current");
        assert_true(column_of(t, BCD_ROLE_VALUE)[0] == 0);
        bcd_table_free(t);
        experiment_end(&e);
    }
}

/* One free rod in a box of width A: the exact law at all lags, A^2/6 in the end. */
static void test_displacements_saturate(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 2, 'boundary': 'walls', 'method': 'elastic', "
                         "'time_step': 0.004, 'time': 40, 'realizations': 100, 'observables': "
                         "{'msd': {'first': 0.004, 'last': 10, 'points': 12}}}"),
        0);
    check_rows(&e, "msd", false);
    struct bcd_table *t = experiment_table(&e, "msd");
    const double *exact = column_of(t, BCD_ROLE_THEORY), *lag = column_of(t, BCD_ROLE_X);
    assert_true(fabs(exact[t->rows - 1] - 4.0 / 6) < 1e-9);
    double tau = lag[0] / 4; /* D t / A^2 */
    assert_true(fabs(exact[0] / 4 - 2 * tau + 16 / (3 * sqrt(3.14159265358979)) * pow(tau, 1.5)) <
                1e-12);
    bcd_table_free(t);
    experiment_end(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_rods),
        cmocka_unit_test(test_pairs_of_two_free_rods),
        cmocka_unit_test(test_hard_rods_in_a_cosine),
        cmocka_unit_test(test_sticky_rods),
        cmocka_unit_test(test_rods_under_gravity),
        cmocka_unit_test(test_equilibrium_start),
        cmocka_unit_test(test_rods_pile_up_without_noise),
        cmocka_unit_test(test_displacements_saturate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
