/* SPDX-License-Identifier: GPL-3.0-or-later
 * Overlaps undone pair by pair end where elastic collisions in order of time end. */
#include "kernels/overlap_sweep.h"
#include "kernels/ring_sort.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 100000 };

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

struct bench {
    double swept[MOST], sorted[MOST], scratch[MOST];
};

static void displace(struct bench *b, int64_t n, double ell, double width, uint64_t *state)
{
    for (int64_t i = 0; i < n; i++)
        b->swept[i] = b->sorted[i] =
            ell * (double)i / (double)n + width * (2 * uniform(state) - 1);
}

static void compare(const struct bench *b, int64_t n, double slack)
{
    for (int64_t i = 0; i < n; i++)
        assert_true(fabs(b->swept[i] - b->sorted[i]) <= slack);
    for (int64_t i = 1; i < n; i++)
        assert_true(b->swept[i - 1] <= b->swept[i]);
}

static void check(struct bench *b, int64_t n, double width, uint64_t *state)
{
    const double ell = 2.3;
    displace(b, n, ell, width, state);
    sweep_ring(b->swept, n, ell, b->scratch);
    ring_sort(b->sorted, n, ell, b->scratch);
    compare(b, n, 1e-14 * (ell + width));
    assert_true(b->swept[n - 1] <= b->swept[0] + ell);

    displace(b, n, ell, width, state);
    sweep_walls(b->swept, n, 0.2, 2.5, b->scratch);
    reflect_walls(b->sorted, n, 0.2, 2.5, b->scratch);
    compare(b, n, 1e-14 * (ell + width));
    assert_true(b->swept[0] >= 0.2 && b->swept[n - 1] <= 2.5);
}

/* Steps from a hundredth of a gap to many turns of the ring. */
static void test_same_as_elastic(void **state)
{
    (void)state;
    struct bench *b = malloc(sizeof *b);
    uint64_t random = 3;
    static const int64_t counts[] = {1, 2, 3, 5, 16, 101, MOST};
    static const double widths[] = {0.01, 0.5, 2, 10, 100, 1e5};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
        for (size_t w = 0; w < sizeof widths / sizeof *widths; w++)
            for (int i = 0; i < (counts[c] < 1000 ? 1000 : 1); i++)
                check(b, counts[c], widths[w] * 2.3 / (double)counts[c], &random);
    free(b);
}

static void test_no_room(void **state)
{
    (void)state;
    double y[4] = {0.5, -0.2, 0.9, 0}, scratch[4];
    sweep_ring(y, 4, 0, scratch);
    assert_true(y[0] == y[1] && y[1] == y[3] && fabs(y[0] - 0.3) < 1e-15);
    sweep_walls(y, 4, 0.1, 0.1, scratch);
    assert_true(y[0] == 0.1 && y[3] == 0.1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_as_elastic),
        cmocka_unit_test(test_no_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
