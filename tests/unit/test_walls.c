/* SPDX-License-Identifier: GPL-3.0-or-later
 * Both resolvers between walls: sticking against a search through all ways to group the rods,
 * reflecting against a walk through all collisions and against the law of one rod in a box. */
#include "kernels/histogram.h"
#include "kernels/isotonic.h"
#include "kernels/ring_sort.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { RODS_MAX = 64 };

static double uniform(void)
{
    return drand48();
}

/* ------------------------------------------------------------------ sticking */

/* Groups of neighbours, one for each bit pattern: a set bit i ends a group after rod i. Every group
 * at its mean, or at the wall it would pass. Returns the squared distance, INFINITY out of order.
 * The projection is one of these, and the nearest. */
static double grouped(const double *z, int n, unsigned ends, const double wall[2], double *out)
{
    double distance = 0, before = -INFINITY;
    for (int first = 0, i = 0; i < n; i++) {
        if (i + 1 < n && !(ends >> i & 1))
            continue;
        double sum = 0;
        for (int k = first; k <= i; k++)
            sum += z[k];
        double mean = fmin(fmax(sum / (i + 1 - first), wall[0]), wall[1]);
        if (mean < before)
            return INFINITY;
        for (int k = first; k <= i; k++) {
            out[k] = mean;
            distance += (z[k] - mean) * (z[k] - mean);
        }
        before = mean;
        first = i + 1;
    }
    return distance;
}

static void test_sticking_is_the_nearest_legal_order(void **state)
{
    (void)state;
    srand48(11);
    struct isotonic_block blocks[RODS_MAX];
    int at_a_wall = 0, grown = 0;
    for (int trial = 0; trial < 20000; trial++) {
        int n = 1 + (int)(8 * uniform());
        const double low = uniform() - 0.5, wall[2] = {low, low + (trial % 7 ? uniform() : 0)};
        double z[RODS_MAX], y[RODS_MAX], best[RODS_MAX], least = INFINITY;
        double spread = pow(10, -2 + 3 * uniform());
        for (int i = 0; i < n; i++)
            y[i] = z[i] = low + (wall[1] - low) * (i + 0.5) / n + spread * (uniform() - 0.5);
        for (unsigned ends = 0; ends < 1u << (n - 1); ends++) {
            double out[RODS_MAX], distance = grouped(z, n, ends, wall, out);
            if (distance < least) {
                least = distance;
                for (int i = 0; i < n; i++)
                    best[i] = out[i];
            }
        }
        isotonic_walls(y, n, wall[0], wall[1], blocks);
        for (int i = 0; i < n; i++) {
            assert_true(fabs(y[i] - best[i]) < 1e-12 * (1 + spread));
            assert_true(y[i] >= wall[0] && y[i] <= wall[1]);
            assert_true(i == 0 || y[i - 1] <= y[i]);
            at_a_wall += y[i] == wall[0] || y[i] == wall[1];
            grown += i > 0 && y[i - 1] == y[i];
        }
    }
    assert_true(at_a_wall > 1000 && grown > 1000); /* both happened */
}

/* ---------------------------------------------------------------- reflecting */

/* Rods of velocity v for unit time: neighbours that meet exchange velocities, walls turn them. */
static void bounce_one_by_one(double *y, double *v, int n, const double wall[2])
{
    double left = 1;
    for (long events = 0; events < 10000000; events++) {
        double soonest = left;
        int who = -2; /* -1: rod 0 and the left wall; n - 1: the last rod and the right wall */
        for (int i = -1; i < n; i++) {
            double gap = (i + 1 < n ? y[i + 1] : wall[1]) - (i >= 0 ? y[i] : wall[0]);
            double closing = (i >= 0 ? v[i] : 0) - (i + 1 < n ? v[i + 1] : 0);
            double time = closing > 0 ? fmax(gap / closing, 0) : left;
            if (time < soonest) {
                soonest = time;
                who = i;
            }
        }
        for (int i = 0; i < n; i++)
            y[i] += v[i] * soonest;
        left -= soonest;
        if (who == -2)
            return;
        double one = who >= 0 ? v[who] : -v[0], other = who + 1 < n ? v[who + 1] : -v[n - 1];
        if (who >= 0)
            v[who] = other;
        if (who + 1 < n)
            v[who + 1] = one;
    }
    fail_msg("too many collisions");
}

