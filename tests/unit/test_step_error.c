/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which way the error of the time step is told, when it is not and why; steps that are known to be
 * too long. */
#include "support/experiment.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#define RODS "'particles': 6, 'length': 8, 'diameter': 0.7, "
#define FIELD "'potential': {'type': 'cosine', 'amplitude': 6}, "
#define ENERGY "'observables': {'energy': {}}}"

static bool has_fact(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_fact *fact;
    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)) != NULL; i++)
        if (strcmp(fact->name, name) == 0)
            return true;
    return false;
}

static const char *note_of(const struct bcd_table *t, const char *name)
{
    for (size_t i = 0; i < t->notes; i++)
        if (strcmp(t->note[i].name, name) == 0)
            return t->note[i].text;
    return NULL;
}

/* Runs the job and checks where its first observable's error comes from (a note), or why there is
 * none (a piece of the reason). The number of paired realizations. */
static double check(const char *job, const char *observable, const char *from, const char *reason)
{
    struct experiment e = experiment_run(experiment_scene("%s", job), 0);
    struct bcd_table *t = experiment_table(&e, observable);
    const struct bcd_column *error = bcd_table_column(t, BCD_ROLE_TIME_STEP_ERROR);
    assert_non_null(error);
    if (from) {
        assert_non_null(error->values);
        assert_string_equal(note_of(t, "time_step_error_from"), from);
        assert_true(isfinite(error->values[0]) && error->values[0] >= 0);
        assert_true((error->values[0] == 0) == (strcmp(from, "exact at any time step") == 0));
    } else {
        assert_null(error->values);
        assert_non_null(strstr(error->reason, reason));
    }
    double paired = has_fact(e.scene, "paired_realizations")
                        ? experiment_fact(e.scene, "paired_realizations")
                        : 0;
    bcd_table_free(t);
    experiment_end(&e);
    return paired;
}

static void test_where_it_comes_from(void **state)
{
    (void)state;
    assert_true(check("{" RODS FIELD "'time_step': 1e-3, 'time': 1, 'realizations': 4, 'method': "
                      "'strang', " ENERGY, "energy", "mid-noise and mid-drift", NULL) == 0);
    assert_true(check("{" RODS FIELD "'time_step': 1e-3, 'time': 1, 'realizations': 12, 'method': "
                      "'bcd', " ENERGY, "energy", "twice the time step", NULL) == 3);
    assert_true(check("{" RODS FIELD "'time_step': 1e-3, 'time': 1, 'method': 'bcd', " ENERGY,
                      "energy", "twice the time step", NULL) == 1);
    assert_true(check("{" RODS "'time_step': 1e-2, 'time': 1, 'realizations': 4, 'method': "
                      "'strang', 'observables': {'msd': {}}}",
                      "msd", "exact at any time step", NULL) == 0);
}

static void test_why_there_is_none(void **state)
{
    (void)state;
    check("{" RODS FIELD "'time_step': 1e-3, 'time': 1, 'method': 'bcd', 'time_step_error': "
          "'skipped', " ENERGY, "energy", NULL, "not asked for");
    check("{" RODS FIELD "'time_step': 5e-3, 'time': 1, 'realizations': 2, 'method': 'bcd', "
          ENERGY, "energy", NULL, "not be stable");
    check("{" RODS FIELD "'time_step': 1e-3, 'time': 1e-3, 'realizations': 2, 'method': 'bcd', "
          ENERGY, "energy", NULL, "too few steps");
}

