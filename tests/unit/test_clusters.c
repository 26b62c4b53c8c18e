/* SPDX-License-Identifier: GPL-3.0-or-later
 * The two published forms of the BCD step as kernels: against the isotonic form, against the slow
 * reference, and between walls against the conditions that make a line the projection of another;
 * contact forces against those conditions, too. */
#include "kernels/chronological.h"
#include "kernels/contact_forces.h"
#include "kernels/isotonic.h"
#include "kernels/premerging.h"
#include "reference/bcd_step.h"
#include "reference/random_ring.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>

enum { FORMS = 3, RODS_MAX = 100000 };
static const char *const form_names[FORMS] = {"isotonic", "chronological", "premerging"};

struct bench {
    struct lane lane;
    double scale; /* the largest number: what rounding is measured by */
    double *y, *displacement, *z, *out[FORMS], *force;
    struct isotonic_block *blocks;
    struct cluster *stack;
    struct chronological work;
};

static void *take(size_t count, size_t size)
{
    void *at = calloc(count, size);
    assert_non_null(at);
    return at;
}

static void bench_open(struct bench *b, size_t n)
{
    b->y = take(n, sizeof(double));
    b->displacement = take(n, sizeof(double));
    b->z = take(n, sizeof(double));
    b->force = take(n, sizeof(double));
    for (int f = 0; f < FORMS; f++)
        b->out[f] = take(n, sizeof(double));
    b->blocks = take(isotonic_blocks((int64_t)n), sizeof *b->blocks);
    b->stack = take(n, sizeof *b->stack);
    b->work = (struct chronological){take(n, sizeof(struct cluster)), take(n, sizeof(int64_t)),
                                     take(n, sizeof(double)), take(n, sizeof(int64_t))};
}

static void bench_close(struct bench *b)
{
    free(b->y), free(b->displacement), free(b->z), free(b->force);
    for (int f = 0; f < FORMS; f++)
        free(b->out[f]);
    free(b->blocks), free(b->stack);
    free(b->work.clusters), free(b->work.first_of), free(b->work.time), free(b->work.winner);
}

/* A ring; or a line of the same rods, from wall to wall. */
static void prepare(struct bench *b, const struct ring_recipe *recipe, bool walls,
                    struct dice *dice)
{
    random_ring(b->y, b->displacement, recipe, dice);
    b->lane = (struct lane){recipe->n, recipe->ell, walls, b->y[0]};
    b->scale = fmax(1, recipe->ell);
    for (int i = 0; i < recipe->n; i++) {
        b->z[i] = b->y[i] + b->displacement[i];
        b->displacement[i] = b->z[i] - b->y[i];
        b->scale = fmax(b->scale, fmax(fabs(b->y[i]), fabs(b->z[i])));
    }
}

static void step(struct bench *b, int form)
{
    const struct lane *lane = &b->lane;
    memcpy(b->out[form], b->z, sizeof(double) * (size_t)lane->n);
    if (form == 1)
        chronological_step(lane, b->y, b->out[form], &b->work);
    else if (form == 2)
        premerging_step(lane, b->y, b->out[form], b->stack);
    else if (lane->walls)
        isotonic_walls(b->out[form], lane->n, lane->low, lane->low + lane->ell, b->blocks);
    else
        isotonic_ring(b->out[form], lane->n, lane->ell, b->blocks);
}

static void complain(const struct bench *b, int form, const char *what)
{
    printf("# %s: n = %d, ell = %a, walls %d at %a\n", form_names[form], (int)b->lane.n,
           b->lane.ell, b->lane.walls, b->lane.low);
    for (int i = 0; i < b->lane.n && i < 64; i++)
        printf("# %d: y %a, z %a -> %a, isotonic %a\n", i, b->y[i], b->z[i], b->out[form][i],
               b->out[0][i]);
    fail_msg("%s: %s", form_names[form], what);
}

/* In order to the last bit, within the walls; and where isotonic_* puts the rods. */
static double check_form(const struct bench *b, int form)
{
    const struct lane *lane = &b->lane;
    const double *out = b->out[form];
    double low = lane->walls ? lane->low : out[0], off = 0;
    for (int64_t i = 0; i < lane->n; i++) {
        if (!(out[i] >= low && out[i] <= low + lane->ell) && lane->n > 1)
            complain(b, form, "out of reach");
        if (i > 0 && !(out[i - 1] <= out[i]))
            complain(b, form, "out of order");
        off = fmax(off, fabs(out[i] - b->out[0][i]));
    }
    double roundoff = 32 * DBL_EPSILON * b->scale * fmax(1, sqrt((double)lane->n) / 8);
    if (!(off <= roundoff))
        complain(b, form, "not where the isotonic form puts the rods");
    return off / (DBL_EPSILON * b->scale);
}

