/* SPDX-License-Identifier: GPL-3.0-or-later
 * A thousand million normals, named as a job names them: two streams of four realizations, tick by
 * tick. Moments, Kolmogorov-Smirnov and chi-square far into the tails; and pairs of normals whose
 * names differ in one thing, counted in a chessboard of bins: any dependence shows there, not only
 * a linear one. Seeds are fixed, bounds come from each statistic's own law. */
#include "kernels/normals.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>

enum {
    RODS = 4096,
    REALIZATIONS = 4,
    STREAMS = 2,
    ROWS = REALIZATIONS * STREAMS, /* row: stream * REALIZATIONS + realization */
    TICKS = 30518,                 /* x ROWS x RODS = 1.00001e9 */
    ORDERS = 8,
    FINE = 1 << 15, /* bins of 1/2048 out to +-8 */
    SIDE = 16,      /* of the chessboard: bins of 3/8 out to +-2.625 and one beyond */
    ROD_PAIRS = 6,
    PAIRS = ROD_PAIRS + 3,
};

static const double total = (double)TICKS * ROWS * RODS;
static const int rod_lags[ROD_PAIRS] = {1, 2, 3, 4, 256, 1000};
static const char *const pair_names[PAIRS] = {"rod + 1",    "rod + 2", "rod + 3",         "rod + 4",
                                              "rod + 256",  "rod + 1000", "tick + 1",
                                              "realization + 1", "stream + 1"};

struct draws {
    double normal[RODS];
    uint8_t bin[2][ROWS][RODS]; /* of this tick and the last one, by turns */
    double sum[ORDERS + 1];
    double largest;
    int64_t fine[FINE];
    int64_t board[PAIRS][SIDE * SIDE], pairs[PAIRS];
};

/* Five standard errors: passed by chance with probability 6e-7. */
static void check_five_sigma(const char *what, double value, double expected, double error)
{
    if (!(fabs(value - expected) <= 5 * error))
        fail_msg("%s: %.10g, expected %.10g +- %g", what, value, expected, error);
}

static void add_moments(struct draws *d)
{
    double sum[ORDERS + 1] = {0};
    for (int i = 0; i < RODS; i++) {
        double power = 1;
        for (int m = 1; m <= ORDERS; m++)
            sum[m] += power *= d->normal[i];
        d->largest = fmax(d->largest, fabs(d->normal[i]));
    }
    for (int m = 1; m <= ORDERS; m++)
        d->sum[m] += sum[m];
}

static void add_bins(struct draws *d, uint8_t *bin)
{
    for (int i = 0; i < RODS; i++) {
        double x = d->normal[i];
        d->fine[(int)((x + 8) * (FINE / 16))]++; /* |x| < 6.77: inside */
        bin[i] = (uint8_t)((fmin(fmax(x, -2.7), 2.7) + 3) * (8.0 / 3));
    }
}

static void add_pairs(struct draws *d, int kind, const uint8_t *a, const uint8_t *b, int count)
{
    int64_t *board = d->board[kind];
    for (int i = 0; i < count; i++)
        board[SIDE * a[i] + b[i]]++;
    d->pairs[kind] += count;
}

/* Every pair is counted once: with the later of its two names. */
static void add_tick(struct draws *d, int64_t tick)
{
    uint8_t(*now)[RODS] = d->bin[tick % 2], (*before)[RODS] = d->bin[(tick + 1) % 2];
    for (int row = 0; row < ROWS; row++) {
        const struct noise_key key = {.seed = 20240521,
                                      .realization = (uint32_t)(row % REALIZATIONS),
                                      .stream = (uint8_t)(row / REALIZATIONS)};
        for (int i = 0; i < RODS; i++)
            d->normal[i] = 0;
        normals_add(d->normal, RODS, 1, &key, tick);
        add_moments(d);
        add_bins(d, now[row]);
        for (int k = 0; k < ROD_PAIRS; k++)
            add_pairs(d, k, now[row], now[row] + rod_lags[k], RODS - rod_lags[k]);
        if (tick > 0)
            add_pairs(d, ROD_PAIRS, before[row], now[row], RODS);
        if (row % REALIZATIONS > 0)
            add_pairs(d, ROD_PAIRS + 1, now[row - 1], now[row], RODS);
        if (row >= REALIZATIONS)
            add_pairs(d, ROD_PAIRS + 2, now[row - REALIZATIONS], now[row], RODS);
    }
}

static int draw(void **state)
{
    struct draws *d = calloc(1, sizeof *d);
    if (!d)
        return -1;
    for (int64_t tick = 0; tick < TICKS; tick++)
        add_tick(d, tick);
    *state = d;
    return 0;
}

static int forget(void **state)
{
    free(*state);
    return 0;
}

static double normal_below(double x)
{
    return 0.5 * erfc(-x / sqrt(2));
}

/* Of the interval from low to high; by symmetry from the left tail, where nothing cancels. */
static double normal_between(double low, double high)
{
    return low + high > 0 ? normal_below(-low) - normal_below(-high)
                          : normal_below(high) - normal_below(low);
}

