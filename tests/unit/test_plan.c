/* SPDX-License-Identifier: GPL-3.0-or-later
 * From the job to the plan: which steps, samples and lags are chosen, and which jobs are refused
 * although every field alone is within its range. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "scene_json.h"

/* The job (single quotes for double ones) is refused, with a fault at `field` among others. */
static void assert_refused(const char *job, const char *field)
{
    char text[1024];
    snprintf(text, sizeof text, "%s", job);
    for (char *c = text; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    if (scene_json_parse(text, strlen(text), &scene, &errors) == BCD_OK) {
        bcd_scene_free(scene);
        fail_msg("accepted: %s", job);
    }
    for (size_t i = 0; i < errors.count; i++)
        if (strcmp(errors.items[i].field, field) == 0)
            return;
    fail_msg("no fault at %s but at %s (%s): %s", field, errors.items[0].field,
             errors.items[0].text, job);
}

static double fact_of(const char *job, const char *name)
{
    struct bcd_scene *scene = experiment_scene("%s", job);
    double value = experiment_fact(scene, name);
    bcd_scene_free(scene);
    return value;
}

#define ONE "'particles': 1, 'length': 4, "
#define DENSITY "'observables': {'density': {}}}"

/* Positions beyond 2^51 periods have no place within a period left. */
static void test_rods_stay_within_reach_of_their_digits(void **state)
{
    (void)state;
    assert_refused("{'particles': 1, 'length': 1e-3, 'force': 1e9, 'mobility': 13, 'time_step': "
                   "0.333, 'time': 1e5, " DENSITY,
                   "/time_step");
    assert_refused("{'particles': 3, 'length': 1, 'temperature': 1e12, 'mobility': 1e12, "
                   "'time_step': 1e17, 'time': 1e18, " DENSITY,
                   "/time_step");
    assert_refused("{" ONE "'force': -1e9, 'mobility': 1e12, 'time': 1e18, " DENSITY, "/time");
    struct bcd_scene *scene =
        experiment_scene("{" ONE "'force': 1e3, 'time_step': 1, 'time': 1e3, " DENSITY);
    bcd_scene_free(scene);
}

/* 64 lengths L away, where rods are moved back, forces must still fit the bins. */
static void test_length_is_a_whole_number_of_periods(void **state)
{
    (void)state;
    const char *job = "{'particles': 1, 'length': %.17g, 'potential': {'type': 'cosine', "
                      "'amplitude': 1, 'wavelength': %.17g}, 'time': 1, " DENSITY;
    static const struct {
        double length, wavelength;
        bool good;
    } cases[] = {
        {100, 1. / 3, true},        {1, 0.3333333333, true}, {1e6, 0.1, true},
        {1e12, 3, false},           {10, 3, false},          {1, 2, false},
        {1e6, 1.0000000005, false}, {2, 1e-10, false},       {0.5, 1, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[512];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        snprintf(text, sizeof text, job, cases[i].length, cases[i].wavelength);
#pragma GCC diagnostic pop
        if (cases[i].good)
            assert_true(fact_of(text, "time_step") > 0);
        else
            assert_refused(text, "/length");
    }
}

/* A step must not carry rods, or the wave itself, past what they are to feel. */
static void test_steps_too_long_for_the_potential_are_refused(void **state)
{
    (void)state;
#define WAVE(more) "{" ONE "'potential': {'type': 'cosine', 'amplitude': 2" more "}, "
    double k = 4 * M_PI * M_PI; /* max|U''| = U0/2 (2 pi)^2 */
    assert_true(
        fabs(fact_of(WAVE("") "'method': 'bcd', 'time': 100, " DENSITY, "time_step") * k / 0.018 -
             1) < 0.01);
    assert_refused(WAVE("") "'time_step': 0.026, 'time': 100, " DENSITY, "/time_step");
    /* auto: a tenth of a period */
    assert_true(fact_of(WAVE("") "'force': 5e3, 'time': 1, " DENSITY, "time_step") <= 2e-5);
    assert_true(fact_of(WAVE(", 'velocity': -5e3") "'time': 1, " DENSITY, "time_step") <= 2e-5);
    assert_true(fact_of(WAVE(", 'velocity': 5e3") "'force': 5e3, 'time': 1, " DENSITY,
                        "time_step") > 1e-4); /* the wave travels with the rods */
    /* given: half a period */
    assert_refused(WAVE("") "'force': 1e4, 'time_step': 1e-4, 'time': 1, " DENSITY, "/time_step");
    assert_refused(WAVE(", 'velocity': 1e4") "'time_step': 1e-4, 'time': 1, " DENSITY,
                   "/time_step");
    assert_true(fact_of(WAVE("") "'force': 4e3, 'time_step': 1e-4, 'time': 1, " DENSITY,
                        "time_step") == 1e-4);
#undef WAVE
}

/* Contacts of a projected step need 4 D h <= (gap / 2)^2; the mean gap 0.5 asks for less. */
static void test_steps_resolve_contacts(void **state)
{
    (void)state;
#define RODS "{'particles': 4, 'length': 4, 'diameter': 0.5, 'method': 'bcd', 'temperature': 2, "
    double h = fact_of(RODS "'time': 1e-3, 'observables': {'contact_density': {'gap': 0.002}}}",
                       "time_step");
    assert_true(4 * 2 * h <= 1e-6 * (1 + 1e-9) && 4 * 2 * h > 0.99e-6);
    double wide = fact_of(RODS "'time': 1e-3, 'observables': {'contact_density': {'gap': 0.1}}}",
                          "time_step"),
           reach = 0.02 * 0.5;
    assert_true(4 * 2 * wide <= reach * reach * (1 + 1e-9) && 8 * wide > 0.9 * reach * reach);
#undef RODS
}

static void test_interactions_beyond_numbers_are_refused(void **state)
{
    (void)state;
    assert_refused("{'particles': 8, 'length': 8, 'diameter': 0.9, 'interaction': {'type': "
                   "'sticky', 'strength': 1e6, 'range': 1e-310}, 'time': 0.1, " DENSITY,
                   "/time");
    assert_refused("{'particles': 8, 'length': 8, 'diameter': 0.5, 'interaction': {'type': "
                   "'sticky', 'strength': 1, 'range': 0.1}, 'time_step': 1e-2, 'time': 1, " DENSITY,
                   "/time_step");
}

static void test_hardly_any_room_is_none(void **state)
{
    (void)state;
    const char *job = "{'particles': 10, 'length': %.17g, 'diameter': 0.5, 'time': 1, " DENSITY;
    static const double cases[] = {5, 5 - 1e-14, 5 + 4e-12};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        struct bcd_scene *scene = experiment_scene(job, cases[i]);
#pragma GCC diagnostic pop
        assert_true(experiment_fact(scene, "free_length") == 0);
        assert_true(experiment_fact(scene, "steps") < 1e6);
        bcd_scene_free(scene);
    }
    assert_true(fact_of("{'particles': 10, 'length': 5.000000001, 'diameter': 0.5, 'time_step': 1,"
                        " 'time': 1, " DENSITY,
                        "free_length") > 0.9e-9);
}

static void test_counts_of_steps(void **state)
{
    (void)state;
    const char *job = "{" ONE "'time_step': 0.1, 'equilibration_time': 0.3, 'time': 2.05, " DENSITY;
    assert_true(fact_of(job, "steps") == 21);
    assert_true(fact_of(job, "equilibration_steps") == 3); /* 0.3 / 0.1 > 3 in doubles */
    assert_true(fabs(fact_of("{" ONE "'time_step': 1, 'time': 1e15, " DENSITY, "steps") / 1e15 -
                     1) < 1e-11);
    assert_refused("{" ONE "'time_step': 1, 'equilibration_time': 1e4, 'time': 1e15, " DENSITY,
                   "/time");
    assert_refused("{" ONE "'time_step': 1.1, 'time': 1, " DENSITY, "/time_step");
    assert_refused("{" ONE "'time_step': 5e-324, 'time': 1e18, " DENSITY, "/time");
    /* auto divides the sampling interval */
    assert_true(fact_of("{" ONE "'time': 1, 'sample_every': 0.3, " DENSITY, "time_step") == 0.3);
    assert_refused("{" ONE "'time_step': 0.1, 'time': 1, 'sample_every': 0.25, " DENSITY,
                   "/sample_every");
    assert_refused("{" ONE "'time_step': 0.1, 'time': 1, 'sample_every': 1.1, " DENSITY,
                   "/sample_every");
    assert_refused("{" ONE "'time_step': 0.1, 'time': 1, 'sample_every': 0.05, " DENSITY,
                   "/sample_every");
}

static void test_integers_have_exact_limits(void **state)
{
    (void)state;
    assert_true(fact_of("{" ONE "'time': 1, 'seed': 9007199254740992, " DENSITY, "steps") > 0);
    assert_refused("{" ONE "'time': 1, 'seed': 9007199254740993, " DENSITY, "/seed");
    assert_refused("{" ONE "'time': 1, 'seed': -1, " DENSITY, "/seed");
    assert_refused("{'particles': 10000001, 'length': 4, 'time': 1, " DENSITY, "/particles");
    assert_refused("{'particles': 5, 'length': 4, 'diameter': 0.81, 'time': 1, " DENSITY,
                   "/diameter");
}

/* Lags of a job with time_step 0.01 and time 10. */
static void check_lags(const char *msd, size_t rows, double first, double last)
{
    struct experiment e = experiment_run(
        experiment_scene("{" ONE "'time_step': 0.01, 'time': 10, 'observables': {'msd': {%s}}}",
                         msd),
        0);
    struct bcd_table *t = experiment_table(&e, "msd");
    const double *lag = column_of(t, BCD_ROLE_X);
    assert_int_equal(t->rows, rows);
    assert_true(fabs(lag[0] - first) < 1e-12 && fabs(lag[rows - 1] - last) < 1e-12);
    bcd_table_free(t);
    experiment_end(&e);
}

static void test_lags(void **state)
{
    (void)state;
    check_lags("'points': 3", 3, 0.01, 1); /* auto: the step to a tenth of the time */
    check_lags("'first': 0.02, 'last': 8, 'points': 3", 3, 0.02, 8);
    check_lags("'first': 0.02, 'last': 0.05, 'points': 500", 4, 0.02, 0.05); /* no lag twice */
    check_lags("'first': 5, 'points': 4", 1, 5, 5); /* beyond the automatic last */
    check_lags("'first': 10", 1, 10, 10);
#define MSD(what) "{" ONE "'time_step': 0.01, 'time': 10, 'observables': {'msd': {" what "}}}"
    assert_refused(MSD("'first': 0.009"), "/observables/msd/first");
    assert_refused(MSD("'last': 10.1"), "/observables/msd/last");
    assert_refused(MSD("'first': 2, 'last': 1"), "/observables/msd/last");
    assert_refused(MSD("'first': 10.1"), "/observables/msd/first");
#undef MSD
}

/* What was not asked for is no fault of the job. */
static void test_one_long_rod_may_ask_for_everything(void **state)
{
    (void)state;
    static const double diameters[] = {0.8, 1};
    for (int i = 0; i < 2; i++) {
        struct experiment e = experiment_run(
            experiment_scene("{'particles': 1, 'length': 1, 'diameter': %.17g, 'time_step': 1e-3, "
                             "'time': 1, 'observables': {'pair_distribution': {}, 'msd': {}, "
                             "'contact_density': {'gap': 0.1}, 'cluster_sizes': {}}}",
                             diameters[i]),
            0);
        struct bcd_table *g = experiment_table(&e, "pair_distribution"),
                         *c = experiment_table(&e, "contact_density");
        for (size_t r = 0; r < g->rows; r++)
            assert_true(column_of(g, BCD_ROLE_VALUE)[r] == 0);
        for (size_t r = 0; r < c->rows; r++) /* a rod is no neighbour of itself */
            assert_true(column_of(c, BCD_ROLE_VALUE)[r] == 0);
        bcd_table_free(g), bcd_table_free(c);
        experiment_end(&e);
    }
}

/* Nominal ns of a rod and step. */
static double step_costs(const char *job)
{
    struct bcd_scene *scene = experiment_scene("%s", job);
    struct bcd_estimate estimate;
    bcd_scene_estimate(scene, &estimate);
    bcd_scene_free(scene);
    return 1e9 * estimate.core_seconds / estimate.rod_steps;
}

/* Where the noise of a step carries rods past many others, order is most of the work: 6 to 150 ns
 * were measured. An estimate without it has such jobs stopped as if something was wrong. */
static void test_sorting_is_estimated(void **state)
{
#define LAGS "'particles': 1000, 'length': 1000, 'time': 1e8, 'observables': {'msd': {'first': "
    (void)state;
    double near = step_costs("{" LAGS "1e-3, 'last': 1e3, 'points': 2}}}");
    double some = step_costs("{" LAGS "200, 'last': 1e6, 'points': 2}}}");
    double far = step_costs("{" LAGS "1e5, 'last': 1e6, 'points': 2}}}");
    assert_true(near > 4 && near < 20);
    assert_true(some > near + 20 && some < near + 80);
    assert_true(far > near + 80 && far < near + 300);
#undef LAGS
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rods_stay_within_reach_of_their_digits),
        cmocka_unit_test(test_length_is_a_whole_number_of_periods),
        cmocka_unit_test(test_steps_too_long_for_the_potential_are_refused),
        cmocka_unit_test(test_steps_resolve_contacts),
        cmocka_unit_test(test_interactions_beyond_numbers_are_refused),
        cmocka_unit_test(test_hardly_any_room_is_none),
        cmocka_unit_test(test_counts_of_steps),
        cmocka_unit_test(test_integers_have_exact_limits),
        cmocka_unit_test(test_lags),
        cmocka_unit_test(test_one_long_rod_may_ask_for_everything),
        cmocka_unit_test(test_sorting_is_estimated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