/* Contact for contact, where it cannot be a matter of rounding. */
static void check_contacts(const struct bench *b, int form)
{
    for (int64_t i = 0; i < b->lane.n; i++)
        if (lane_contact(&b->lane, b->out[form], i) != lane_contact(&b->lane, b->out[0], i))
            complain(b, form, "not in contact where the isotonic form is");
}

static void check_slow_reference(const struct bench *b, int form)
{
    double expected[REFERENCE_RODS_MAX];
    int n = (int)b->lane.n;
    memcpy(expected, b->y, sizeof(double) * (size_t)n);
    reference_bcd_step(expected, b->displacement, n, b->lane.ell);
    for (int i = 0; i < n; i++)
        if (!(fabs(b->out[form][i] - expected[i]) <= 32 * DBL_EPSILON * b->scale))
            complain(b, form, "not where the slow reference puts the rods");
}

/* What the two rods or the wall beside it do to rod i makes up for all that z - out lacks, no
 * contact pulls, and only contacts push: the conditions of Karush, Kuhn and Tucker. */
static void check_forces(struct bench *b, int form)
{
    const struct lane *lane = &b->lane;
    const double *out = b->out[form];
    double slack = 4 * DBL_EPSILON * b->scale * (double)(lane->n + 1);
    contact_forces(lane, b->z, out, 1, b->force);
    for (int64_t i = 0; i < lane->n; i++) {
        bool first = lane->walls && i == 0;
        double from_left = first ? 0 : b->force[lane_previous(lane, i)];
        double wall = b->z[i] - out[i] + from_left - b->force[i]; /* what is left over */
        bool at_low = lane->walls && i == 0 && out[i] <= lane->low;
        bool at_high = lane->walls && i == lane->n - 1 && out[i] >= lane->low + lane->ell;
        if (!(wall <= slack) && !at_high)
            complain(b, form, "forces do not balance (pushed right)");
        if (!(wall >= -slack) && !at_low)
            complain(b, form, "forces do not balance (pushed left)");
        if (!(b->force[i] >= 0) || (b->force[i] > 0 && !lane_contact(lane, out, i)))
            complain(b, form, "a pull, or a push without contact");
    }
}

/* Displacements whose clusters do not meet by a hair's breadth. */
static bool generic(const struct bench *b, const struct ring_recipe *recipe)
{
    return recipe->kind == DISPLACE_NORMAL && recipe->ell > 1e-6 * b->scale;
}

static void compare(const struct ring_recipe *sort, bool walls, int rounds, uint64_t seed)
{
    struct bench b;
    bench_open(&b, REFERENCE_RODS_MAX);
    struct dice dice = {seed};
    double worst = 0;
    for (int round = 0; round < rounds; round++) {
        struct ring_recipe recipe = *sort;
        recipe.n = recipe.n ? recipe.n : 1 + round % 40;
        recipe.kind = (enum displacement_kind)(round / 40 % DISPLACE_KINDS);
        if (recipe.ell < 0)
            recipe.ell = -recipe.ell * pow(10, 4 * dice_uniform(&dice) - 2);
        prepare(&b, &recipe, walls, &dice);
        for (int form = 0; form < FORMS; form++) {
            step(&b, form);
            worst = fmax(worst, check_form(&b, form));
            check_forces(&b, form);
            if (generic(&b, &recipe))
                check_contacts(&b, form);
            if (!walls && form > 0 && recipe.n <= 13)
                check_slow_reference(&b, form);
        }
    }
    printf("# walls %d ell %g closed %g amplitude %g: %.1f ulp at worst\n", walls, sort->ell,
           sort->closed, sort->amplitude, worst);
    bench_close(&b);
}

static void test_rings_and_lines(void **state)
{
    (void)state;
    static const double closed[] = {0, 0.5, 0.95, 1}; /* 1: one cluster, open at most at the seam */
    uint64_t seed = 1;
    for (int walls = 0; walls < 2; walls++)
        for (int k = 0; k < 4; k++)
            for (int size = -2; size <= 1; size++) {
                struct ring_recipe recipe = {
                    .ell = -1, .closed = closed[k], .amplitude = pow(10, size)};
                compare(&recipe, walls, 1600, seed++);
            }
}

