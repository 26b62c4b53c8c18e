/* SPDX-License-Identifier: GPL-3.0-or-later
 * Exact equilibrium configurations of many kinds of rings, 20000 of each, against exact references.
 */
#include "sampler_bench.h"

static void hard_rods(void **state)
{
    (void)state;
    const struct wave wide = {6, 1.5};
    const struct theory_system systems[] = {
        rods(1, 3, .5, &u6),   rods(2, 3, .8, &u6),    rods(3, 3, .7, &u20),
        rods(16, 20, .8, &u6), rods(8, 12, 1.3, &u6),  rods(16, 20, .8, NULL),
        rods(20, 30, 0, &u6),  rods(20, 21, .99, &u6), rods(12, 15, .4, &wide)};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        check_system(&systems[i], 20000, systems[i].particles > 3);
    }
}

static void baxter_rods(void **state)
{
    (void)state;
    struct theory_system systems[] = {rods(2, 3, .8, &u6), rods(16, 20, .8, &u6),
                                      rods(8, 12, 1.3, &u6), rods(16, 20, .8, NULL)};
    const double gamma[] = {10, 1, .3, 1};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        systems[i].pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = gamma[i]};
        check_system(&systems[i], 20000, systems[i].particles > 3);
    }
}

static void rods_of_finite_range(void **state)
{
    (void)state;
    /* The last two: every gap of a ring may be within reach, or must be. */
    struct theory_system systems[] = {rods(3, 4, .8, &u6), rods(8, 10, .8, &u6),
                                      rods(16, 20, .8, NULL), rods(2, 2, .8, &u6),
                                      rods(4, 4, .9, &u6)};
    const double gamma[] = {10, 1, 1, 2, 5}, range[] = {.05, .05, .1, .3, .5};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        systems[i].pair = (struct theory_pair){.kind = THEORY_STICKY,
                                               .strength = gamma[i],
                                               .range = range[i],
                                               .exponent = i % 2 ? 3 : 2.95};
        check_system(&systems[i], 20000, systems[i].particles > 4);
    }
}

/* Rods locked to wells, very dense, all in reach of one another: the recursion draws these. */
static void rings_that_chains_do_not_close(void **state)
{
    (void)state;
    struct theory_system systems[] = {rods(20, 20, .7, &u20), rods(30, 30, .99, &u6),
                                      rods(30, 30, .99, &u6), rods(10, 10, .9, &u6)};
    systems[2].pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = .1};
    systems[3].pair =
        (struct theory_pair){.kind = THEORY_STICKY, .strength = 3, .range = .1, .exponent = 2.95};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        check_system(&systems[i], 2000, false);
    }
}

static void large_rings(void **state)
{
    (void)state;
    struct theory_system system = rods(1000, 1250, .8, &u6);
    for (int sticks = 0; sticks < 2; sticks++) {
        system.pair = sticks ? (struct theory_pair){.kind = THEORY_STICKY,
                                                    .strength = 10,
                                                    .range = .05,
                                                    .exponent = 4.88}
                             : (struct theory_pair){0};
        clock_t start = clock();
        struct theory_sampler *sampler = sampler_of(&system);
        double setup = (double)(clock() - start) / CLOCKS_PER_SEC;
        struct theory_wanted wanted = {0};
        struct theory_result *result = NULL;
        assert_int_equal(theory_canonical(&result, &system, &wanted, NULL), BCD_OK);
        static double y[1000];
        uint64_t seed = 5;
        struct theory_uniforms uniforms = {.next = next_uniform, .ctx = &seed};
        enum { DRAWS = 20 };
        double sum = 0, square = 0;
        start = clock();
        for (int i = 0; i < DRAWS; i++) {
            assert_int_equal(theory_sampler_draw(sampler, y, &uniforms, NULL), BCD_OK);
            check_order(&system, y);
            double energy = 0;
            for (int k = 0; k < 1000; k++) {
                energy += wave(&u6, y[k] + k * .8) / 1000;
            }
            sum += energy / DRAWS;
            square += energy * energy / DRAWS;
        }
        double z = (sum - result->energy) / sqrt((square - sum * sum) / (DRAWS - 1));
        print_message("N 1000: set-up %.2f s, %.0f ms a draw, z energy %.2f\n", setup,
                      1e3 * (double)(clock() - start) / CLOCKS_PER_SEC / DRAWS, z);
        assert_true(fabs(z) < 6); /* Student's t with 19 degrees of freedom: 1e-5 */
        theory_result_free(result);
        theory_sampler_free(sampler);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hard_rods),
        cmocka_unit_test(baxter_rods),
        cmocka_unit_test(rods_of_finite_range),
        cmocka_unit_test(rings_that_chains_do_not_close),
        cmocka_unit_test(large_rings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
