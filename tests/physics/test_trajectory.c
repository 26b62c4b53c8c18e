/* SPDX-License-Identifier: GPL-3.0-or-later
 * Paths of rods against motions known beforehand and against the MSD of the same run; what is asked
 * too much of; and that nothing but the first realization is seen. */
#include "support/experiment.h"

#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct bcd_table *run(struct experiment *e, struct bcd_scene *scene, int64_t slice)
{
    *e = experiment_run(scene, slice);
    return experiment_table(e, "trajectory");
}

/* Rods on a lattice carried by a drag, without noise: x = x0 + f t, round the ring many times, with
 * y moved back by whole lengths on the way. */
static void test_drag(void **state)
{
    (void)state;
    struct experiment e;
    struct bcd_table *table =
        run(&e,
            experiment_scene("{'particles': 5, 'length': 10, 'diameter': 1, 'temperature': 0, "
                             "'initial': 'lattice', 'force': 2.5, 'method': 'bcd', 'time_step': "
                             "0.01, 'equilibration_time': 1, 'time': 2000, 'observables': "
                             "{'trajectory': {'every': 250, 'rods': 3, 'first': 1}}}"),
            0);
    const double *t = column_of(table, BCD_ROLE_X), *x = column_of(table, BCD_ROLE_VALUE),
                 *rod = column_of(table, BCD_ROLE_SERIES);
    assert_int_equal(table->rows, 3 * 9);
    for (size_t i = 0; i < table->rows; i++) {
        assert_true(rod[i] == (double)(1 + i / 9));
        assert_within(t[i], 250 * (double)(i % 9), 0, 0, 1e-9);
        assert_within(x[i] - x[0], 2 * (rod[i] - 1) + 2.5 * t[i], 0, 0, 1e-6);
    }
    bcd_table_free(table);
    experiment_end(&e);
}

/* One rod and every step of it: squared displacements from all origins are the run's MSD. */
static void test_against_msd(void **state)
{
    (void)state;
    struct experiment e;
    struct bcd_table *table =
        run(&e,
            experiment_scene("{'particles': 1, 'length': 1, 'temperature': 1, 'method': 'bcd', "
                             "'potential': {'type': 'cosine', 'amplitude': 4}, 'time_step': 0.002, "
                             "'time': 2, 'time_step_error': 'skipped', 'observables': "
                             "{'trajectory': {'every': 0.002}, "
                             "'msd': {'first': 0.004, 'last': 0.004, 'points': 1}}}"),
            0);
    struct bcd_table *msd = experiment_table(&e, "msd");
    const double *x = column_of(table, BCD_ROLE_VALUE);
    assert_int_equal(table->rows, 1001);
    const double origins = column_of(msd, BCD_ROLE_OTHER)[0];
    double stride = rint(999 / origins), sum = 0, n = 0;
    for (size_t i = 0; i + 2 < 1001; i += (size_t)stride, n++)
        sum += (x[i + 2] - x[i]) * (x[i + 2] - x[i]);
    /* Blocks are averaged block by block: equal up to origins that lie across their borders. */
    assert_within(column_of(msd, BCD_ROLE_VALUE)[0], sum / n, 0, 0, 0.02 * sum / n);
    bcd_table_free(table), bcd_table_free(msd);
    experiment_end(&e);
}

#define CROWD                                                                                      \
    "'particles': 12, 'length': 12, 'diameter': 0.8, 'potential': {'type': 'cosine', "             \
    "'amplitude': 6}, 'method': 'strang', 'time_step': 0.001, 'time': 1, 'seed': 5, "

/* Hard rods never come closer than their length; blocks, realizations and slices change nothing. */
static void test_one_path_of_many(void **state)
{
    (void)state;
    static const char *const others[] = {"1", "3", "40"};
    static const int64_t slices[] = {0, 7, 0};
    struct bcd_table *tables[3];
    struct experiment e[3];
    for (int i = 0; i < 3; i++)
        tables[i] = run(&e[i],
                        experiment_scene("{" CROWD "'realizations': %s, 'observables': "
                                         "{'trajectory': {'every': 0.01}}}",
                                         others[i]),
                        slices[i]);
    const size_t points = 101;
    assert_int_equal(tables[0]->rows, 12 * points);
    const double *x = column_of(tables[0], BCD_ROLE_VALUE);
    for (int i = 1; i < 3; i++)
        assert_memory_equal(x, column_of(tables[i], BCD_ROLE_VALUE),
                            12 * points * sizeof *x);
    for (size_t i = 0; i < 11 * points; i++)
        assert_true(x[i + points] - x[i] >= 0.8 - 1e-12);
    assert_null(bcd_table_column(tables[0], BCD_ROLE_STDERR)->values);
    assert_true(strlen(bcd_table_column(tables[0], BCD_ROLE_STDERR)->reason) > 0);
    assert_null(bcd_table_column(tables[0], BCD_ROLE_TIME_STEP_ERROR)->values);
    for (int i = 0; i < 3; i++) {
        bcd_table_free(tables[i]);
        experiment_end(&e[i]);
    }
}

