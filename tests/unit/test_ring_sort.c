/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sorting as elastic collisions, against an event-driven walk through all collisions. */
#include "kernels/ring_sort.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { RODS_MAX = 64 };

static double uniform(void)
{
    return drand48();
}

/* Rods of velocity v for unit time; neighbours that meet exchange velocities. */
static void collide_one_by_one(double *y, double *v, int n, double ell)
{
    double left = 1;
    for (long events = 0; events < 10000000; events++) {
        double soonest = left;
        int who = -1;
        for (int i = 0; i < n; i++) {
            int j = (i + 1) % n;
            double gap = j ? y[j] - y[i] : y[0] + ell - y[i], closing = v[i] - v[j];
            double time = closing > 0 ? fmax(gap / closing, 0) : left;
            if (time < soonest) {
                soonest = time;
                who = i;
            }
        }
        for (int i = 0; i < n; i++)
            y[i] += v[i] * soonest;
        left -= soonest;
        if (who < 0)
            return;
        double swap = v[who];
        v[who] = v[(who + 1) % n];
        v[(who + 1) % n] = swap;
    }
    fail_msg("too many collisions");
}

static void random_start(double *y, int n, double ell)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        y[i] = sum -= log(1 - uniform());
    double total = sum - log(1 - uniform()), first = 10 * uniform() - 5;
    for (int i = 0; i < n; i++)
        y[i] = first + y[i] / total * ell;
}

static void test_sort_is_elastic_collisions(void **state)
{
    (void)state;
    srand48(3);
    double y[RODS_MAX], v[RODS_MAX], z[RODS_MAX], scratch[RODS_MAX];
    for (int trial = 0; trial < 5000; trial++) {
        int n = 2 + (int)(9 * uniform());
        double ell = 0.5 + uniform(), reach = pow(10, -3 + 4 * uniform()); /* up to ten turns */
        random_start(y, n, ell);
        for (int i = 0; i < n; i++) {
            v[i] = reach * (uniform() - 0.5);
            z[i] = y[i] + v[i];
        }
        ring_sort(z, n, ell, scratch);
        collide_one_by_one(y, v, n, ell);
        for (int i = 0; i < n; i++)
            assert_true(fabs(z[i] - y[i]) < 1e-12);
    }
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Large displacements of many rods take the merging path: a ring so long that none crosses the seam
 * is plain sorting. */
static void test_many_rods_far_displaced(void **state)
{
    (void)state;
    enum { N = 5000 };
    static double y[N], expected[N], scratch[N];
    srand48(5);
    for (int i = 0; i < N; i++)
        expected[i] = y[i] = uniform();
    qsort(expected, N, sizeof *expected, by_value);
    ring_sort(y, N, 2, scratch);
    for (int i = 0; i < N; i++)
        assert_true(y[i] == expected[i]);
}

static void test_centre_is_kept_and_order_holds(void **state)
{
    (void)state;
    srand48(7);
    double z[RODS_MAX], scratch[RODS_MAX];
    for (int trial = 0; trial < 2000; trial++) {
        int n = 1 + (int)(RODS_MAX * uniform());
        double ell = trial % 10 ? 1e-6 + uniform() : 0, before = 0, after = 0;
        for (int i = 0; i < n; i++)
            before += z[i] = 100 * (uniform() - 0.5);
        ring_sort(z, n, ell, scratch);
        for (int i = 0; i < n; i++) {
            after += z[i];
            assert_true(i == 0 || z[i - 1] <= z[i]);
        }
        assert_true(z[n - 1] <= z[0] + ell + 1e-12);
        assert_true(fabs(after - before) < 1e-7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sort_is_elastic_collisions),
        cmocka_unit_test(test_many_rods_far_displaced),
        cmocka_unit_test(test_centre_is_kept_and_order_holds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
