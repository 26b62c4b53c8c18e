/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rods without a potential, where exact laws are known in closed form. Seeds are fixed; bounds are
 * five standard errors of the test's own numbers. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

/* One rod diffuses: MSD = 2 D t at every lag, D = mobility * temperature. */
static void test_single_rod_diffuses(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 7, 'diameter': 0.5, 'mobility': 2.5, "
                         "'temperature': 0.4, 'time_step': 1e-3, 'time': 20, 'realizations': 400, "
                         "'observables': {'msd': {'last': 10, 'points': 20}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "msd");
    const double *lag = column_of(t, BCD_ROLE_X), *msd = column_of(t, BCD_ROLE_VALUE),
                 *error = column_of(t, BCD_ROLE_STDERR);
    for (size_t i = 0; i < t->rows; i++) {
        assert_within(msd[i], 2 * lag[i], error[i], 5, 0);
        assert_true(error[i] < 0.2 * msd[i]); /* a bound that can be missed */
    }
    bcd_table_free(t);
    experiment_end(&e);
}

/* Contacts move rods, not their centre: <v> has variance 2 D / (N T), so the current's standard
 * error over R realizations is (N/L) sqrt(2 D / (N T R)), itself known to 1/sqrt(2R). */
static void check_centre_of_mass(double diameter)
{
    const double n = 8, length = 10, time = 0.5, realizations = 4000;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 8, 'length': 10, 'diameter': %.17g, 'time_step': 1e-3, "
                         "'time': 0.5, 'realizations': 4000, 'observables': {'current': {}}}",
                         diameter),
        0);
    struct bcd_table *t = experiment_table(&e, "current");
    double error = column_of(t, BCD_ROLE_STDERR)[0];
    double exact = n / length * sqrt(2 / (n * time * realizations));
    assert_within(error, exact, exact / sqrt(2 * realizations), 5, 0);
    assert_within(column_of(t, BCD_ROLE_VALUE)[0], 0, error, 5, 0);
    bcd_table_free(t);
    experiment_end(&e);
}

static void test_centre_of_mass_diffuses_with_d_over_n(void **state)
{
    (void)state;
    check_centre_of_mass(0);
    check_centre_of_mass(1.1);   /* dense */
    check_centre_of_mass(1.25);  /* jammed: N sigma = L */
}

/* Closest packing is one rigid body: every rod's MSD is that of the centre, 2 D t / N. */
static void test_jammed_ring_is_rigid(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 5, 'length': 5, 'diameter': 1, 'time_step': 1e-3, 'time': "
                         "2, 'realizations': 500, 'observables': {'msd': {'last': 1, 'points': 9},"
                         "'cluster_sizes': {}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "msd"), *c = experiment_table(&e, "cluster_sizes");
    for (size_t i = 0; i < t->rows; i++)
        assert_within(column_of(t, BCD_ROLE_VALUE)[i], 2 * column_of(t, BCD_ROLE_X)[i] / 5,
                      column_of(t, BCD_ROLE_STDERR)[i], 5, 0);
    assert_int_equal(c->rows, 5);
    assert_true(column_of(c, BCD_ROLE_VALUE)[4] == 1); /* one cluster of all rods, always */
    bcd_table_free(t), bcd_table_free(c);
    experiment_end(&e);
}

/* Constant drag, no noise: everything moves at mu f, exactly, over many turns of the ring. */
static void test_drag_moves_rods_at_mobility_times_force(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 3, 'length': 4, 'diameter': 1, 'mobility': 0.5, 'force': "
                         "-8, 'temperature': 0, 'time_step': 1e-3, 'time': 2000, 'observables': "
                         "{'current': {}, 'msd': {'first': 1, 'last': 100, 'points': 3}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "current"), *m = experiment_table(&e, "msd");
    assert_within(column_of(t, BCD_ROLE_VALUE)[0], -4.0 * 3 / 4, 0, 0, 1e-9);
    for (size_t i = 0; i < m->rows; i++) {
        double moved = 4 * column_of(m, BCD_ROLE_X)[i];
        assert_within(column_of(m, BCD_ROLE_VALUE)[i], moved * moved, 0, 0, 1e-7 * moved * moved);
    }
    bcd_table_free(t), bcd_table_free(m);
    experiment_end(&e);
}

