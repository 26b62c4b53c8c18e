/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_report_stability.c - report_stability.h: what is measured, stopped and printed. Whether the
 * verdicts are right: tests/api/reports.sh, report_long.sh. */
#include "report_run.h"
#include "report_stability.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t count_of(const char *text, const char *part)
{
    size_t count = 0;
    for (const char *c = strstr(text, part); c; c = strstr(c + 1, part))
        count++;
    return count;
}

static size_t count_methods(void)
{
    size_t count = 0;
    while (report_run_method(count + 1))
        count++;
    return count;
}

static void note(void *context, const struct stability *so_far)
{
    size_t *seen = context;
    assert_int_equal(so_far->count, ++*seen);
}

static void every_method_once(void **state)
{
    struct stability *report = calloc(1, sizeof *report);
    size_t seen = 0, methods = count_methods();
    const struct stability_options options = {.only = "ell < 0", .found = note, .context = &seen};
    (void)state;
    assert_true(methods > 5);
    assert_true(stability_measure(report, &options));
    assert_int_equal(report->count, methods);
    assert_int_equal(report->planned, methods);
    assert_int_equal(seen, methods);
    assert_int_equal(report->failed, 0);
    for (size_t i = 0; i < methods; i++) {
        assert_string_equal(report->entry[i].method, report_run_method(i + 1));
        assert_int_equal(report->entry[i].result.verdict, STABILITY_REFUSED);
        assert_true(strlen(report->entry[i].result.words) > 10);
    }
    char *csv = stability_print_csv(report), *svg = stability_print_svg(report);
    assert_int_equal(count_of(csv, "\r\n"), methods + 1);
    assert_int_equal(count_of(csv, "\"ell < 0\",bcd,refused,,,,0,"), 1);
    assert_int_equal(count_of(svg, "<title>ell &#60; 0, "), methods);
    assert_null(strstr(svg, "ell < 0"));
    free(csv);
    free(svg);
    free(report);
}

/* What failed is marked, and counted; numbers that are none are null; text stays text. */
static void prints_what_it_holds(void **state)
{
    static const struct stability_extreme extreme = {
        .name = "a \"b\"", .members = "\"particles\":1", .bound = INFINITY};
    struct stability *report = calloc(1, sizeof *report);
    (void)state;
    report->count = report->planned = 2;
    report->failed = 1;
    report->entry[0] = (struct stability_entry){
        &extreme, "bcd", {.verdict = STABILITY_MELTED, .off = -2.5, .stderror = NAN}};
    report->entry[1] = (struct stability_entry){
        &extreme, "tao", {.verdict = STABILITY_RAN, .off = NAN, .words = "say \"why\""}};
    char *json = stability_print_json(report), *csv = stability_print_csv(report);
    char *svg = stability_print_svg(report);
    assert_non_null(strstr(json, "{\"extreme\":\"a \\\"b\\\"\",\"method\":\"bcd\",\"verdict\":"
                                 "\"MELTED\",\"failed\":true,\"off\":-2.5,\"stderr\":null,"));
    assert_non_null(strstr(json, "\"bound\":null"));
    assert_non_null(strstr(json, "\"reason\":\"say \\\"why\\\"\",\"job\":{\"particles\":1}}"));
    assert_non_null(strstr(json, "],\"tried\":2,\"failed\":1,\"interrupted\":false}"));
    assert_non_null(strstr(csv, "\"a \"\"b\"\"\",bcd,MELTED,-2.5,,"));
    assert_non_null(strstr(csv, ",\"say \"\"why\"\"\"\r\n"));
    assert_int_equal(count_of(svg, "\xE2\x9C\x95 -2"), 1);
    assert_non_null(strstr(svg, "failed: 1 of 2"));
    free(json);
    free(csv);
    free(svg);
    free(report);
}

static void stops(void **state)
{
    static const atomic_int at_once = 1;
    struct stability *report = calloc(1, sizeof *report);
    const struct stability_options options = {.stop = &at_once};
    (void)state;
    assert_false(stability_measure(report, &options));
    assert_int_equal(report->count, 0);
    assert_true(report->planned > 100 && report->planned < STABILITY_ENTRIES_MAX);
    free(report);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_method_once),
        cmocka_unit_test(prints_what_it_holds),
        cmocka_unit_test(stops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
