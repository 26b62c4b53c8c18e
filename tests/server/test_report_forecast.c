/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_report_forecast.c - report_forecast.h beside what the jobs then have, and where it must not
 * say anything. The errors of either have an error of a tenth or so; they agree within a factor of
 * two, and the bound here is three. */
#include "desk.h"
#include "report_forecast.h"
#include "report_run.h"
#include "scene_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct forecast foretell(const char *job)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    struct forecast forecast;
    if (scene_json_parse(job, strlen(job), &scene, &errors) != BCD_OK)
        fail_msg("%s: %s", errors.items[0].field, errors.items[0].text);
    report_forecast(scene, NULL, &forecast);
    bcd_scene_free(scene);
    return forecast;
}

static const struct forecast_row *row_of(const struct forecast *forecast, const char *observable)
{
    for (size_t i = 0; i < forecast->count; i++)
        if (strcmp(forecast->row[i].observable, observable) == 0)
            return &forecast->row[i];
    fail_msg("no %s", observable);
    return NULL;
}

/* What report_forecast.h calls the relative error; of msd when `shares`. */
static double error_of(const struct report_run *run, const char *observable, bool shares)
{
    struct bcd_table *table = report_run_table(run, NULL, observable);
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const struct bcd_column *error = bcd_table_column(table, BCD_ROLE_STDERR);
    double errors = 0, values = 0;
    for (size_t i = 0; i < table->rows; i++) {
        double unit = shares ? value->values[i] : 1;
        errors += pow(error->values[i] / unit, 2);
        values += pow(value->values[i] / unit, 2);
    }
    bcd_table_free(table);
    return sqrt(errors / values);
}

/* The job itself is run with other random numbers than the sample. */
static void assert_foretold(const char *job, bool whole)
{
    static const char *const names[] = {"msd", "density", "energy"};
    struct forecast forecast = foretell(job);
    char other[600];
    snprintf(other, sizeof other, "{\"seed\":8,%s", job + 1);
    struct report_run run = {0};
    assert_int_equal(report_run_job(&run, other), REPORT_DONE);
    double time = bcd_group_number(bcd_scene_job_view(run.scene),
                                   bcd_group_find(bcd_scene_job_view(run.scene), "time"));
    assert_int_equal(forecast.count, 3);
    assert_true(forecast.realizations >= 12);
    assert_true(whole ? forecast.time == time : forecast.time < 0.7 * time);
    for (size_t i = 0; i < 3; i++) {
        const struct forecast_row *row = row_of(&forecast, names[i]);
        double real = error_of(&run, names[i], i == 0);
        assert_string_equal(row->reason, "");
        print_message("%s: %.3g foretold, %.3g found\n", names[i], row->relative, real);
        if (!(row->relative > real / 3 && row->relative < 3 * real))
            fail_msg("%s: %g foretold, %g found", names[i], row->relative, real);
    }
    report_run_fini(&run);
}

#define WELLS "\"potential\":{\"type\":\"cosine\",\"amplitude\":4},\"initial\":\"equilibrium\","

static void of_a_sample_shorter_than_the_job(void **state)
{
    (void)state;
    assert_foretold("{\"particles\":40,\"length\":50,\"diameter\":0.5," WELLS
                    "\"time\":100,\"realizations\":8,\"observables\":{\"msd\":{\"first\":0.01,"
                    "\"last\":0.5,\"points\":12},\"density\":{\"bins\":20},\"energy\":{}}}",
                    false);
}

static void of_one_as_long(void **state)
{
    (void)state;
    assert_foretold("{\"particles\":4,\"length\":8,\"diameter\":0.5," WELLS
                    "\"time\":3,\"realizations\":40,\"observables\":{\"msd\":{\"first\":0.01,"
                    "\"points\":5},\"density\":{\"bins\":20},\"energy\":{}}}",
                    true);
}