static void test_far_from_the_origin(void **state)
{
    (void)state;
    for (int walls = 0; walls < 2; walls++) {
        struct ring_recipe recipe = {.ell = -1, .origin = -3e5, .closed = 0.5, .amplitude = 1};
        compare(&recipe, walls, 1600, 100);
    }
}

static void test_little_or_no_room(void **state)
{
    (void)state;
    for (int walls = 0; walls < 2; walls++)
        for (int digits = 3; digits <= 18; digits++) {
            struct ring_recipe recipe = {.closed = 0.5, .amplitude = 1};
            recipe.ell = digits == 18 ? 0 : pow(10, -digits);
            compare(&recipe, walls, 400, 200 + (uint64_t)digits);
        }
}

/* A ring far beyond the others' size, sparse and as one cluster: ends, soon, and agrees. Rods
 * flying apart break off one by one: the worst case of the event by event form, with fewer of them.
 */
static void test_many_rods(void **state)
{
    (void)state;
    struct bench b;
    bench_open(&b, RODS_MAX);
    struct dice dice = {7};
    const struct ring_recipe recipes[] = {
        {.n = RODS_MAX, .ell = RODS_MAX, .closed = 0.3, .amplitude = 1},
        {.n = RODS_MAX, .ell = 1e-3, .closed = 0.9, .amplitude = 1},
        {.n = RODS_MAX, .ell = 1e3, .closed = 0.99, .amplitude = 0.1},
        {.n = 4000, .ell = 1e3, .closed = 1, .amplitude = 1, .kind = DISPLACE_FLOW},
    };
    for (int r = 0; r < 4; r++) {
        prepare(&b, &recipes[r], false, &dice);
        for (int form = 0; form < FORMS; form++) {
            clock_t begin = clock();
            step(&b, form);
            double ns = 1e9 * (double)(clock() - begin) / CLOCKS_PER_SEC / recipes[r].n;
            printf("# %d rods, ring %d, %s: %.0f ns a rod\n", recipes[r].n, r, form_names[form],
                   ns);
            check_form(&b, form);
        }
    }
    bench_close(&b);
}

/* Known by hand: rods 1, 2, 3 of four are driven together with displacements 3, 0, -3, from
 * contact, across the seam; the fourth stands apart. */
static void test_forces_by_hand(void **state)
{
    (void)state;
    const struct lane lane = {4, 5, false, 0};
    const double y[] = {1, 1, 3, 6};      /* rods 3, 0, 1 are in contact: 6 = 1 + 5 */
    const double z[] = {1, -2, 3, 6 + 3}; /* 3, 0, -3 */
    double force[4];
    contact_forces(&lane, z, y, 10, force);
    const double expected[] = {30, 0, 0, 30};
    for (int i = 0; i < 4; i++)
        assert_true(fabs(force[i] - expected[i]) < 1e-12);
    /* Pressed to the low wall: the wall takes all, rod 0 is pushed by rods 1 and 2. */
    const struct lane walled = {3, 5, true, 1};
    const double at[] = {1, 1, 1}, driven[] = {1, 0.5, -1};
    contact_forces(&walled, driven, at, 2, force);
    assert_true(fabs(force[0] - 5) < 1e-12 && fabs(force[1] - 4) < 1e-12 && force[2] == 0);
    /* To the high wall. */
    const double top[] = {6, 6, 6}, up[] = {7, 6.5, 6};
    contact_forces(&walled, up, top, 2, force);
    assert_true(fabs(force[0] - 2) < 1e-12 && fabs(force[1] - 3) < 1e-12 && force[2] == 0);
    /* No room, round a ring and from wall to wall: the least forces without a pull. */
    const double none[] = {0, 0, 0}, out[] = {-1, 1, 0};
    contact_forces(&(struct lane){3, 0, false, 0}, out, none, 1, force);
    assert_true(force[0] == 0 && force[1] == 1 && force[2] == 1);
    contact_forces(&(struct lane){3, 0, true, 0}, out, none, 1, force);
    assert_true(force[0] == 0 && force[1] == 1 && force[2] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rings_and_lines),   cmocka_unit_test(test_far_from_the_origin),
        cmocka_unit_test(test_little_or_no_room), cmocka_unit_test(test_many_rods),
        cmocka_unit_test(test_forces_by_hand),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
