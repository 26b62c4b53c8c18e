/* SPDX-License-Identifier: GPL-3.0-or-later
 * The noise: the published Philox vectors and Random123 itself, Box-Muller by libm, then
 * statistics. Seeds are fixed; every bound is a number of standard errors or a tail probability
 * given beside it. */
#include "kernels/normals.h"

#include <Random123/philox.h>
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { RODS = 4096 };

static const double two_pi = 6.283185307179586;

/* Five standard errors: passed by chance with probability 6e-7. */
static void check_five_sigma(const char *what, double value, double expected, double error)
{
    if (!(fabs(value - expected) <= 5 * error))
        fail_msg("%s: %g, expected %g +- %g", what, value, expected, error);
}

/* kat_vectors of Random123: "philox4x32 10 <counter> <key> <result>". */
static void test_published_vectors(void **state)
{
    (void)state;
    static const struct {
        uint32_t counter[4], key[2], result[4];
    } known[] = {
        {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
         {0xffffffff, 0xffffffff},
         {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
         {0xa4093822, 0x299f31d0},
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    };
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        const uint32_t *c = known[k].counter;
        struct noise_key key = {.seed = (uint64_t)known[k].key[1] << 32 | known[k].key[0],
                                .realization = c[1],
                                .stream = (uint8_t)(c[3] >> 24)};
        int64_t tick = (int64_t)((uint64_t)(c[3] & 0xffffff) << 32 | c[2]);
        uint32_t words[4];
        philox_words(words, c[0], 1, &key, tick);
        assert_memory_equal(words, known[k].result, sizeof words);
    }
}

static void random123_block(uint32_t *words, uint32_t block, const struct noise_key *key,
                            int64_t tick)
{
    philox4x32_ctr_t counter = {{block, key->realization, (uint32_t)tick,
                                 (uint32_t)key->stream << 24 | (uint32_t)(tick >> 32)}};
    philox4x32_key_t k = {{(uint32_t)key->seed, (uint32_t)(key->seed >> 32)}};
    philox4x32_ctr_t result = philox4x32(counter, k);
    for (int w = 0; w < 4; w++)
        words[w] = result.v[w];
}

static struct noise_key some_key(int round)
{
    uint64_t mixed = 0x9e3779b97f4a7c15u * (uint64_t)(round + 1);
    return (struct noise_key){.seed = mixed,
                              .realization = (uint32_t)(mixed >> 17) * 2654435761u,
                              .stream = (uint8_t)(round * 37)};
}

static int64_t some_tick(int round)
{
    return (int64_t)(0xc2b2ae3d27d4eb4fu * (uint64_t)round >> (8 + round % 40));
}

static void test_random123(void **state)
{
    (void)state;
    enum { BLOCKS = 200 };
    for (int round = 0; round < 200; round++) {
        struct noise_key key = some_key(round);
        int64_t tick = some_tick(round), first = round * 1000003;
        uint32_t words[4 * BLOCKS], expected[4];
        philox_words(words, first, BLOCKS, &key, tick);
        for (int b = 0; b < BLOCKS; b++) {
            random123_block(expected, (uint32_t)(first + b), &key, tick);
            assert_memory_equal(words + 4 * b, expected, sizeof expected);
        }
    }
}

/* As the header says, from Random123's words and libm's functions. */
static void test_box_muller(void **state)
{
    (void)state;
    double out[4 * 70];
    for (int round = 0; round < 400; round++) {
        struct noise_key key = some_key(round);
        int64_t tick = some_tick(round);
        memset(out, 0, sizeof out);
        normals_add(out, 4 * 70, 1, &key, tick);
        for (int b = 0; b < 70; b++) {
            uint32_t word[4];
            random123_block(word, (uint32_t)b, &key, tick);
            for (int pair = 0; pair < 4; pair += 2) {
                double radius = sqrt(-2 * log((word[pair] + 0.5) * 0x1p-32));
                double angle = two_pi * (word[pair + 1] * 0x1p-32 - 0.5);
                double slack = 8 * DBL_EPSILON * radius;
                assert_true(fabs(out[4 * b + pair] - radius * sin(angle)) <= slack);
                assert_true(fabs(out[4 * b + pair + 1] - radius * cos(angle)) <= slack);
            }
        }
    }
}

/* A normal depends on nothing but its names: not on how many others are drawn with it. */
static void test_any_number_at_a_time(void **state)
{
    (void)state;
    struct noise_key key = {.seed = 7, .realization = 3, .stream = 1};
    double all[RODS] = {0}, some[RODS + 1];
    normals_add(all, RODS, 1, &key, 11);
    static const int sizes[] = {1, 2, 3, 4, 5, 63, 64, 65, 255, 256, 257, 1000, 4095, RODS};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        for (int i = 0; i <= RODS; i++)
            some[i] = 0;
        normals_add(some, sizes[s], 1, &key, 11);
        assert_memory_equal(some, all, sizeof *some * (size_t)sizes[s]);
        for (int i = sizes[s]; i <= RODS; i++)
            assert_true(some[i] == 0);
    }
}

