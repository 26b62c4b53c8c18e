/* SPDX-License-Identifier: GPL-3.0-or-later
 * The noise of rods with bonds on random rings: order, momentum, bitwise contact, bonds as they
 * should be, and an end to every step. */
#include "kernels/bonds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { RODS_MAX = 24 };

struct bench {
    double y[RODS_MAX], velocity[RODS_MAX], drift[RODS_MAX], due[RODS_MAX];
    unsigned char bonded[RODS_MAX];
    struct bond_cluster clusters[RODS_MAX];
    int64_t heap[RODS_MAX + 1], queued[RODS_MAX];
    struct bond_ring ring;
    struct bond_noise noise;
    struct bond_space space;
};

static double uniform(struct bench *b)
{
    uint32_t words[4];
    struct noise_key key = {.seed = 77, .stream = 9};
    philox_words(words, 0, 1, &key, b->noise.tick++);
    return ((double)words[0] + 0.5) * 0x1p-32;
}

static void set_up(struct bench *b, int64_t n, double ell, double strength)
{
    memset(b, 0, sizeof *b);
    b->ring = (struct bond_ring){n, ell, b->y, b->bonded};
    b->space = (struct bond_space){b->clusters, b->due, b->heap, b->queued};
    b->noise = (struct bond_noise){.strength = strength,
                                   .deviation = 0.1 * ell,
                                   .velocity = b->velocity,
                                   .drift = b->drift,
                                   .key = {.seed = 5, .stream = 6}};
}

/* Gaps: about half of them bonds, never all; the seam is one like the others. */
static void place_at_random(struct bench *b)
{
    const int64_t n = b->ring.n;
    double gap[RODS_MAX], sum = 0;
    int64_t open = (int64_t)(uniform(b) * (double)n);
    for (int64_t i = 0; i < n; i++) {
        b->bonded[i] = i != open && uniform(b) < 0.5;
        sum += gap[i] = b->bonded[i] ? 0 : uniform(b);
    }
    b->y[0] = 10 * uniform(b) - 5;
    for (int64_t i = 0; i + 1 < n; i++)
        b->y[i + 1] = b->y[i] + gap[i] / sum * b->ring.ell;
    if (b->bonded[n - 1]) {
        double tail = b->y[0] + b->ring.ell;
        for (int64_t i = n - 1; i >= 0 && (i == n - 1 || b->bonded[i]); i--)
            b->y[i] = tail;
    }
}

static void draw_motion(struct bench *b, double drift)
{
    memset(b->velocity, 0, sizeof b->velocity);
    memset(b->drift, 0, sizeof b->drift);
    struct noise_key key = {.seed = 3};
    normals_add(b->velocity, b->ring.n, b->noise.deviation, &key, b->noise.tick);
    key.stream = 1;
    normals_add(b->drift, b->ring.n, drift, &key, b->noise.tick);
}

static void check_order_and_contact(const struct bench *b)
{
    const int64_t n = b->ring.n;
    int64_t bonds = 0;
    for (int64_t i = 0; i < n; i++) {
        double next = i + 1 < n ? b->y[i + 1] : b->y[0] + b->ring.ell;
        assert_true(next >= b->y[i] - 1e-12);
        assert_true(!b->bonded[i] || next == b->y[i]);
        bonds += b->bonded[i];
        assert_int_equal(b->queued[i], 0);
    }
    assert_true(bonds < n);
}

static double sum_of(const double *values, int64_t n)
{
    double sum = 0;
    for (int64_t i = 0; i < n; i++)
        sum += values[i];
    return sum;
}