/* A run cut in the middle and taken up again from its checkpoint draws the same path. */
static void test_checkpoint(void **state)
{
    (void)state;
    struct bcd_scene *scene =
        experiment_scene("{" CROWD "'observables': {'trajectory': {'every': 0.005, 'rods': 4}}}");
    struct bcd_run *whole = NULL, *half = NULL, *rest = NULL;
    assert_int_equal(bcd_run_create(&whole, scene, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&half, scene, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&rest, scene, 0, NULL), BCD_OK);
    int64_t total = bcd_run_ticks_total(whole);
    assert_int_equal(bcd_run_advance(whole, total, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(half, total / 2 + 3, NULL), BCD_OK);
    size_t size = bcd_run_checkpoint_size(half);
    void *bytes = malloc(size);
    assert_non_null(bytes);
    bcd_run_save(half, bytes);
    assert_int_equal(bcd_run_restore(rest, bytes, size, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(rest, total, NULL), BCD_OK);
    size_t length = bcd_tally_size(bcd_run_tally(whole));
    void *one = malloc(length), *other = malloc(length);
    assert_true(one && other);
    bcd_tally_save(bcd_run_tally(whole), one);
    bcd_tally_save(bcd_run_tally(rest), other);
    assert_memory_equal(one, other, length);
    free(bytes), free(one), free(other);
    bcd_run_free(whole), bcd_run_free(half), bcd_run_free(rest);
    bcd_scene_free(scene);
}

/* The first fault of a job, "" when there is none. */
static struct bcd_error refusal(const char *trajectory)
{
    char text[1024];
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    snprintf(text, sizeof text,
             "{\"particles\":1000,\"length\":2000,\"time\":10,\"time_step\":0.001,"
             "\"observables\":{\"trajectory\":%s}}",
             trajectory);
    if (scene_json_parse(text, strlen(text), &scene, &errors) == BCD_OK)
        errors.items[0] = (struct bcd_error){0};
    bcd_scene_free(scene);
    return errors.items[0];
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *asked, *field, *words;
    } cases[] = {
        {"{}", "/observables/trajectory/every", ""},
        {"{\"every\":0}", "/observables/trajectory/every", ""},
        {"{\"every\":0.0005}", "/observables/trajectory/every", "below the time step 0.001"},
        {"{\"every\":0.0025}", "/observables/trajectory/every", "whole multiple"},
        {"{\"every\":11}", "/observables/trajectory/every", "measured time 10"},
        {"{\"every\":1,\"first\":1000}", "/observables/trajectory/first", "particles = 1000"},
        {"{\"every\":1,\"first\":990,\"rods\":11}", "/observables/trajectory/rods", "= 10"},
        {"{\"every\":0.01,\"rods\":1000}", "/observables/trajectory/rods",
         "at most 199 rods, or every at least 0.051"},
        {"{\"every\":0.051,\"rods\":1000}", "", ""},
        {"{\"every\":0.05,\"rods\":1000}", "/observables/trajectory/rods", "at most 995"},
        {"{\"every\":0.01,\"rods\":199}", "", ""},
        {"{\"every\":0.01,\"rods\":200}", "/observables/trajectory/rods", "at most 199"},
        {"{\"every\":0.0123}", "", ""}, /* as many rods as fit */
        {"{\"every\":10}", "", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bcd_error error = refusal(cases[i].asked);
        if (strcmp(error.field, cases[i].field) != 0 || !strstr(error.text, cases[i].words))
            fail_msg("%s: %s: %s", cases[i].asked, error.field, error.text);
    }
}

/* 10^5 moments and more of one rod: the shortest `every` that fits is named, and fits. */
static void test_too_many_moments(void **state)
{
    (void)state;
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    const char *job = "{\"particles\":2,\"length\":4,\"time\":1000,\"time_step\":0.001,"
                      "\"observables\":{\"trajectory\":{\"every\":0.001}}}";
    assert_int_equal(scene_json_parse(job, strlen(job), &scene, &errors), BCD_INVALID);
    assert_string_equal(errors.items[0].field, "/observables/trajectory/every");
    assert_non_null(strstr(errors.items[0].text, "at least 0.006"));
    bcd_scene_free(scene);
    scene = experiment_scene("{'particles': 2, 'length': 4, 'time': 1000, 'time_step': 0.001, "
                             "'observables': {'trajectory': {'every': 0.006}}}");
    struct bcd_estimate with;
    bcd_scene_estimate(scene, &with);
    assert_true(with.result_bytes < 2e7);
    bcd_scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drag),           cmocka_unit_test(test_against_msd),
        cmocka_unit_test(test_one_path_of_many), cmocka_unit_test(test_checkpoint),
        cmocka_unit_test(test_refusals),       cmocka_unit_test(test_too_many_moments),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