static void test_adds_and_scales(void **state)
{
    (void)state;
    struct noise_key key = {.seed = 7};
    double unit[300] = {0}, out[300];
    normals_add(unit, 300, 1, &key, 5);
    for (int i = 0; i < 300; i++)
        out[i] = i;
    normals_add(out, 300, 0.25, &key, 5);
    for (int i = 0; i < 300; i++)
        assert_true(out[i] == i + 0.25 * unit[i]);
}

/* Results are promised to be the same bits with every compiler and on every x86-64 processor. The
 * digest was printed by builds with gcc 12 and clang 14, with and without optimisation. */
static void test_same_bits_everywhere(void **state)
{
    (void)state;
    uint64_t digest = 0xcbf29ce484222325u;
    for (int tick = 0; tick < 64; tick++) {
        struct noise_key key = {.seed = 1, .realization = (uint32_t)tick % 3};
        double out[1000] = {0};
        normals_add(out, 1000, 1, &key, tick);
        const unsigned char *bytes = (const unsigned char *)out;
        for (size_t i = 0; i < sizeof out; i++)
            digest = (digest ^ bytes[i]) * 0x100000001b3u;
    }
    if (digest != 0xf789db69410384d9u)
        fail_msg("digest %#llx", (unsigned long long)digest);
}

/* ---------------------------------------------------------------- statistics */

