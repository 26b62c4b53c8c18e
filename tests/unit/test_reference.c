/* SPDX-License-Identifier: GPL-3.0-or-later
 * The references themselves: cases worked out by hand, and the two against each other. */
#include "reference/bcd_step.h"
#include "reference/random_ring.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

typedef void reference(double *y, const double *displacement, int n, double ell);

struct by_hand {
    int n;
    double ell, y[4], displacement[4], end[4];
};

/* All positions are multiples of 1/8 or 1/12: exact up to the last rounding. */
static const struct by_hand cases[] = {
    /* One rod goes where it likes, however far. */
    {1, 1, {0.25}, {7.5}, {7.75}},
    {1, 0, {0.25}, {-7.5}, {-7.25}},
    /* Two rods that do not meet. */
    {2, 4, {0, 1}, {0.25, -0.25}, {0.25, 0.75}},
    /* Two rods collide at 1/2 and go on with mean velocity 0. */
    {2, 4, {0, 1}, {1, -1}, {0.5, 0.5}},
    /* The same across the seam: rod 1 runs into the image of rod 0, at 4. */
    {2, 4, {0, 3}, {-1, 1}, {-0.5, 3.5}},
    /* In contact and pulled apart: they fragment. Pushed together: they go on with the mean. */
    {2, 4, {1, 1}, {-0.5, 0.5}, {0.5, 1.5}},
    {2, 4, {1, 1}, {0.75, -0.25}, {1.25, 1.25}},
    /* Pulled apart so far that they meet again on the far side of the ring: half a ring apart
       either way, mean position kept. */
    {2, 1, {0, 0}, {-2, 2}, {-0.5, 0.5}},
    /* No room: a rigid body. */
    {3, 0, {2, 2, 2}, {3, -1, 1}, {3, 3, 3}},
    /* Three in contact, forces 2 -1 2: the mean of the left two (1/2) is below the third; the first
       does not leave the second. */
    {3, 9, {0, 0, 0}, {2, -1, 2}, {0.5, 0.5, 2}},
    /* Forces -2 1 -2: the first leaves, the others stay together. */
    {3, 9, {0, 0, 0}, {-2, 1, -2}, {-2, -0.5, -0.5}},
    /* A fast rod hits a resting pair at t = 1/2: velocity 2 becomes 2/3. */
    {3, 9, {0, 1, 1}, {2, 0, 0}, {4. / 3, 4. / 3, 4. / 3}},
    /* Two collisions one after the other: rod 0 meets rod 1 at t = 1/4 (then velocity 2), both meet
       rod 2, at 2, at t = 3/4 (then 4/3). */
    {3, 9, {0, 1, 2}, {4, 0, 0}, {7. / 3, 7. / 3, 7. / 3}},
    /* A contact across the seam opens. */
    {2, 4, {0, 4}, {1, -1}, {1, 3}},
    /* A contact across the seam is pushed: 0 and 1 move with the mean 1/4 and stay in contact. */
    {2, 4, {0, 4}, {-0.25, 0.75}, {0.25, 4.25}},
};

static void check_by_hand(reference *step)
{
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        double y[4];
        for (int i = 0; i < cases[c].n; i++)
            y[i] = cases[c].y[i];
        step(y, cases[c].displacement, cases[c].n, cases[c].ell);
        for (int i = 0; i < cases[c].n; i++)
            if (!(fabs(y[i] - cases[c].end[i]) < 1e-15))
                fail_msg("case %zu, rod %d: %.17g, not %.17g", c, i, y[i], cases[c].end[i]);
    }
}

static void test_event_driven_by_hand(void **state)
{
    (void)state;
    check_by_hand(reference_bcd_step);
}

static void test_projection_by_hand(void **state)
{
    (void)state;
    check_by_hand(reference_projection);
}

/* The physics of collisions and the optimisation problem have nothing in common but the result. */
static void test_event_driven_is_the_projection(void **state)
{
    (void)state;
    struct dice dice = {20221};
    for (int round = 0; round < 4000; round++) {
        struct ring_recipe recipe = {.n = 1 + round % 9,
                                     .ell = round % 11 == 3 ? 0 : 4 * dice_uniform(&dice),
                                     .closed = 0.5,
                                     .amplitude = round % 3 ? 0.3 : 5,
                                     .kind = round % DISPLACE_KINDS};
        double y[9], again[9], displacement[9];
        random_ring(y, displacement, &recipe, &dice);
        for (int i = 0; i < recipe.n; i++)
            again[i] = y[i];
        reference_bcd_step(y, displacement, recipe.n, recipe.ell);
        reference_projection(again, displacement, recipe.n, recipe.ell);
        for (int i = 0; i < recipe.n; i++)
            if (!(fabs(y[i] - again[i]) < 1e-14))
                fail_msg("round %d, rod %d: %.17g and %.17g", round, i, y[i], again[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_event_driven_by_hand),
        cmocka_unit_test(test_projection_by_hand),
        cmocka_unit_test(test_event_driven_is_the_projection),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