/* The second pass is counted, and costs what it costs only where it is asked for. */
static void test_cost(void **state)
{
    (void)state;
    const char *job = "{" RODS FIELD "'time_step': 1e-3, 'time': 1, 'realizations': 8, 'method': "
                      "'bcd', 'time_step_error': '%s', " ENERGY;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    struct bcd_scene *with = experiment_scene(job, "estimated"),
                     *without = experiment_scene(job, "skipped");
#pragma GCC diagnostic pop
    struct bcd_estimate a, b;
    bcd_scene_estimate(with, &a);
    bcd_scene_estimate(without, &b);
    assert_true(b.steps == 8000 && a.steps == 8000 + 2 * 500);
    assert_true(b.tally_bytes < a.tally_bytes);
    struct bcd_run *run = NULL;
    assert_int_equal(bcd_run_create(&run, with, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_ticks_total(run), 9000);
    for (int64_t done = 0; done < 9000; done = bcd_run_ticks_done(run)) {
        int64_t end = done + 750 < 9000 ? done + 750 : 9000;
        assert_int_equal(bcd_run_advance(run, 750, NULL), BCD_OK);
        assert_in_range(bcd_run_ticks_done(run), end, end + 15); /* several realizations at once */
    }
    assert_int_equal(bcd_run_ticks_done(run), 9000);
    bcd_run_free(run);
    bcd_scene_free(with), bcd_scene_free(without);
}

/* Difference between the same noise at h and 2h: far less scattered than two independent runs. */
static void test_pairs_share_their_noise(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{" RODS FIELD "'time_step': 1e-4, 'time': 1, 'realizations': 64, "
                         "'initial': 'equilibrium', 'method': 'elastic', 'observables': {'msd': "
                         "{'first': 0.1, 'last': 0.8, 'points': 3}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "msd");
    for (size_t i = 0; i < t->rows; i++) {
        double independent = column_of(t, BCD_ROLE_STDERR)[i] * 2; /* of 16 pairs, not 64 */
        assert_true(column_of(t, BCD_ROLE_TIME_STEP_ERROR)[i] < 0.5 * independent);
    }
    bcd_table_free(t);
    experiment_end(&e);
}

static void test_steps_too_long(void **state)
{
    (void)state;
    const char *refused = "{\"particles\": 4, \"length\": 8, \"time\": 1, \"time_step\": 0.02, "
                          "\"potential\": {\"type\": \"cosine\", \"amplitude\": 20}, "
                          "\"observables\": {\"energy\": {}}}";
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    assert_int_equal(scene_json_parse(refused, strlen(refused), &scene, &errors), BCD_INVALID);
    assert_string_equal(errors.items[0].field, "/time_step");
    assert_non_null(strstr(errors.items[0].text, "the largest step that works is 0.0025"));

    struct experiment e = experiment_run(
        experiment_scene("{'particles': 4, 'length': 8, 'time': 1, 'time_step': 0.02, 'stability': "
                         "'ignored', 'potential': {'type': 'cosine', 'amplitude': 20}, " ENERGY),
        0);
    assert_true(has_fact(e.scene, "time_step_warning"));
    struct bcd_table *t = experiment_table(&e, "energy");
    assert_non_null(strstr(note_of(t, "time_step_warning"), "melts the profile"));
    bcd_table_free(t);
    experiment_end(&e);
}

/* Automatic steps follow the tolerance, in the power of each method's order. */
static void test_tolerance(void **state)
{
    (void)state;
    static const struct {
        const char *method;
        double factor; /* of the step for an eighth of the tolerance */
    } rows[] = {{"strang", 4}, {"elastic", 8}, {"bcd", 64}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *job = "{" RODS FIELD "'time': 5000, 'tolerance': %g, 'method': '%s', " ENERGY;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        struct bcd_scene *loose = experiment_scene(job, 0.004, rows[i].method),
                         *tight = experiment_scene(job, 0.0005, rows[i].method);
#pragma GCC diagnostic pop
        double factor = experiment_fact(loose, "time_step") / experiment_fact(tight, "time_step");
        assert_true(fabs(factor / rows[i].factor - 1) < 0.02);
        bcd_scene_free(loose), bcd_scene_free(tight);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_where_it_comes_from), cmocka_unit_test(test_why_there_is_none),
        cmocka_unit_test(test_cost),                cmocka_unit_test(test_pairs_share_their_noise),
        cmocka_unit_test(test_steps_too_long),      cmocka_unit_test(test_tolerance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