static void test_random_rings(void **state)
{
    (void)state;
    static struct bench b;
    static const double strengths[] = {0, 0.01, 1, 100};
    int64_t made = 0, broken = 0;
    for (int64_t n = 2; n <= RODS_MAX; n++)
        for (int trial = 0; trial < 200; trial++) {
            set_up(&b, n, 0.3 * (double)n, strengths[trial % 4]);
            b.noise.tick = 100000 * n + 400 * trial;
            place_at_random(&b);
            for (int step = 0; step < 4; step++) {
                draw_motion(&b, 0.05 * step);
                unsigned char old[RODS_MAX];
                memcpy(old, b.bonded, sizeof old);
                double expected = sum_of(b.y, n) + sum_of(b.velocity, n) + sum_of(b.drift, n);
                bonds_move(&b.ring, &b.noise, &b.space);
                check_order_and_contact(&b);
                assert_true(fabs(sum_of(b.y, n) - expected) < 1e-10);
                for (int64_t i = 0; i < n; i++) {
                    made += !old[i] && b.bonded[i];
                    broken += old[i] && !b.bonded[i];
                    assert_true(b.noise.strength > 0 || old[i] || !b.bonded[i]);
                }
                b.noise.tick++;
            }
        }
    assert_true(made > 1000 && broken > 1000);
}

/* Nothing crosses, no bond breaks (gamma is huge): every cluster moves by the mean of its rods. */
static void test_clusters_move_by_their_mean(void **state)
{
    (void)state;
    static struct bench b;
    set_up(&b, 5, 10, 1e9);
    const double y[] = {0, 4, 4, 4, 10}; /* rods 1 2 3, and 4 0 across the seam */
    memcpy(b.y, y, sizeof y);
    b.bonded[1] = b.bonded[2] = b.bonded[4] = 1;
    b.noise.deviation = 1e-9;
    const double velocity[] = {0.3, 0.1, 0.2, 0.6, -0.1}, drift[] = {0, 0.1, 0, 0, 0};
    memcpy(b.velocity, velocity, sizeof velocity);
    memcpy(b.drift, drift, sizeof drift);
    bonds_move(&b.ring, &b.noise, &b.space);
    const double moved[] = {0.1, 4.3 + 0.1 / 3, 4.3 + 0.1 / 3, 4.3 + 0.1 / 3, 10.1};
    for (int i = 0; i < 5; i++)
        assert_true(fabs(b.y[i] - moved[i]) < 1e-14);
    check_order_and_contact(&b);
}

/* Accelerated together and elastic: the gap at which two single rods arrive. Closing speed v and
 * drift d: they meet at t = 2 g / (v + sqrt(v^2 + 4 d g)) with speed u = v + 2 d t, part with it
 * and end at u (1 - t) - d (1 - t)^2. */
static void test_elastic_collision_with_drift(void **state)
{
    (void)state;
    static struct bench b;
    set_up(&b, 2, 10, 0);
    const double g = 0.2, v = 0.7, d = 0.1, t = 2 * g / (v + sqrt(v * v + 4 * d * g));
    b.y[0] = 1, b.y[1] = 1 + g;
    b.velocity[0] = v, b.drift[1] = -d;
    bonds_move(&b.ring, &b.noise, &b.space);
    double end = (v + 2 * d * t) * (1 - t) - d * (1 - t) * (1 - t);
    assert_true(fabs(b.y[1] - b.y[0] - end) < 1e-14);
    assert_true(fabs(b.y[0] + b.y[1] - (2 + g + v - d)) < 1e-14);
}

/* A step that winds rods round the ring many times, and rods pressed together by any force. */
static void test_absurd_steps_end(void **state)
{
    (void)state;
    static struct bench b;
    for (int trial = 0; trial < 40; trial++) {
        set_up(&b, RODS_MAX, 1, trial % 2 ? 1e-6 : 0);
        b.noise.tick = 1000 * trial;
        place_at_random(&b);
        b.noise.deviation = trial < 20 ? 1e6 : 1e-6;
        draw_motion(&b, trial % 3 ? 1e6 : 0);
        bonds_move(&b.ring, &b.noise, &b.space);
        for (int64_t i = 0; i < b.ring.n; i++)
            assert_true(isfinite(b.y[i]) && b.queued[i] == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_rings),
        cmocka_unit_test(test_clusters_move_by_their_mean),
        cmocka_unit_test(test_elastic_collision_with_drift),
        cmocka_unit_test(test_absurd_steps_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