/* E x^m = (m-1)!! for even m; Var x^m = E x^2m - (E x^m)^2. */
static void test_moments(void **state)
{
    const struct draws *d = *state;
    static const double moment[2 * ORDERS + 1] = {1, 0,   1, 0,     3, 0,      15, 0,      105,
                                                  0, 945, 0, 10395, 0, 135135, 0,  2027025};
    for (int m = 1; m <= ORDERS; m++) {
        char what[16];
        snprintf(what, sizeof what, "moment %d", m);
        double error = sqrt((moment[2 * m] - moment[m] * moment[m]) / total);
        check_five_sigma(what, d->sum[m] / total, moment[m], error);
    }
}

/* At the edges of the fine bins. P(sqrt(n) D > 2.23) = 1e-4, and less at edges only;
 * P(sqrt(n) D < 0.33) = 1e-4, at edges 2e-4 apart in probability about .008 below it. */
static void test_kolmogorov_smirnov(void **state)
{
    const struct draws *d = *state;
    double largest = 0;
    int64_t below = 0;
    for (int b = 0; b < FINE; b++) {
        double difference = (double)below / total - normal_below(-8 + 16.0 * b / FINE);
        largest = fmax(largest, fabs(difference));
        below += d->fine[b];
    }
    double statistic = sqrt(total) * largest;
    if (!(statistic > 0.32 && statistic < 2.23))
        fail_msg("sqrt(n) D = %g", statistic);
}

/* Chi-square: mean bins - 1, variance about 2 (bins - 1) + sum of 1/expected. Bins of 1/2048 as far
 * as each expects 10 at least; in the tails as many of them together as expect that. */
static void test_fine_bins(void **state)
{
    const struct draws *d = *state;
    double chi = 0, spread = 0;
    int bins = 0, start = 0;
    int64_t count = 0;
    for (int b = 0; b < FINE; b++) {
        count += d->fine[b];
        double low = -8 + 16.0 * start / FINE, high = -8 + 16.0 * (b + 1) / FINE;
        double expected = total * normal_between(start ? low : -40, high);
        double rest = total * normal_below(-high);
        bool last = b == FINE - 1;
        if (!last && (expected < 10 || rest < 10))
            continue;
        if (last)
            expected = total * normal_below(-low);
        chi += ((double)count - expected) * ((double)count - expected) / expected;
        spread += 2 + 1 / expected;
        bins++;
        start = b + 1;
        count = 0;
    }
    assert_true(bins > 18000);
    check_five_sigma("chi-square of the fine bins", chi, bins - 1, sqrt(spread));
}

/* Beyond 4, 4.5, 5, 5.5, 6 on either side: Poisson; the last expects one. The largest of 2^32 radii
 * is sqrt(66 ln 2). */
static void test_tails(void **state)
{
    const struct draws *d = *state;
    for (int half = 8; half <= 12; half++) {
        double edge = 0.5 * half, expected = total * normal_below(-edge);
        int64_t left = 0, right = 0;
        for (int b = 0; b < (int)((8 - edge) * FINE / 16); b++) {
            left += d->fine[b];
            right += d->fine[FINE - 1 - b];
        }
        /* A mean of one: P(more than 8) = 1e-6, like five standard errors elsewhere. */
        double slack = 2;
        check_five_sigma("left tail", (double)left, expected, sqrt(expected + slack));
        check_five_sigma("right tail", (double)right, expected, sqrt(expected + slack));
    }
    assert_true(d->largest > 5.5 && d->largest <= sqrt(66 * log(2)));
}

/* Against the product of the exact marginals: (SIDE - 1)^2 degrees of freedom of dependence and
 * SIDE - 1 for each marginal. Both marginals of a lag are those of the same normals: twice one
 * chi-square, of twice the variance. A count on the diagonal varies more than expected, because a
 * normal belongs to two pairs: n p^2 (1 + 2 p - 3 p^2), p < 0.15. */
static void test_pairs(void **state)
{
    const struct draws *d = *state;
    double share[SIDE];
    for (int a = 0; a < SIDE; a++)
        share[a] = normal_between(a > 0 ? 0.375 * a - 3 : -40,
                                  a < SIDE - 1 ? 0.375 * a - 2.625 : 40);
    for (int kind = 0; kind < PAIRS; kind++) {
        double chi = 0;
        for (int cell = 0; cell < SIDE * SIDE; cell++) {
            double expected = (double)d->pairs[kind] * share[cell / SIDE] * share[cell % SIDE];
            double off = (double)d->board[kind][cell] - expected;
            chi += off * off / expected;
            check_five_sigma(pair_names[kind], off, 0, sqrt(1.3 * expected));
        }
        const double within = (SIDE - 1) * (SIDE - 1), marginal = 2 * (SIDE - 1);
        double spread = 2 * within + 4 * marginal;
        check_five_sigma(pair_names[kind], chi, within + marginal, sqrt(spread));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_moments),
        cmocka_unit_test(test_kolmogorov_smirnov),
        cmocka_unit_test(test_fine_bins),
        cmocka_unit_test(test_tails),
        cmocka_unit_test(test_pairs),
    };
    return cmocka_run_group_tests(tests, draw, forget);
}