static void test_moments(void **state)
{
    (void)state;
    enum { TICKS = 1000 };
    double sum[9] = {0}, out[RODS];
    struct noise_key key = {.seed = 2022};
    for (int tick = 0; tick < TICKS; tick++) {
        memset(out, 0, sizeof out);
        normals_add(out, RODS, 1, &key, tick);
        for (int i = 0; i < RODS; i++) {
            double power = 1;
            for (int m = 1; m <= 8; m++)
                sum[m] += power *= out[i];
        }
    }
    /* E x^m = (m-1)!! for even m; Var x^m = E x^2m - (E x^m)^2. */
    static const double moment[17] = {1, 0,   1, 0,     3, 0,      15, 0,      105,
                                      0, 945, 0, 10395, 0, 135135, 0,  2027025};
    double n = (double)TICKS * RODS;
    for (int m = 1; m <= 8; m++) {
        char what[16];
        snprintf(what, sizeof what, "moment %d", m);
        double error = sqrt((moment[2 * m] - moment[m] * moment[m]) / n);
        check_five_sigma(what, sum[m] / n, moment[m], error);
    }
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double normal_below(double x)
{
    return 0.5 * erfc(-x / sqrt(2));
}

/* Kolmogorov-Smirnov: P(sqrt(n) D > 2.23) = 1e-4. The other end, too good to be true:
 * P(sqrt(n) D < 0.33) = 1e-4. */
static void test_kolmogorov_smirnov(void **state)
{
    (void)state;
    enum { N = 1 << 20 };
    double *x = calloc(N, sizeof *x);
    assert_non_null(x);
    struct noise_key key = {.seed = 126, .realization = 54};
    normals_add(x, N, 1, &key, 606);
    qsort(x, N, sizeof *x, by_size);
    double d = 0;
    for (int i = 0; i < N; i++) {
        double p = normal_below(x[i]);
        d = fmax(d, fmax((i + 1.0) / N - p, p - (double)i / N));
    }
    free(x);
    double statistic = sqrt(N) * d;
    if (!(statistic > 0.33 && statistic < 2.23))
        fail_msg("sqrt(n) D = %g", statistic);
}

/* Chi-square in bins of a quarter out to +-5 sigma and one beyond it on either side (19 expected in
 * each), from 6.7e7 normals: mean = bins - 1, variance about 2 (bins - 1) + sum of 1/expected. */
static void test_chi_square_to_five_sigma(void **state)
{
    (void)state;
    enum { TICKS = 1 << 14, BINS = 42 };
    static int64_t count[BINS];
    double out[RODS];
    struct noise_key key = {.seed = 5, .realization = 1};
    memset(count, 0, sizeof count);
    for (int tick = 0; tick < TICKS; tick++) {
        memset(out, 0, sizeof out);
        normals_add(out, RODS, 1, &key, tick);
        for (int i = 0; i < RODS; i++) {
            double bin = floor(4 * (out[i] + 5)) + 1;
            count[bin < 0 ? 0 : bin > BINS - 1 ? BINS - 1 : (int)bin]++;
        }
    }
    double n = (double)TICKS * RODS, chi = 0, spread = 2.0 * (BINS - 1);
    for (int b = 0; b < BINS; b++) {
        /* By symmetry from the left tail: no cancellation in the right one. */
        int mirrored = b < BINS / 2 ? b : BINS - 1 - b;
        double upper = normal_below(-5 + 0.25 * mirrored);
        double lower = mirrored ? normal_below(-5 + 0.25 * (mirrored - 1)) : 0;
        double expected = n * (upper - lower);
        chi += (count[b] - expected) * (count[b] - expected) / expected;
        spread += 1 / expected;
        check_five_sigma("bin", (double)count[b], expected, sqrt(expected));
    }
    check_five_sigma("chi-square", chi, BINS - 1, sqrt(spread));
}

/* Correlations of x with y, and of their squares: 0 +- 1/sqrt(n) and 0 +- 2/sqrt(n). */
struct correlation {
    double n, product, squares;
};

static void correlate(struct correlation *c, const double *x, const double *y, int n)
{
    for (int i = 0; i < n; i++) {
        c->product += x[i] * y[i];
        c->squares += (x[i] * x[i] - 1) * (y[i] * y[i] - 1);
    }
    c->n += n;
}

static void check_uncorrelated(const char *what, const struct correlation *c)
{
    check_five_sigma(what, c->product / c->n, 0, 1 / sqrt(c->n));
    check_five_sigma(what, c->squares / c->n, 0, 2 / sqrt(c->n));
}

static void test_rods_are_independent(void **state)
{
    (void)state;
    /* Neighbours, the same counter, the same tile of counters, the next tile. */
    static const int lags[] = {1, 2, 3, 4, 5, 64, 128, 252, 256, 260, 1024};
    enum { LAGS = sizeof lags / sizeof *lags };
    struct correlation c[LAGS] = {{0}};
    struct noise_key key = {.seed = 31};
    double x[RODS];
    for (int tick = 0; tick < 300; tick++) {
        memset(x, 0, sizeof x);
        normals_add(x, RODS, 1, &key, tick);
        for (int l = 0; l < LAGS; l++)
            correlate(&c[l], x, x + lags[l], RODS - lags[l]);
    }
    for (int l = 0; l < LAGS; l++)
        check_uncorrelated("rods", &c[l]);
}

static void test_names_are_independent(void **state)
{
    (void)state;
    enum { OTHERS = 9 };
    struct correlation c[OTHERS] = {{0}};
    double x[RODS], y[RODS];
    for (int64_t tick = 0; tick < 300; tick++) {
        const struct noise_key key = {.seed = 1, .realization = 1, .stream = 0};
        memset(x, 0, sizeof x);
        normals_add(x, RODS, 1, &key, tick);
        for (int other = 0; other < OTHERS; other++) {
            struct noise_key k = key;
            int64_t t = tick;
            switch (other) {
            case 0:
                t = tick + 1;
                break;
            case 1:
                t = tick + 2;
                break;
            case 2:
                t = tick + ((int64_t)1 << 32);
                break;
            case 3:
                k.realization = 2;
                break;
            case 4:
                k.realization = 0;
                break;
            case 5:
                k.stream = 1;
                break;
            case 6:
                k.seed = 2;
                break;
            case 7:
                k.seed = 1 | (uint64_t)1 << 32;
                break;
            default:
                k.seed = 0x8000000000000001u;
                break;
            }
            memset(y, 0, sizeof y);
            normals_add(y, RODS, 1, &k, t);
            correlate(&c[other], x, y, RODS);
        }
    }
    static const char *const what[OTHERS] = {"tick + 1",        "tick + 2",        "tick + 2^32",
                                             "realization + 1", "realization - 1", "stream",
                                             "seed + 1",        "seed + 2^32",     "seed + 2^63"};
    for (int other = 0; other < OTHERS; other++)
        check_uncorrelated(what[other], &c[other]);
}

/* The centre of mass of 1000 rods over many ticks: a normal of variance 1/1000, as for rods that
 * are independent all together, not only in pairs. */
static void test_sums_over_rods(void **state)
{
    (void)state;
    enum { TICKS = 20000, N = 1000 };
    double sum = 0, squares = 0, fourth = 0, x[N];
    struct noise_key key = {.seed = 77};
    for (int tick = 0; tick < TICKS; tick++) {
        memset(x, 0, sizeof x);
        normals_add(x, N, 1, &key, tick);
        double centre = 0;
        for (int i = 0; i < N; i++)
            centre += x[i];
        centre /= sqrt(N);
        sum += centre;
        squares += centre * centre;
        fourth += centre * centre * centre * centre;
    }
    check_five_sigma("centre", sum / TICKS, 0, sqrt(1.0 / TICKS));
    check_five_sigma("centre^2", squares / TICKS, 1, sqrt(2.0 / TICKS));
    check_five_sigma("centre^4", fourth / TICKS, 3, sqrt(96.0 / TICKS));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_published_vectors),
        cmocka_unit_test(test_random123),
        cmocka_unit_test(test_box_muller),
        cmocka_unit_test(test_any_number_at_a_time),
        cmocka_unit_test(test_adds_and_scales),
        cmocka_unit_test(test_same_bits_everywhere),
        cmocka_unit_test(test_moments),
        cmocka_unit_test(test_kolmogorov_smirnov),
        cmocka_unit_test(test_chi_square_to_five_sigma),
        cmocka_unit_test(test_rods_are_independent),
        cmocka_unit_test(test_names_are_independent),
        cmocka_unit_test(test_sums_over_rods),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
