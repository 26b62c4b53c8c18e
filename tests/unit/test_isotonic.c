/* SPDX-License-Identifier: GPL-3.0-or-later
 * The isotonic step against the papers' step done the slow way (reference/bcd_step.h), and against
 * the conditions that make a ring the projection of another (Karush, Kuhn, Tucker). */
#include "kernels/isotonic.h"
#include "reference/bcd_step.h"
#include "reference/random_ring.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { RODS_MAX = 4096 };

/* One ring on its way through the kernel. */
struct trial {
    int n;
    double ell, scale; /* scale: the largest number in it, what rounding is measured by */
    double y[RODS_MAX], displacement[RODS_MAX], z[RODS_MAX], out[RODS_MAX];
    struct isotonic_block blocks[RODS_MAX / 2 + 1];
};

static void prepare(struct trial *t, const struct ring_recipe *recipe, struct dice *dice)
{
    t->n = recipe->n;
    t->ell = recipe->ell;
    t->scale = fmax(1, recipe->ell);
    random_ring(t->y, t->displacement, recipe, dice);
    for (int i = 0; i < t->n; i++) {
        t->z[i] = t->y[i] + t->displacement[i];
        /* What z really is displaced by: far from the origin the sum is rounded. */
        t->displacement[i] = t->z[i] - t->y[i];
        t->scale = fmax(t->scale, fmax(fabs(t->y[i]), fabs(t->z[i])));
    }
}

static void project(struct trial *t)
{
    /* A block too many would be written here. */
    const double guard = 12345.0;
    struct isotonic_block *end = t->blocks + isotonic_blocks(t->n);
    if (end < t->blocks + RODS_MAX / 2 + 1)
        end->base = guard;
    memcpy(t->out, t->z, sizeof *t->out * (size_t)t->n);
    isotonic_ring(t->out, t->n, t->ell, t->blocks);
    if (end < t->blocks + RODS_MAX / 2 + 1)
        assert_true(end->base == guard);
}

static void print_ring(const struct trial *t)
{
    printf("# n = %d, ell = %a\n", t->n, t->ell);
    for (int i = 0; i < t->n && i < 64; i++)
        printf("# z[%d] = %a -> %a\n", i, t->z[i], t->out[i]);
}

/* In order, to the last bit, also across the seam: otherwise gaps are negative. */
static void check_order(const struct trial *t)
{
    for (int i = 0; i < t->n; i++) {
        double ahead = i + 1 < t->n ? t->out[i + 1] : t->out[0] + t->ell;
        if (!(t->out[i] <= ahead)) {
            print_ring(t);
            fail_msg("rods %d and next out of order: %a, %a", i, t->out[i], ahead);
        }
    }
}

/* Force across each contact: zero where rods are apart, a push (>= 0) where they touch. It is the
 * running sum of z - out, started at an open contact; around the ring it comes back to zero. */
static void check_optimal(const struct trial *t)
{
    int n = t->n, start = -1;
    for (int i = 0; i < n; i++)
        if (t->out[i] < (i + 1 < n ? t->out[i + 1] : t->out[0] + t->ell))
            start = i;      /* the contact after rod i is open */
    bool rigid = start < 0; /* closed all round: the push is known up to a constant */
    long double push = 0, roundoff = 2.0L * DBL_EPSILON * t->scale * (n + 1);
    for (int k = 1; k <= n; k++) {
        int i = (start + k + n) % n;
        push += (long double)t->z[i] - t->out[i];
        bool open = t->out[i] < (i + 1 < n ? t->out[i + 1] : t->out[0] + t->ell);
        bool bad = open ? fabsl(push) > roundoff : !rigid && push < -roundoff;
        if (bad || !(fabsl(push) < HUGE_VALL)) {
            print_ring(t);
            fail_msg("rod %d: push %Lg across %s contact", i, push, open ? "an open" : "a closed");
        }
        if (open)
            push = 0;
    }
    if (rigid && !(fabsl(push) <= roundoff))
        fail_msg("rigid ring moved by %Lg", push);
}

