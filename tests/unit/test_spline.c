/* SPDX-License-Identifier: GPL-3.0-or-later
 * Splines: through their points, smooth, exact for cubics, of fourth order for a wave. */
#include "kernels/spline.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { MOST = 1030 };

static void assert_close(double value, double expected, double slack)
{
    if (!(fabs(value - expected) <= slack))
        fail_msg("%.17g, not %.17g +- %g", value, expected, slack);
}

static double cubic(double x)
{
    return 1 - 2 * x + 0.5 * x * x - 0.25 * x * x * x;
}

static void test_open_splines_are_exact_for_cubics(void **state)
{
    (void)state;
    double values[MOST];
    for (size_t count = 4; count < 12; count++) {
        struct spline s;
        for (size_t i = 0; i < count; i++)
            values[i] = cubic(-1 + 0.3 * (double)i);
        assert_true(spline_open(&s, -1, 0.3, values, count));
        for (double x = -1.5; x < 3; x += 0.037) { /* beyond the ends as well */
            double slack = 1e-11 * (1 + x * x);
            assert_close(spline_at(&s, x, 0), cubic(x), slack);
            assert_close(spline_at(&s, x, 1), -2 + x - 0.75 * x * x, slack);
            assert_close(spline_at(&s, x, 2), 1 - 1.5 * x, slack * 10);
        }
        double end = -1 + 0.3 * (double)(count - 1);
        assert_close(spline_curvature_max(&s), fmax(2.5, fabs(1 - 1.5 * end)), 1e-10);
        spline_free(&s);
        spline_free(&s); /* twice is once */
    }
}

static void test_three_points_are_a_parabola(void **state)
{
    (void)state;
    const double values[] = {1, 0, 1};
    struct spline s;
    assert_true(spline_open(&s, -1, 1, values, 3));
    for (double x = -1; x <= 1; x += 0.1)
        assert_close(spline_at(&s, x, 0), x * x, 1e-15);
    spline_free(&s);
}

/* Values, first and second derivative go on continuously at every point and across the seam. */
static void check_smooth(const struct spline *s, const double *values)
{
    for (size_t k = 0; k < s->pieces; k++) {
        const double *a = s->c + 4 * k, *b = s->c + 4 * ((k + 1) % s->pieces);
        assert_close(a[0], values[k], 0);
        assert_close(a[0] + a[1] + a[2] + a[3], b[0], 1e-12);
        assert_close(a[1] + 2 * a[2] + 3 * a[3], b[1], 1e-12);
        assert_close(2 * a[2] + 6 * a[3], 2 * b[2], 1e-11);
    }
}

static void test_periodic_splines_are_smooth(void **state)
{
    (void)state;
    double values[MOST];
    uint64_t seed = 1;
    for (size_t count = 3; count < MOST; count = count * 3 / 2 + 1) {
        for (size_t i = 0; i < count; i++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            values[i] = (double)(seed >> 11) * 0x1p-52 - 1;
        }
        struct spline s;
        assert_true(spline_periodic(&s, 0.7, 0.01, values, count));
        check_smooth(&s, values);
        double period = 0.01 * (double)count;
        for (double x = 0.7; x < 0.7 + period; x += period / 17) {
            assert_close(spline_at(&s, x + 3 * period, 0), spline_at(&s, x, 0), 1e-9);
            assert_close(spline_at(&s, x - 5 * period, 1), spline_at(&s, x, 1), 1e-7);
        }
        spline_free(&s);
    }
}

/* Largest errors of value, slope and curvature of a cosine: 4th, 3rd and 2nd order. */
static void wave_errors(size_t count, double error[3])
{
    double values[MOST];
    struct spline s;
    for (size_t i = 0; i < count; i++)
        values[i] = cos(2 * M_PI * (double)i / (double)count);
    assert_true(spline_periodic(&s, 0, 1 / (double)count, values, count));
    error[0] = error[1] = error[2] = 0;
    for (double x = -1; x < 1; x += 1.0 / 7919) {
        double k = 2 * M_PI;
        error[0] = fmax(error[0], fabs(spline_at(&s, x, 0) - cos(k * x)));
        error[1] = fmax(error[1], fabs(spline_at(&s, x, 1) + k * sin(k * x)));
        error[2] = fmax(error[2], fabs(spline_at(&s, x, 2) + k * k * cos(k * x)));
    }
    assert_close(spline_curvature_max(&s), 4 * M_PI * M_PI, 20 / (double)(count * count) * 40);
    spline_free(&s);
}

static void test_orders(void **state)
{
    (void)state;
    double coarse[3], fine[3];
    wave_errors(32, coarse);
    wave_errors(64, fine);
    assert_close(log2(coarse[0] / fine[0]), 4, 0.1);
    assert_close(log2(coarse[1] / fine[1]), 3, 0.1);
    assert_close(log2(coarse[2] / fine[2]), 2, 0.1);
    assert_true(fine[0] < 1e-6);
}

/* The vectorised loops are spline_at, also far away and beyond the ends. */
static void check_many(const struct spline *s)
{
    enum { POINTS = 601 };
    double y[POINTS], out[POINTS], sum = 0, scale = 0;
    for (int i = 0; i < POINTS; i++)
        y[i] = -3 + 0.0113 * i, out[i] = 1;
    struct spline_points points = {y, POINTS, 0.002, NULL, 0};
    spline_add_slope(s, &points, -2, out);
    for (int i = 0; i < POINTS; i++) {
        double x = y[i] + i * 0.002, slope = spline_at(s, x, 1);
        assert_close(out[i], 1 - 2 * slope, 1e-11 * (1 + fabs(slope)));
        sum += spline_at(s, x, 0);
        scale += fabs(spline_at(s, x, 0));
    }
    assert_close(spline_sum(s, &points), sum, 1e-12 * scale);
}

static void test_many_points_at_once(void **state)
{
    (void)state;
    const double values[] = {0, 3, 1, -2, 0.5, 0.25};
    struct spline s;
    assert_true(spline_periodic(&s, 0.1, 0.25, values, 6));
    check_many(&s);
    spline_free(&s);
    assert_true(spline_open(&s, 0.1, 0.25, values, 6));
    check_many(&s);
    spline_free(&s);
}

/* No place is outside memory, wherever x is. */
static void test_nonsense_places(void **state)
{
    (void)state;
    static const double nonsense[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e18, -1e-320};
    const double values[] = {0, 3, 1, -2};
    for (int periodic = 0; periodic < 2; periodic++) {
        struct spline s;
        assert_true(periodic ? spline_periodic(&s, 0, 1, values, 4)
                             : spline_open(&s, 0, 1, values, 4));
        for (size_t i = 0; i < sizeof nonsense / sizeof *nonsense; i++) {
            struct spline_points one = {nonsense + i, 1, 0, NULL, 0};
            double out = 0, sum = spline_sum(&s, &one);
            spline_add_slope(&s, &one, 1, &out);
            assert_int_equal(isnan(spline_at(&s, nonsense[i], 0)), isnan(sum));
        }
        spline_free(&s);
    }
    struct spline s;
    assert_false(spline_periodic(&s, 0, 1, values, 2));
    assert_false(spline_open(&s, 0, 1, values, 2));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_open_splines_are_exact_for_cubics),
        cmocka_unit_test(test_three_points_are_a_parabola),
        cmocka_unit_test(test_periodic_splines_are_smooth),
        cmocka_unit_test(test_orders),
        cmocka_unit_test(test_many_points_at_once),
        cmocka_unit_test(test_nonsense_places),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
