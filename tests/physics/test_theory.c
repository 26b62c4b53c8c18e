/* SPDX-License-Identifier: GPL-3.0-or-later
 * Simulations by the automatic method against the exact theory beside them. Fixed seeds; bounds are
 * five standard errors of the simulation plus, in a field, a small error of the time step. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static double note(const struct bcd_table *table, const char *name)
{
    for (size_t i = 0; i < table->notes; i++)
        if (strcmp(table->note[i].name, name) == 0)
            return table->note[i].number;
    fail_msg("no note %s", name);
    return NAN;
}

/* Every row within five standard errors and `slack` times the largest exact value. */
static void check_rows(const struct experiment *e, const char *observable, double slack)
{
    struct bcd_table *t = experiment_table(e, observable);
    const double *exact = column_of(t, BCD_ROLE_THEORY), *value = column_of(t, BCD_ROLE_VALUE),
                 *error = column_of(t, BCD_ROLE_STDERR);
    double largest = 0;
    for (size_t i = 0; i < t->rows; i++)
        largest = fmax(largest, fabs(exact[i]));
    for (size_t i = 0; i < t->rows; i++)
        assert_within(value[i], exact[i], error[i], 5, slack * largest);
    bcd_table_free(t);
}

/* Without a field every time step is exact: chi-square holds for a coarse one. */
static void test_tonks_gas(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 10, 'length': 15, 'diameter': 0.5, 'time_step': 0.05, "
                         "'time': 20, 'realizations': 400, 'observables': {'density': {'bins': 8}, "
                         "'pair_distribution': {'bins': 40, 'last': 4}, 'contact_density': "
                         "{'bins': 3, 'gap': 0.1}}}"),
        0);
    check_rows(&e, "density", 0);
    check_rows(&e, "pair_distribution", 0);
    check_rows(&e, "contact_density", 0);
    struct bcd_table *g = experiment_table(&e, "pair_distribution");
    double freedom = note(g, "degrees_of_freedom");
    assert_true(freedom >= 34); /* bins below the diameter are empty */
    assert_true(note(g, "chi_square") < freedom + 5 * sqrt(2 * freedom));
    bcd_table_free(g);
    experiment_end(&e);
}

/* In a field, started from few rods whose wells exchange fast: U0 = 3. */
static void test_hard_rods_in_a_cosine(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 5, 'length': 6, 'diameter': 0.6, 'potential': {'type': "
                         "'cosine', 'amplitude': 3}, 'time_step': 5e-4, 'initial': "
                         "'equilibrium', 'time': 20, 'realizations': 100, 'observables': "
                         "{'density': {'bins': "
                         "20}, 'energy': {}, 'pair_distribution': {'bins': 30, 'last': 3}, "
                         "'contact_density': {'bins': 10, 'gap': 0.1}}}"),
        0);
    check_rows(&e, "density", 0.002);
    check_rows(&e, "energy", 0.002);
    check_rows(&e, "pair_distribution", 0.002);
    check_rows(&e, "contact_density", 0.02);
    experiment_end(&e);
}

/* Sticky rods of finite range, with and without a field: the fraction of bonds is the contact
 * density in a window as wide as the range. */
static void check_sticky(double amplitude)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 5, 'length': 6, 'diameter': 0.6, 'potential': {'type': "
                         "'cosine', 'amplitude': %g}, 'interaction': {'type': 'sticky', "
                         "'strength': 0.5, 'range': 0.1, 'exponent': 3}, 'time_step': "
                         "'auto', 'initial': 'equilibrium', 'time': 4, 'realizations': 40, "
                         "'observables': "
                         "{'density': {'bins': 10}, 'energy': {}, 'contact_density': {'bins': 3, "
                         "'gap': 0.1}}}",
                         amplitude),
        0);
    check_rows(&e, "density", 0.01);
    check_rows(&e, "energy", 0.01);
    check_rows(&e, "contact_density", 0.02);
    struct bcd_table *c = experiment_table(&e, "contact_density");
    /* And stickiness is not lost in that: hard rods would have less than half of it. */
    assert_true(column_of(c, BCD_ROLE_VALUE)[1] > 2.0);
    bcd_table_free(c);
    experiment_end(&e);
}

static void test_sticky_rods(void **state)
{
    (void)state;
    check_sticky(0);
}

static void test_sticky_rods_in_a_cosine(void **state)
{
    (void)state;
    check_sticky(2);
}

/* An exact start needs no equilibration: seen one tiny step after it, density, pair distances and
 * energy follow the exact theory. Realizations are independent, so chi-square is what it says. */
static void check_start(const char *interaction, double amplitude)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'initial': "
                         "'equilibrium', 'potential': {'type': 'cosine', 'amplitude': %g}, "
                         "'interaction': %s, 'time_step': 1e-9, 'time': 1e-9, 'realizations': "
                         "3000, 'observables': {'density': {'bins': 25}, 'energy': {}, "
                         "'pair_distribution': {'bins': 40, 'last': 4}}}",
                         amplitude, interaction),
        0);
    static const char *const observables[] = {"density", "energy", "pair_distribution"};
    for (size_t i = 0; i < 3; i++) {
        struct bcd_table *t = experiment_table(&e, observables[i]);
        double freedom = note(t, "degrees_of_freedom");
        assert_true(note(t, "chi_square") < freedom + 5 * sqrt(2 * freedom));
        assert_true(freedom >= (t->rows == 1 ? 1 : 5)); /* deep wells leave bins empty */
        bcd_table_free(t);
    }
    experiment_end(&e);
}

static void test_equilibrium_start_of_hard_rods(void **state)
{
    (void)state;
    check_start("null", 6);
}

static void test_equilibrium_start_of_sticky_rods(void **state)
{
    (void)state;
    check_start("{'type': 'sticky', 'strength': 1, 'range': 0.05}", 6);
}

/* Deep wells exchange no rods within a simulation: only the start can get them right. */
static void test_equilibrium_start_in_deep_wells(void **state)
{
    (void)state;
    check_start("null", 20);
}

/* The comparison itself can fail: a coarse step gives a profile that chi-square rejects. */
static void test_chi_square_rejects_a_coarse_step(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 5, 'length': 6, 'diameter': 0.6, 'potential': {'type': "
                         "'cosine', 'amplitude': 6}, 'method': 'bcd', 'time_step': 4e-3, "
                         "'equilibration_time': 10, "
                         "'time': 50, 'realizations': 100, 'observables': {'density': {'bins': "
                         "20}}}"),
        0);
    struct bcd_table *d = experiment_table(&e, "density");
    assert_true(note(d, "p_value") < 1e-6);
    bcd_table_free(d);
    experiment_end(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tonks_gas),
        cmocka_unit_test(test_hard_rods_in_a_cosine),
        cmocka_unit_test(test_sticky_rods),
        cmocka_unit_test(test_sticky_rods_in_a_cosine),
        cmocka_unit_test(test_equilibrium_start_of_hard_rods),
        cmocka_unit_test(test_equilibrium_start_of_sticky_rods),
        cmocka_unit_test(test_equilibrium_start_in_deep_wells),
        cmocka_unit_test(test_chi_square_rejects_a_coarse_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