static void test_reflecting_is_elastic_collisions(void **state)
{
    (void)state;
    srand48(13);
    double y[RODS_MAX], v[RODS_MAX], z[RODS_MAX], scratch[RODS_MAX];
    for (int trial = 0; trial < 5000; trial++) {
        int n = 1 + (int)(8 * uniform());
        const double low = uniform() - 0.5, wall[2] = {low, low + 0.5 + uniform()};
        double reach = pow(10, -3 + 4 * uniform()); /* up to ten times across */
        for (int i = 0; i < n; i++) {
            y[i] = low + (wall[1] - low) * (i + uniform()) / n;
            v[i] = reach * (uniform() - 0.5);
            z[i] = y[i] + v[i];
        }
        reflect_walls(z, n, wall[0], wall[1], scratch);
        bounce_one_by_one(y, v, n, wall);
        for (int i = 0; i < n; i++)
            assert_true(fabs(z[i] - y[i]) < 1e-12);
    }
}

/* One rod: the folded normal distribution is the box's propagator, the sum over image charges.
 * Equally likely displacements instead of random ones: no noise but 1 over their number. */
static void test_one_rod_has_the_propagator_of_the_box(void **state)
{
    (void)state;
    enum { POINTS = 200000, BINS = 7, IMAGES = 40 };
    static const double step[] = {0.05, 0.4, 2, 11};
    const double low = -0.3, high = 0.9, start = 0.05, width = (high - low) / BINS;
    for (size_t s = 0; s < sizeof step / sizeof *step; s++) {
        int count[BINS] = {0};
        for (int k = 0; k < POINTS; k++) {
            double z = start + step[s] * gsl_cdf_ugaussian_Pinv((k + 0.5) / POINTS), scratch;
            reflect_walls(&z, 1, low, high, &scratch);
            assert_true(z >= low && z <= high);
            count[(int)fmin((z - low) / width, BINS - 1)]++;
        }
        for (int bin = 0; bin < BINS; bin++) {
            double share = 0, from = bin * width, to = from + width;
            for (int image = -IMAGES; image <= IMAGES; image++) {
                double turn = 2 * image * (high - low), at = start - low;
                share += gsl_cdf_gaussian_P(turn + to - at, step[s]) -
                         gsl_cdf_gaussian_P(turn + from - at, step[s]);
                share += gsl_cdf_gaussian_P(turn + to + at, step[s]) -
                         gsl_cdf_gaussian_P(turn + from + at, step[s]);
            }
            assert_true(fabs((double)count[bin] / POINTS - share) < 1e-4);
        }
    }
}

static void test_no_room_and_huge_displacements(void **state)
{
    (void)state;
    double scratch[4], y[4] = {5, -3, 0.25, 1e300};
    reflect_walls(y, 4, 0.25, 0.25, scratch);
    for (int i = 0; i < 4; i++)
        assert_true(y[i] == 0.25);
    double far[4] = {1e300, -1e300, 1e17, -0.5};
    reflect_walls(far, 4, 0, 1, scratch);
    for (int i = 0; i < 4; i++)
        assert_true(far[i] >= 0 && far[i] <= 1 && (i == 0 || far[i - 1] <= far[i]));
    struct isotonic_block blocks[4];
    double thrown[4] = {-1e300, -2, 3, 1e300};
    isotonic_walls(thrown, 4, 0, 1, blocks);
    assert_true(thrown[0] == 0 && thrown[1] == 0 && thrown[2] == 1 && thrown[3] == 1);
}

/* --------------------------------------------------------------------- bins */

/* A rod at the right wall is in the last bin, not round the ring in the first. */
static void test_the_last_bin_includes_the_wall(void **state)
{
    (void)state;
    const struct fold ring = {1 / 3.0, 5, false}, box = {1 / 3.0, 5, true};
    assert_int_equal(fold_bin(&ring, 3.0), 0);
    assert_int_equal(fold_bin(&box, 3.0), 4);
    assert_int_equal(fold_bin(&box, nextafter(3, 4)), 4);
    assert_int_equal(fold_bin(&box, 0), 0);
    assert_int_equal(fold_bin(&box, -1e-17), 0);
    assert_int_equal(fold_bin(&box, 2.9), 4);
    const double y[] = {0, 0.5, 1.3, 3};
    int64_t counts[5] = {0};
    histogram_add(counts, &box, y, 4, 0);
    assert_int_equal(counts[0], 2);
    assert_int_equal(counts[2], 1);
    assert_int_equal(counts[4], 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sticking_is_the_nearest_legal_order),
        cmocka_unit_test(test_reflecting_is_elastic_collisions),
        cmocka_unit_test(test_one_rod_has_the_propagator_of_the_box),
        cmocka_unit_test(test_no_room_and_huge_displacements),
        cmocka_unit_test(test_the_last_bin_includes_the_wall),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