/* Four times the time halves what is foretold, whatever the sample was. */
static void falls_with_the_root_of_the_time(void **state)
{
    static const char *const times[] = {"400", "1600"};
    double error[2];
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        char job[400] = "{\"particles\":40,\"length\":50,\"diameter\":0.5," WELLS
                        "\"realizations\":4,\"observables\":{\"density\":{\"bins\":20}},\"time\":";
        strcat(strcat(job, times[i]), "}");
        struct forecast forecast = foretell(job);
        error[i] = forecast.row[0].relative;
    }
    assert_true(error[1] > 0);
    if (fabs(error[0] / error[1] - 2) > 0.4)
        fail_msg("%g, %g", error[0], error[1]);
}

static void says_why_not(void **state)
{
    struct forecast forecast =
        foretell("{\"particles\":40,\"length\":50,\"diameter\":0.5," WELLS
                 "\"time\":1000,\"realizations\":4,\"observables\":{\"msd\":{\"last\":500},"
                 "\"density\":{},\"current\":{},\"trajectory\":{\"every\":1}}}");
    (void)state;
    assert_true(row_of(&forecast, "density")->relative > 0);
    for (size_t i = 0; i < 3; i++) {
        const char *name = (const char *[]){"msd", "current", "trajectory"}[i];
        assert_true(isnan(row_of(&forecast, name)->relative));
        assert_true(strlen(row_of(&forecast, name)->reason) > 10);
    }
    forecast = foretell("{\"particles\":1000000,\"length\":2000000,\"diameter\":0.5,"
                        "\"potential\":{\"type\":\"cosine\",\"amplitude\":4},\"time\":100,"
                        "\"observables\":{\"energy\":{}}}");
    assert_string_equal(forecast.row[0].reason, "its steps cost too much for a sample");
    assert_int_equal(forecast.realizations, 0);
}

/* Nobody waits any more, or the server stops. */
static void told_to_stop(void **state)
{
    const char *job = "{\"particles\":4,\"length\":8,\"time\":5,\"observables\":{\"density\":{}}}";
    const atomic_int stop = 1;
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    struct forecast forecast;
    (void)state;
    assert_int_equal(scene_json_parse(job, strlen(job), &scene, &errors), BCD_OK);
    report_forecast(scene, &stop, &forecast);
    bcd_scene_free(scene);
    assert_true(isnan(row_of(&forecast, "density")->relative));
    assert_string_equal(forecast.row[0].reason, "a sample of it does not end in time");
    assert_true(forecast.core_seconds == 0);
}

static void over_http(void **state)
{
    struct desk *f = *state;
    assert_int_equal(
        ask(f, "POST", "/v1/forecast",
            "{\"particles\":4,\"length\":8,\"diameter\":0.5,\"time\":5,"
            "\"observables\":{\"density\":{\"bins\":4},\"trajectory\":{\"every\":0.1}}}"),
        200);
    assert_says(f, "{\"observables\":{\"density\":{\"relative_error\":0.");
    assert_says(f, "\"trajectory\":{\"relative_error\":null,\"reason\":\"");
    assert_says(f, "\"sample\":{\"realizations\":");
    assert_int_equal(ask(f, "POST", "/v1/forecast", "{\"particles\":4}"), 422);
    assert_int_equal(ask(f, "POST", "/v1/forecast",
                         "{\"particles\":100000,\"length\":200000,\"time\":1e9,"
                         "\"time_step\":1e-3,\"observables\":{\"energy\":{}},"
                         "\"potential\":{\"type\":\"cosine\",\"amplitude\":4}}"),
                     422);
    assert_int_equal(ask(f, "GET", "/v1/forecast", NULL), 405);
}

static int set_up(void **state)
{
    *state = calloc(1, sizeof(struct desk));
    return *state ? desk_open(*state) : -1;
}

static int tear_down(void **state)
{
    desk_close(*state);
    free(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_a_sample_shorter_than_the_job),
        cmocka_unit_test(of_one_as_long),
        cmocka_unit_test(falls_with_the_root_of_the_time),
        cmocka_unit_test(says_why_not),
        cmocka_unit_test(told_to_stop),
        cmocka_unit_test_setup_teardown(over_http, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
