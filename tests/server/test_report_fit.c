/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_report_fit.c - power laws through errors: exact ones are found, noise is left out. */
#include "report_fit.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void an_exact_law_is_found(void **state)
{
    struct report_point points[4];
    (void)state;
    for (int i = 0; i < 4; i++) {
        double step = pow(3, -i);
        points[i] = (struct report_point){step, (i % 2 ? -0.2 : 0.2) * pow(step, 1.5), 1e-9};
    }
    struct report_fit fit = report_fit_power(points, 4);
    assert_int_equal(fit.points, 4);
    assert_true(fabs(fit.order - 1.5) < 1e-12);
    assert_true(fabs(fit.factor - 0.2) < 1e-12);
    /* Each point's logarithm is taken to be sure to 0.1; ln 3 apart. */
    assert_true(fabs(fit.order_stderror - 0.1 / (log(3) * sqrt(5))) < 1e-6);
}

static void noise_is_left_out(void **state)
{
    const struct report_point points[] = {
        {1, 1, 0.01}, {0.5, 0.5, 0.01}, {0.25, 7, 3.6}, {0.1, NAN, NAN}, {0.1, 0.1, NAN}};
    (void)state;
    struct report_fit fit = report_fit_power(points, 5);
    assert_int_equal(fit.points, 2);
    assert_true(fabs(fit.order - 1) < 1e-12);
}

static void one_step_tells_no_order(void **state)
{
    const struct report_point points[] = {{1, 1, 0.01}, {1, 2, 0.01}};
    (void)state;
    assert_true(isnan(report_fit_power(points, 1).order));
    assert_true(isnan(report_fit_power(points, 0).order));
    assert_true(isnan(report_fit_power(points, 2).order));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_exact_law_is_found),
        cmocka_unit_test(noise_is_left_out),
        cmocka_unit_test(one_step_tells_no_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