/* Neighbours' gaps on a ring of N points: P(gap <= g) = 1 - (1 - g/ell)^(N-1), so the windowed
 * contact density is rho P / g. A step h of the projected Euler scheme acts as if rods were
 * shorter by O(sqrt h): two steps, extrapolated in sqrt h, must meet the exact number. */
static double contact_density(double time_step, double *error)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 10, 'length': 20, 'diameter': 0.8, 'method': 'bcd', "
                         "'time_step': %.17g, "
                         "'time': 4, 'realizations': 300, 'sample_every': 2e-3, 'observables': "
                         "{'contact_density': {'bins': 1, 'gap': 0.1}}}",
                         time_step),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_density");
    double value = column_of(t, BCD_ROLE_VALUE)[0];
    *error = column_of(t, BCD_ROLE_STDERR)[0];
    bcd_table_free(t);
    experiment_end(&e);
    return value;
}

static void test_contact_density_converges_to_tonks(void **state)
{
    (void)state;
    const double ell = 20 - 10 * 0.8, gap = 0.1, rho = 0.5;
    double exact = rho * (1 - pow(1 - gap / ell, 9)) / gap, coarse_error, fine_error;
    double coarse = contact_density(4e-4, &coarse_error), fine = contact_density(1e-4, &fine_error);
    double error = sqrt(4 * fine_error * fine_error + coarse_error * coarse_error);
    assert_within(2 * fine - coarse, exact, error, 5, 0.02 * exact); /* O(h) is left over */
    /* Measured excess: rods shorter by 1.165 sqrt h against a window of 0.1. */
    assert_within(coarse / exact, 1 + 1.165 * sqrt(4e-4) / gap, coarse_error / exact, 5, 0.03);
}

static void test_density_without_a_potential_is_flat(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 12, 'length': 10, 'diameter': 0.5, 'time_step': 1e-3, "
                         "'time': 3, 'realizations': 500, 'observables': {'density': {'bins': "
                         "16}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "density");
    double mean = 0, chi_square = 0;
    for (size_t i = 0; i < t->rows; i++) {
        double value = column_of(t, BCD_ROLE_VALUE)[i], error = column_of(t, BCD_ROLE_STDERR)[i];
        mean += value / (double)t->rows;
        chi_square += (value - 1.2) * (value - 1.2) / (error * error);
        assert_within(value, 1.2, error, 5, 0);
    }
    assert_within(mean, 1.2, 0, 0, 1e-12);    /* every rod is counted once */
    assert_true(chi_square < 15 + 5 * sqrt(30)); /* 15 degrees of freedom */
    bcd_table_free(t);
    experiment_end(&e);
}

/* The uniform initial configuration: gaps as above from the very first tick. At T = 0 nothing
 * moves, so every sample of every realization shows it. */
static void test_uniform_initial_configuration(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 10, 'length': 20, 'diameter': 0.8, 'temperature': 0, "
                         "'time_step': 1, 'time': 1, 'realizations': 20000, 'observables': "
                         "{'contact_density': {'bins': 4, 'gap': 2}, 'density': {'bins': 8}}}"),
        0);
    struct bcd_table *c = experiment_table(&e, "contact_density"),
                     *d = experiment_table(&e, "density");
    double exact = 0.5 * (1 - pow(1 - 2 / 12.0, 9)) / 2;
    for (size_t i = 0; i < c->rows; i++)
        assert_within(column_of(c, BCD_ROLE_VALUE)[i], exact, column_of(c, BCD_ROLE_STDERR)[i], 5,
                      0);
    for (size_t i = 0; i < d->rows; i++)
        assert_within(column_of(d, BCD_ROLE_VALUE)[i], 0.5, column_of(d, BCD_ROLE_STDERR)[i], 5, 0);
    bcd_table_free(c), bcd_table_free(d);
    experiment_end(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_single_rod_diffuses),
        cmocka_unit_test(test_centre_of_mass_diffuses_with_d_over_n),
        cmocka_unit_test(test_jammed_ring_is_rigid),
        cmocka_unit_test(test_drag_moves_rods_at_mobility_times_force),
        cmocka_unit_test(test_contact_density_converges_to_tonks),
        cmocka_unit_test(test_density_without_a_potential_is_flat),
        cmocka_unit_test(test_uniform_initial_configuration),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
