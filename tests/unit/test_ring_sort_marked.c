/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sorting with a payload: the same bits as ring_sort, and every mark still with its path. */
#include "kernels/ring_sort.h"
#include "kernels/ring_sort_marked.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 3000 };

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

struct bench {
    double before[MOST], y[MOST], plain[MOST], mark[MOST], scratch[2 * MOST];
};

static void displace(struct bench *b, int64_t n, double ell, double width, uint64_t *state)
{
    for (int64_t i = 0; i < n; i++) {
        b->before[i] = ell * (double)i / (double)n + width * (2 * uniform(state) - 1);
        b->y[i] = b->plain[i] = b->before[i];
        b->mark[i] = (double)(i + 1); /* names the path, and its sign the side of the mirror */
    }
}

/* Every path ends, modulo ell, where it was displaced to, and every path is there once. */
static void check_ring(struct bench *b, int64_t n, double ell, double width, uint64_t *state)
{
    displace(b, n, ell, width, state);
    ring_sort_marked(&(struct marked_rods){b->y, b->mark, n, b->scratch}, ell);
    ring_sort(b->plain, n, ell, b->scratch);
    assert_memory_equal(b->y, b->plain, (size_t)n * sizeof(double));
    static char met[MOST];
    memset(met, 0, sizeof met);
    for (int64_t i = 0; i < n; i++) {
        int64_t path = (int64_t)b->mark[i] - 1;
        assert_true(path >= 0 && path < n && !met[path]);
        met[path] = 1;
        double turns = (b->y[i] - b->before[path]) / ell;
        assert_true(fabs(turns - rint(turns)) * ell < 1e-9 * (1 + ell + width));
    }
}

static void test_rings(void **state)
{
    (void)state;
    struct bench *b = malloc(sizeof *b);
    uint64_t random = 5;
    static const int64_t counts[] = {1, 2, 3, 7, 16, 100, MOST};
    static const double widths[] = {1e-3, 0.1, 1, 30, 1e4}; /* in mean gaps: up to many turns */
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
        for (size_t w = 0; w < sizeof widths / sizeof *widths; w++)
            for (int i = 0; i < (counts[c] < 50 ? 300 : 3); i++)
                check_ring(b, counts[c], 3.7, widths[w] * 3.7 / (double)counts[c], &random);
    free(b);
}

/* A mark has changed sign where its path was mirrored an odd number of times. */
static void check_walls(struct bench *b, int64_t n, double low, double high, uint64_t *state)
{
    displace(b, n, high, 3 * high, state);
    reflect_walls_marked(&(struct marked_rods){b->y, b->mark, n, b->scratch}, low, high);
    reflect_walls(b->plain, n, low, high, b->scratch);
    assert_memory_equal(b->y, b->plain, (size_t)n * sizeof(double));
    int mirrored = 0;
    for (int64_t i = 0; i < n; i++) {
        double sign = b->mark[i] < 0 ? -1 : 1;
        double from = b->before[(int64_t)fabs(b->mark[i]) - 1];
        /* sign * y and the free position agree up to even numbers of mirrors. */
        double turns = (from - low - sign * (b->y[i] - low)) / (2 * (high - low));
        assert_true(fabs(turns - rint(turns)) < 1e-12);
        mirrored += sign < 0;
    }
    assert_true(n < 100 || (mirrored > n / 4 && mirrored < 3 * n / 4));
}

static void test_walls(void **state)
{
    (void)state;
    struct bench *b = malloc(sizeof *b);
    uint64_t random = 9;
    for (int i = 0; i < 300; i++)
        for (int64_t n = 1; n < 20; n++)
            check_walls(b, n, 0.4, 2.9, &random);
    check_walls(b, MOST, 0.4, 2.9, &random);
    free(b);
}

/* Without room rods are one body, and their marks stay. */
static void test_no_room(void **state)
{
    (void)state;
    double y[3] = {0.5, -0.2, 0.9}, mark[3] = {1, 2, 3}, scratch[6];
    ring_sort_marked(&(struct marked_rods){y, mark, 3, scratch}, 0);
    assert_true(y[0] == y[1] && y[1] == y[2] && fabs(y[0] - 0.4) < 1e-15);
    assert_true(mark[0] == 1 && mark[1] == 2 && mark[2] == 3);
    reflect_walls_marked(&(struct marked_rods){y, mark, 3, scratch}, 0.25, 0.25);
    assert_true(y[0] == 0.25 && y[2] == 0.25 && mark[0] == 1 && mark[2] == 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rings),
        cmocka_unit_test(test_walls),
        cmocka_unit_test(test_no_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
