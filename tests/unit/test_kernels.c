/* SPDX-License-Identifier: GPL-3.0-or-later
 * Small kernels against plain loops and the C library: elementary functions, histogram, sums. */
#include "kernels/elementary.h"
#include "kernels/histogram.h"
#include "kernels/sums.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static void assert_close(double value, double expected, double relative)
{
    if (fabs(value - expected) <= relative * fabs(expected))
        return;
    fail_msg("%.17g, not %.17g", value, expected);
}

static void test_powers(void **state)
{
    (void)state;
    for (double x = 1e-15; x <= 1e15; x *= 3.7)
        for (double a = 0; a < 20; a += 0.37)
            assert_close(power(x, a), pow(x, a), 1e-13);
    assert_true(power(0.5, 0) == 1 && power(4, 0.5) == 2 && power(3, 1) == 3);
    /* Below the smallest numbers a power is 0, not whatever its exponent wraps round to. */
    for (double x = 1e-300; x < 1; x *= 10)
        for (double a = 0; a <= 100; a += 0.7)
            assert_true(fabs(power(x, a) - pow(x, a)) <= 1e-12 * pow(x, a) + 1e-304);
}

static void test_logarithms_and_waves(void **state)
{
    (void)state;
    for (double x = 1e-300; x < 1e300; x *= 1.9)
        assert_close(log_normal(x), log(x), 1e-15);
    for (double u = -3; u <= 3; u += 0.0371) {
        assert_true(fabs(sin_turns(u) - sin(2 * M_PI * u)) < 1e-14);
        assert_true(fabs(cos_turns(u) - cos(2 * M_PI * u)) < 1e-14);
        assert_true(fabs(sin_turns(u + 0x1p40) - sin_turns(u)) < 1e-3);
    }
    assert_true(sin_turns(0.25) == 1 && cos_turns(0.5) == -1 && sin_turns(7) == 0);
}

enum { BINS = 7, RODS = 1001 };

/* Rod i at y[i] + i * diameter, folded into [0, period). */
static void test_histogram(void **state)
{
    (void)state;
    const double period = 2.5, diameter = 0.3;
    const struct fold fold = {1 / period, BINS, false};
    double y[RODS];
    int64_t counts[BINS] = {0}, expected[BINS] = {0}, total = 0;
    for (int i = 0; i < RODS; i++) {
        y[i] = fmod(i * 7.31, 400) - 200 + 1e-3;
        double x = y[i] + i * diameter, u = x / period - floor(x / period);
        int64_t bin = (int64_t)(u * BINS);
        expected[bin]++;
        assert_int_equal(fold_bin(&fold, x), bin);
    }
    histogram_add(counts, &fold, y, RODS, diameter);
    for (int b = 0; b < BINS; b++) {
        assert_int_equal(counts[b], expected[b]);
        total += counts[b];
    }
    assert_int_equal(total, RODS);
}

/* Whatever stands in y, nothing outside the bins is touched. */
static void test_histogram_of_nonsense(void **state)
{
    (void)state;
    static const double nonsense[] = {0x1.cp53, -0x1.cp53, 0x1p53,    -0x1p54, 1e15,
                                      1e300,    -1e300,    -INFINITY, NAN,     -1e-17};
    const struct fold fold = {1, BINS, false};
    int64_t counts[BINS] = {0}, total = 0;
    for (size_t i = 0; i < sizeof nonsense / sizeof *nonsense; i++) {
        for (double shift = 0; shift < 100; shift += 0.5) {
            double y = nonsense[i] + shift;
            int64_t bin = fold_bin(&fold, y);
            assert_true(bin >= 0 && bin < BINS);
        }
        double row[RODS];
        for (int j = 0; j < RODS; j++)
            row[j] = nonsense[i];
        histogram_add(counts, &fold, row, RODS, 0.5);
        total += RODS;
    }
    for (int b = 0; b < BINS; b++)
        total -= counts[b];
    assert_int_equal(total, 0);
}

static void test_sums(void **state)
{
    (void)state;
    double y[RODS], from[RODS];
    for (int i = 0; i < RODS; i++) {
        y[i] = i * 0.5;
        from[i] = i * 0.25;
    }
    for (int64_t n = 0; n < 40; n++) {
        double plain = 0, square = 0;
        for (int64_t i = 0; i < n; i++) {
            plain += y[i];
            square += (y[i] - from[i] + 3) * (y[i] - from[i] + 3);
        }
        assert_true(sum_plain(y, n) == plain); /* quarters: exact */
        assert_true(sum_squared_displacement(y, from, n, 3) == square);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_powers),    cmocka_unit_test(test_logarithms_and_waves),
        cmocka_unit_test(test_histogram), cmocka_unit_test(test_histogram_of_nonsense),
        cmocka_unit_test(test_sums),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
