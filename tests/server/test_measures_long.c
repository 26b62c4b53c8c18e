/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the automatic choice saves against Brownian cluster dynamics as published, at equal error:
 * the report's own measurements, side by side on this machine. */
#include "report_work_precision.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* One method on one scene; the report is to be freed. */
static struct work_precision *measure(const char *scene, const char *method, double core_seconds)
{
    char reason[WORK_PRECISION_REASON];
    struct work_precision *report = calloc(1, sizeof *report);
    struct work_precision_options options = WORK_PRECISION_DEFAULT;
    options.scene = scene, options.method = method, options.core_seconds = core_seconds;
    assert_non_null(report);
    assert_true(work_precision_known(&options));
    assert_true(work_precision_measure(report, &options, reason));
    return report;
}

static const struct work_precision_result *result_of(const struct work_precision *report)
{
    size_t i = 0;
    while (!report->result[i].scene)
        i++;
    return &report->result[i];
}

/* Cost at which the error is down to `tolerance`, along the fit from the entry with the finest
 * step. */
static double cost_at(const struct work_precision_result *r, enum work_precision_kind kind,
                      double tolerance)
{
    const struct report_fit *fit = &r->method[0].fit[kind];
    const struct work_precision_entry *finest = &r->entry[0];
    for (size_t i = 1; i < r->entry_count; i++)
        finest = r->entry[i].time_step < finest->time_step ? &r->entry[i] : finest;
    assert_true(fit->points >= 2 && fit->order > 0);
    double step = pow(tolerance / fit->factor, 1 / fit->order);
    return finest->cost * finest->time_step / step;
}

static void check_density(const char *scene, double least)
{
    struct work_precision *automatic = measure(scene, "auto", 3), *bcd = measure(scene, "bcd", 3);
    const struct work_precision_entry *entry = &result_of(automatic)->entry[0];
    const struct work_precision_value *l1 = &entry->value[WORK_PRECISION_DENSITY];
    double cost = cost_at(result_of(bcd), WORK_PRECISION_DENSITY, WORK_PRECISION_TOLERANCE);
    printf("# %s: auto L1 %.4f(%.4f) at %.3g ns, bcd %.3g ns for the same: %.0f times\n", scene,
           l1->error, l1->stderror, entry->cost, cost, cost / entry->cost);
    assert_true(l1->error <= WORK_PRECISION_TOLERANCE + 2 * l1->stderror);
    assert_true(cost >= least * entry->cost);
    free(automatic), free(bcd);
}

static void test_density(void **state)
{
    (void)state;
    check_density("sparse", 5);
    check_density("medium", 50);
    check_density("dense", 1000);
}

static void test_drift(void **state)
{
    (void)state;
    const double tolerance = 0.02;
    struct work_precision *strang = measure("medium", "strang", 12),
                          *bcd = measure("medium", "bcd", 12);
    double fast = cost_at(result_of(strang), WORK_PRECISION_DRIFT, tolerance),
           slow = cost_at(result_of(bcd), WORK_PRECISION_DRIFT, tolerance);
    printf("# drift velocity to 2 %%: strang %.3g ns, bcd %.3g ns: %.0f times\n", fast, slow,
           slow / fast);
    assert_true(slow >= 100 * fast);
    free(strang), free(bcd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_density),
        cmocka_unit_test(test_drift),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
