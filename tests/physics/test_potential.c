/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rods in the cosine potential, where the answer is known: Boltzmann's profile for one rod, the
 * noiseless flow, rods at rest in one well. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* Mean of exp(-(U0/2) cos(2 pi x)) over [a, b]. */
static double boltzmann_mean(double u0, double a, double b)
{
    enum { PANELS = 200 };
    double sum = 0;
    for (int i = 0; i < PANELS; i++)
        sum += exp(-u0 / 2 * cos(2 * M_PI * (a + (b - a) * (i + 0.5) / PANELS)));
    return sum / PANELS;
}

static void test_single_rod_is_boltzmann_distributed(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 3, 'diameter': 0.3, 'potential': {'type': "
                         "'cosine', 'amplitude': 2}, 'time_step': 1e-4, 'equilibration_time': 1, "
                         "'time': 10, 'realizations': 600, 'observables': {'density': {'bins': "
                         "10}, 'energy': {}}}"),
        0);
    struct bcd_table *d = experiment_table(&e, "density"), *u = experiment_table(&e, "energy");
    double norm = boltzmann_mean(2, 0, 1) * 3; /* N/L = 1/3 on average */
    for (size_t i = 0; i < d->rows; i++) {
        double exact = boltzmann_mean(2, (double)i / 10, (double)(i + 1) / 10) / norm;
        /* Euler: relative error of the profile below k h = 0.004 */
        assert_within(column_of(d, BCD_ROLE_VALUE)[i], exact, column_of(d, BCD_ROLE_STDERR)[i], 5,
                      0.004 * exact);
    }
    /* <U> = -(U0/2) I1(U0/2) / I0(U0/2), Abramowitz & Stegun 9.6: I1(1)/I0(1) = 0.4463899659 */
    assert_within(column_of(u, BCD_ROLE_VALUE)[0], -0.4463899659, column_of(u, BCD_ROLE_STDERR)[0],
                  5, 0.004);
    bcd_table_free(d), bcd_table_free(u);
    experiment_end(&e);
}

/* Without noise one rod obeys tan(pi x(t)) = tan(pi x(0)) exp(k t), k = 2 pi^2 U0 (lambda = mu =
 * 1): a lattice rod starts at x = L/2. Two steps of a first-order scheme, extrapolated. */
static double noiseless_energy(double time_step)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 1, 'temperature': 0, 'initial': 'lattice', "
                         "'method': 'bcd', "
                         "'potential': {'type': 'cosine', 'amplitude': 1, 'phase': 2.5}, "
                         "'time_step': %.17g, 'time': 0.05, 'sample_every': 0.05, 'observables': "
                         "{'energy': {}}}",
                         time_step),
        0);
    struct bcd_table *u = experiment_table(&e, "energy");
    double value = column_of(u, BCD_ROLE_VALUE)[0];
    bcd_table_free(u);
    experiment_end(&e);
    return value;
}

static void test_noiseless_flow_of_one_rod(void **state)
{
    (void)state;
    double start = 0.5 + 2.5 / (2 * M_PI); /* in turns of the potential */
    double angle = atan(tan(M_PI * start) * exp(2 * M_PI * M_PI * 0.05));
    double exact = 0.5 * cos(2 * angle);
    double coarse = noiseless_energy(2.5e-5 * 2), fine = noiseless_energy(2.5e-5);
    assert_within(2 * fine - coarse, exact, 0, 0, 1e-6);
    assert_true(fabs(fine - exact) < 1e-3);
    assert_true(fabs(fine - exact) > 1e-8); /* and it is not exact by accident */
}

/* Two rods in one well come to rest in contact, half a diameter off its bottom on either side. */
static void test_noiseless_pair_rests_in_contact(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 2, 'length': 1, 'diameter': 0.3, 'temperature': 0, "
                         "'potential': {'type': 'cosine', 'amplitude': 6}, 'time_step': 1e-4, "
                         "'equilibration_time': 2, 'time': 0.1, 'observables': {'energy': {}, "
                         "'cluster_sizes': {}, 'current': {}}}"),
        0);
    struct bcd_table *u = experiment_table(&e, "energy"),
                     *c = experiment_table(&e, "cluster_sizes"),
                     *j = experiment_table(&e, "current");
    assert_within(column_of(u, BCD_ROLE_VALUE)[0], -3 * cos(2 * M_PI * 0.15), 0, 0, 1e-9);
    assert_int_equal(c->rows, 2);
    assert_true(column_of(c, BCD_ROLE_VALUE)[1] == 1);
    assert_within(column_of(j, BCD_ROLE_VALUE)[0], 0, 0, 0, 1e-9);
    bcd_table_free(u), bcd_table_free(c), bcd_table_free(j);
    experiment_end(&e);
}

/* A deep travelling well carries its rod along: <v> = velocity. */
static void test_travelling_well_carries_a_rod(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 2, 'temperature': 0, 'potential': {'type': "
                         "'cosine', 'amplitude': 8, 'velocity': -1.5}, 'time_step': 1e-4, "
                         "'equilibration_time': 2, 'time': 40, 'observables': {'current': {}}}"),
        0);
    struct bcd_table *j = experiment_table(&e, "current");
    assert_within(column_of(j, BCD_ROLE_VALUE)[0], -1.5 / 2, 0, 0, 1e-6);
    bcd_table_free(j);
    experiment_end(&e);
}

/* The case of physics notes "B6" (N = 16, L = 20, sigma = .8, U0 = 6): error of the mean energy of
 * this scheme at h = 1e-3 is +.0491 and at 1e-4 +.0103; its difference between the two, .0388,
 * needs no exact value. */
static double energy_of_case(double time_step, double *error)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'potential': {'type': "
                         "'cosine', 'amplitude': 6}, 'method': 'bcd', 'time_step': %.17g, "
                         "'equilibration_time': 2, "
                         "'time': 10, 'realizations': 48, 'sample_every': 5e-3, 'observables': "
                         "{'energy': {}}}",
                         time_step),
        0);
    struct bcd_table *u = experiment_table(&e, "energy");
    double value = column_of(u, BCD_ROLE_VALUE)[0];
    *error = column_of(u, BCD_ROLE_STDERR)[0];
    bcd_table_free(u);
    experiment_end(&e);
    return value;
}

static void test_bias_of_the_projected_euler_scheme(void **state)
{
    (void)state;
    double coarse_error, fine_error;
    double coarse = energy_of_case(1e-3, &coarse_error), fine = energy_of_case(1e-4, &fine_error);
    double error = sqrt(coarse_error * coarse_error + fine_error * fine_error);
    assert_within(coarse - fine, 0.0491 - 0.0103, error, 5, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_single_rod_is_boltzmann_distributed),
        cmocka_unit_test(test_noiseless_flow_of_one_rod),
        cmocka_unit_test(test_noiseless_pair_rests_in_contact),
        cmocka_unit_test(test_travelling_well_carries_a_rod),
        cmocka_unit_test(test_bias_of_the_projected_euler_scheme),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
