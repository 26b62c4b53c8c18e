/* SPDX-License-Identifier: GPL-3.0-or-later
 * Observables of motions that a few lines can repeat: no noise, rods on a lattice, in one well or
 * under drag. Every count, place, norm and origin is checked against plain loops. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void assert_number(double value, double expected)
{
    assert_within(value, expected, 0, 0, 1e-9 * (1 + fabs(expected)));
}

/* ------------------------------------------------------------------ places */

/* Rods at x = 1/2, 3/2, .. of a flat potential of period 2, gaps 0.1. */
#define LATTICE                                                                                    \
    "'particles': 6, 'length': 6, 'diameter': 0.9, 'temperature': 0, 'initial': 'lattice', "       \
    "'potential': {'type': 'cosine', 'amplitude': 0, 'wavelength': 2}, 'method': 'bcd', "          \
    "'time_step': 0.01, 'time': 1, "

/* x mod 2 = 1/2 or 3/2: bins 1 and 4 of 5. */
static void test_profiles_of_a_lattice(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{" LATTICE "'observables': {'density': {'bins': 5}, 'contact_density': "
                         "{'bins': 5, 'gap': 0.15}, 'energy': {}, 'current': {}}}"),
        0);
    struct bcd_table *d = experiment_table(&e, "density"),
                     *c = experiment_table(&e, "contact_density");
    static const double here[] = {0, 1, 0, 1, 0};
    for (size_t i = 0; i < 5; i++) {
        assert_number(column_of(d, BCD_ROLE_X)[i], 0.4 * (double)i + 0.2);
        assert_number(column_of(c, BCD_ROLE_X)[i], 0.4 * (double)i + 0.2);
        /* three rods of each kind in three periods: one a bin of width 0.4 */
        assert_number(column_of(d, BCD_ROLE_VALUE)[i], here[i] / 0.4);
        assert_number(column_of(c, BCD_ROLE_VALUE)[i], here[i] / 0.4 / 0.15);
    }
    bcd_table_free(d), bcd_table_free(c);
    experiment_end(&e);
}

/* Distances 1, 2, 3, 4 and no others, six pairs of each, round the ring too: g = 6 L / (N^2 w). */
static void test_pairs_of_a_lattice(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{" LATTICE
                         "'observables': {'pair_distribution': {'bins': 9, 'last': 4.5}}}"),
        0);
    struct bcd_table *g = experiment_table(&e, "pair_distribution");
    for (size_t i = 0; i < 9; i++) {
        assert_number(column_of(g, BCD_ROLE_X)[i], 0.5 * (double)i + 0.25);
        double r = column_of(g, BCD_ROLE_X)[i];
        bool full = fabs(r - 0.25 - rint(r - 0.25)) < 1e-6 && r > 1;
        /* a distance on the border of two bins may be rounded into either */
        if (full)
            assert_number(column_of(g, BCD_ROLE_VALUE)[i] + column_of(g, BCD_ROLE_VALUE)[i - 1],
                          6 * 6 / (36 * 0.5));
    }
    bcd_table_free(g);
    experiment_end(&e);
}

/* The whole lattice is one cluster when its gaps count as closed, single rods when not. */
static void test_clusters_of_a_lattice(void **state)
{
    (void)state;
    static const double gaps[] = {0.15, 0.05};
    static const size_t sizes[] = {6, 1};
    for (int i = 0; i < 2; i++) {
        struct experiment e = experiment_run(
            experiment_scene("{" LATTICE "'observables': {'cluster_sizes': {'gap': %.17g}}}",
                             gaps[i]),
            0);
        struct bcd_table *c = experiment_table(&e, "cluster_sizes");
        assert_int_equal(c->rows, sizes[i]);
        assert_number(column_of(c, BCD_ROLE_VALUE)[sizes[i] - 1], 1);
        bcd_table_free(c);
        experiment_end(&e);
    }
}

/* Four rods meet in the well at x = 0 of a ring of one period, two of them across the seam. */
static void test_cluster_across_the_seam(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 4, 'length': 4, 'diameter': 0.3, 'temperature': 0, "
                         "'initial': 'lattice', 'potential': {'type': 'cosine', 'amplitude': -6, "
                         "'wavelength': 4}, 'method': 'bcd', 'time_step': 1e-3, "
                         "'equilibration_time': 4, 'time': 0.1, 'observables': {'cluster_sizes': "
                         "{'gap': 1e-9}, 'contact_density': {'bins': 8, 'gap': 0.01}}}"),
        0);
    struct bcd_table *s = experiment_table(&e, "cluster_sizes"),
                     *c = experiment_table(&e, "contact_density");
    assert_int_equal(s->rows, 4);
    assert_number(column_of(s, BCD_ROLE_VALUE)[3], 1);
    /* left rods of the three contacts at -.45, -.15 and .15: bins 7, 7 and 0 of width 1/2 */
    static const double left[] = {1, 0, 0, 0, 0, 0, 0, 2};
    for (int i = 0; i < 8; i++)
        assert_number(column_of(c, BCD_ROLE_VALUE)[i], left[i] / (0.5 * 0.01));
    bcd_table_free(s), bcd_table_free(c);
    experiment_end(&e);
}

