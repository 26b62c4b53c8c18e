/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store_reports.c - store_reports.h against what it promises. */
#include "store_bench.h"

#include "store_reports.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static void assert_kept(struct store *store, const struct report_new *which, const char *json)
{
    char *text = NULL;
    assert_int_equal(store_reports_get(store, which, REPORT_JSON, &text), STORE_OK);
    assert_string_equal(text, json);
    free(text);
}

static void one_of_each_name_version_and_machine(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct report_new report = {"work", "1", "{}", {"json", "csv", "svg"}};
    char *text = NULL;

    assert_int_equal(store_reports_get(store, &report, REPORT_JSON, &text), STORE_NOT_FOUND);
    assert_int_equal(store_reports_put(store, &report), STORE_OK);
    assert_kept(store, &report, "json");
    assert_int_equal(store_reports_get(store, &report, REPORT_SVG, &text), STORE_OK);
    assert_string_equal(text, "svg");
    free(text);
    report.form[REPORT_JSON] = "again";
    assert_int_equal(store_reports_put(store, &report), STORE_OK);
    assert_kept(store, &report, "again");
    assert_int_equal(bench_number(store, "SELECT count(*) FROM reports"), 1);
    report.version = "2";
    assert_int_equal(store_reports_get(store, &report, REPORT_CSV, &text), STORE_NOT_FOUND);
    report.version = "1";
    report.machine = "other";
    assert_int_equal(store_reports_get(store, &report, REPORT_CSV, &text), STORE_NOT_FOUND);
}

/* Nothing is changed when a form is missing. */
static void all_forms_or_nothing(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct report_new report = {"work", "1", "{}", {"json", "csv", "svg"}};

    assert_int_equal(store_reports_put(store, &report), STORE_OK);
    report.form[REPORT_JSON] = "new";
    report.form[REPORT_SVG] = NULL;
    assert_int_equal(store_reports_put(store, &report), STORE_BROKEN);
    assert_kept(store, &report, "json");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(one_of_each_name_version_and_machine, bench_set_up,
                                        bench_tear_down),
        cmocka_unit_test_setup_teardown(all_forms_or_nothing, bench_set_up, bench_tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