/* Same positions, and where the reference has rods in contact the kernel has equal numbers. */
static void check_reference(const struct trial *t, bool contacts)
{
    double expected[REFERENCE_RODS_MAX];
    memcpy(expected, t->y, sizeof *expected * (size_t)t->n);
    reference_bcd_step(expected, t->displacement, t->n, t->ell);
    double roundoff = 32 * DBL_EPSILON * t->scale;
    for (int i = 0; i < t->n; i++) {
        if (!(fabs(t->out[i] - expected[i]) <= roundoff)) {
            print_ring(t);
            fail_msg("rod %d: %a, reference %a", i, t->out[i], expected[i]);
        }
        double ahead = i + 1 < t->n ? t->out[i + 1] : t->out[0] + t->ell;
        double gap = (i + 1 < t->n ? expected[i + 1] : expected[0] + t->ell) - expected[i];
        if (contacts && t->n > 1 && (gap <= 2 * roundoff) != (t->out[i] == ahead)) {
            print_ring(t);
            fail_msg("contact after rod %d: gap %a, reference %a", i, ahead - t->out[i], gap);
        }
    }
}

/* Many small rings of one sort. */
static void compare(const struct ring_recipe *sort, int rounds, uint64_t seed)
{
    struct trial *t = malloc(sizeof *t);
    assert_non_null(t);
    struct dice dice = {seed};
    for (int round = 0; round < rounds; round++) {
        struct ring_recipe recipe = *sort;
        if (recipe.n == 0)
            recipe.n = 1 + round % 13;
        if (recipe.ell < 0) /* from a hundredth to a hundred of |ell| */
            recipe.ell = -recipe.ell * pow(10, 4 * dice_uniform(&dice) - 2);
        prepare(t, &recipe, &dice);
        project(t);
        check_order(t);
        check_optimal(t);
        /* With ties two clusters may just touch: there contact is a matter of rounding. */
        bool generic = recipe.kind == DISPLACE_NORMAL && recipe.ell > 1e-6 * t->scale;
        check_reference(t, generic);
    }
    free(t);
}

static void test_small_rings(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 0, .ell = -1, .closed = 0.5};
    for (int kind = 0; kind < DISPLACE_KINDS; kind++) {
        recipe.kind = (enum displacement_kind)kind;
        for (int size = -2; size <= 1; size++) {
            recipe.amplitude = pow(10, size);
            compare(&recipe, 2600, 100 + (uint64_t)(10 * kind + size + 2));
        }
    }
}

static void test_fifty_rods(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 50, .ell = -20, .closed = 0.5};
    for (int size = -2; size <= 1; size++) {
        recipe.amplitude = pow(10, size);
        compare(&recipe, 60, 200 + (uint64_t)(size + 2));
    }
}

static void test_mostly_closed_and_all_open(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 0, .ell = -1, .closed = 0.95, .amplitude = 0.1};
    compare(&recipe, 2600, 300);
    recipe.closed = 0;
    compare(&recipe, 2600, 301);
}

static void test_no_room(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 0, .ell = 0, .closed = 0.5, .amplitude = 1};
    compare(&recipe, 1300, 400);
    recipe.origin = -3e5;
    compare(&recipe, 1300, 401);
    recipe.ell = 1e-13; /* room below rounding at this distance */
    compare(&recipe, 1300, 402);
}

static void test_little_room(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 0, .closed = 0.5, .amplitude = 1};
    for (int digits = 3; digits <= 17; digits++) {
        recipe.ell = pow(10, -digits);
        compare(&recipe, 650, 500 + (uint64_t)digits);
    }
}

/* Unwrapped coordinates after many turns: order and bitwise contact must hold there too. */
static void test_far_away(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 0, .ell = 1, .closed = 0.5, .amplitude = 0.3};
    for (int digits = 1; digits <= 15; digits++) {
        recipe.origin = (digits % 2 ? 1 : -1) * pow(10, digits);
        recipe.ell = digits % 3 ? 1 : 1e-3;
        compare(&recipe, 1300, 600 + (uint64_t)digits);
    }
}

static void test_large_displacements(void **state)
{
    (void)state;
    struct ring_recipe recipe = {.n = 0, .ell = 1, .closed = 0.5, .amplitude = 1e6};
    compare(&recipe, 2600, 700);
    recipe.amplitude = 1e300;
    recipe.n = 3;
    compare(&recipe, 100, 701);
}

/* The tail is made from the head, ell away, and rounded with it. A rod within that rounding of the
 * block across the seam must not end up on the wrong side of it. */