/* -------------------------------------------------------------------- time */

/* Energies are taken where the wave is at the time of the sample. */
static void test_energy_in_a_moving_wave(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 3, 'mobility': 1e-9, 'temperature': 0, "
                         "'initial': 'lattice', 'potential': {'type': 'cosine', 'amplitude': 4, "
                         "'wavelength': 1.5, 'phase': 0.3, 'velocity': 0.7}, 'method': 'bcd', "
                         "'time_step': 0.01, 'equilibration_time': 0.1, 'time': 0.2, "
                         "'sample_every': 0.04, 'realizations': 2, 'observables': {'energy': {}}}"),
        0);
    struct bcd_table *u = experiment_table(&e, "energy");
    double sum = 0;
    for (int k = 1; k <= 5; k++) /* x = L/2, hardly mobile */
        sum += 2 * cos(2 * M_PI * (1.5 - 0.7 * (0.1 + 0.04 * k)) / 1.5 + 0.3);
    assert_within(column_of(u, BCD_ROLE_VALUE)[0], sum / 5, 0, 0, 1e-6);
    bcd_table_free(u);
    experiment_end(&e);
}

/* -------------------------------------------------------------------- lags */

enum { STEPS = 1000 };

/* A rod slides down a long slope, faster and slower: Euler's steps as the method takes them. */
static void slide(double *x)
{
    x[0] = 50; /* a lattice of one */
    for (int t = 0; t < STEPS; t++)
        x[t + 1] = x[t] + 0.01 * (3 + 2 * M_PI / 10 * sin(2 * M_PI * x[t] / 10));
}

/* Origins are multiples of a power of two above an eighth and up to a quarter of the lag, or of the
 * shortest one that looking can afford, the same for all short lags. */
static void check_origins(double first, double last, int points)
{
    double x[STEPS + 1];
    slide(x);
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 100, 'temperature': 0, 'initial': 'lattice', "
                         "'potential': {'type': 'cosine', 'amplitude': 2, 'wavelength': 10}, "
                         "'force': 3, 'method': 'bcd', 'time_step': 0.01, 'time': 10, "
                         "'realizations': 2, 'observables': {'msd': {'first': %.17g, 'last': "
                         "%.17g, 'points': %d}}}",
                         first, last, points),
        0);
    struct bcd_table *t = experiment_table(&e, "msd");
    const struct bcd_column *samples = NULL;
    for (size_t c = 0; c < t->columns; c++)
        if (strcmp(t->column[c].name, "samples") == 0)
            samples = &t->column[c];
    assert_non_null(samples);
    assert_int_equal(t->rows, points);
    int shortest = 1, least = (int)rint(column_of(t, BCD_ROLE_X)[0] / 0.01);
    while (shortest < 64 && 2 * ((STEPS - least) / shortest + 1) > (int)samples->values[0])
        shortest *= 2;
    for (size_t k = 0; k < t->rows; k++) {
        int lag = (int)rint(column_of(t, BCD_ROLE_X)[k] / 0.01), stride = shortest, origins = 0;
        while (stride * 8 <= lag)
            stride *= 2;
        double sum = 0;
        for (int from = 0; from + lag <= STEPS; from += stride, origins++)
            sum += (x[from + lag] - x[from]) * (x[from + lag] - x[from]);
        assert_number(column_of(t, BCD_ROLE_VALUE)[k], sum / origins);
        assert_true(samples->values[k] == 2 * origins);
    }
    bcd_table_free(t);
    experiment_end(&e);
}

static void test_origins_of_lags(void **state)
{
    (void)state;
    check_origins(0.01, 9.5, 4);
    check_origins(0.17, 10, 9);
}

/* Samples of a lag span four of it at least: beyond an eighth of a single realization there is but
 * one, and no error bar. */
static void test_lags_without_error_bars(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 2, 'length': 4, 'time_step': 0.01, 'time': 16, "
                         "'observables': {'msd': {'first': 0.5, 'last': 16, 'points': 30}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "msd");
    for (size_t k = 0; k < t->rows; k++) {
        assert_true(column_of(t, BCD_ROLE_VALUE)[k] > 0);
        bool has = column_of(t, BCD_ROLE_STDERR)[k] > 0; /* else NaN */
        assert_int_equal(has, column_of(t, BCD_ROLE_X)[k] <= 2 + 1e-9);
    }
    bcd_table_free(t);
    experiment_end(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_profiles_of_a_lattice),
        cmocka_unit_test(test_pairs_of_a_lattice),
        cmocka_unit_test(test_clusters_of_a_lattice),
        cmocka_unit_test(test_cluster_across_the_seam),
        cmocka_unit_test(test_energy_in_a_moving_wave),
        cmocka_unit_test(test_origins_of_lags),
        cmocka_unit_test(test_lags_without_error_bars),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