static void test_seam_rounding(void **state)
{
    (void)state;
    struct trial *t = malloc(sizeof *t);
    assert_non_null(t);
    struct dice dice = {650};
    t->n = 3;
    t->ell = t->scale = 1000;
    for (int round = 0; round < 20000; round++) {
        double image = 0.2 + 0.1 * dice_uniform(&dice);
        t->z[0] = image - t->ell;
        t->z[2] = image + 0.1 * dice_uniform(&dice);
        double mean = (t->z[0] + t->ell + t->z[2]) / 2;
        bool behind = round % 2;
        t->z[1] = behind ? mean : mean - t->ell;
        for (int ulps = 0; ulps < round % 50; ulps++)
            t->z[1] = nextafter(t->z[1], behind ? -HUGE_VAL : HUGE_VAL);
        project(t);
        check_order(t);
        check_optimal(t);
    }
    free(t);
}

/* Too many rods for the references, but not for the conditions of optimality. */
static void test_many_rods_are_optimal(void **state)
{
    (void)state;
    struct trial *t = malloc(sizeof *t);
    assert_non_null(t);
    struct dice dice = {800};
    for (int round = 0; round < 60; round++) {
        struct ring_recipe recipe = {.n = round % 2 ? RODS_MAX : 777,
                                     .ell = 100 * pow(10, -(round % 7)),
                                     .origin = round % 5 ? 0 : 1e4,
                                     .closed = 0.1 * (round % 10),
                                     .amplitude = pow(10, -(round % 4)),
                                     .kind = round % DISPLACE_KINDS};
        prepare(t, &recipe, &dice);
        project(t);
        check_order(t);
        check_optimal(t);
    }
    free(t);
}

static void test_order_is_left_alone(void **state)
{
    (void)state;
    struct trial *t = malloc(sizeof *t);
    assert_non_null(t);
    struct dice dice = {900};
    for (int round = 0; round < 2000; round++) {
        struct ring_recipe recipe = {.n = 1 + round % 40, .ell = 3, .closed = 0.5, .amplitude = 0};
        prepare(t, &recipe, &dice);
        project(t);
        bool at_seam = t->n > 1 && t->z[t->n - 1] == t->z[0] + t->ell;
        for (int i = 0; i < t->n; i++) {
            if (at_seam) /* the head is rounded anew from the tail */
                assert_true(fabs(t->out[i] - t->z[i]) <= 4 * DBL_EPSILON);
            else
                assert_true(t->out[i] == t->z[i]);
        }
        /* Done once more it changes nothing at all. */
        double first[40];
        memcpy(first, t->out, sizeof *first * (size_t)t->n);
        memcpy(t->z, t->out, sizeof *first * (size_t)t->n);
        project(t);
        assert_memory_equal(first, t->out, sizeof *first * (size_t)t->n);
    }
    free(t);
}

/* Which rod is called the first is nobody's business: start labels elsewhere, same ring. */
static void test_labels_do_not_matter(void **state)
{
    (void)state;
    struct trial *a = malloc(sizeof *a), *b = malloc(sizeof *b);
    assert_non_null(a);
    assert_non_null(b);
    struct dice dice = {1000};
    for (int round = 0; round < 2000; round++) {
        struct ring_recipe recipe = {
            .n = 2 + round % 29, .ell = 2, .closed = 0.5, .amplitude = 0.5};
        prepare(a, &recipe, &dice);
        project(a);
        int shift = (int)(a->n * dice_uniform(&dice));
        b->n = a->n;
        b->ell = a->ell;
        for (int i = 0; i < a->n; i++)
            b->z[i] = a->z[(i + shift) % a->n] + (i + shift < a->n ? 0 : a->ell);
        project(b);
        for (int i = 0; i < a->n; i++) {
            double same = a->out[(i + shift) % a->n] + (i + shift < a->n ? 0 : a->ell);
            assert_true(fabs(b->out[i] - same) <= 32 * DBL_EPSILON * a->scale);
        }
    }
    free(a);
    free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_small_rings),
        cmocka_unit_test(test_fifty_rods),
        cmocka_unit_test(test_mostly_closed_and_all_open),
        cmocka_unit_test(test_no_room),
        cmocka_unit_test(test_little_room),
        cmocka_unit_test(test_far_away),
        cmocka_unit_test(test_seam_rounding),
        cmocka_unit_test(test_large_displacements),
        cmocka_unit_test(test_many_rods_are_optimal),
        cmocka_unit_test(test_order_is_left_alone),
        cmocka_unit_test(test_labels_do_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
