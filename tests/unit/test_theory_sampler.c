/* SPDX-License-Identifier: GPL-3.0-or-later
 * Exact equilibrium configurations, a few thousand of each kind, against exact references. */
#include "sampler_bench.h"

static void each_kind_of_rods(void **state)
{
    (void)state;
    /* hard, Baxter's limit, finite range; all but the last by chains that close */
    struct theory_system systems[] = {rods(1, 3, .5, &u6),   rods(16, 20, .8, &u6),
                                      rods(16, 20, .8, &u6), rods(8, 12, 1.3, &u6),
                                      rods(8, 10, .8, &u6),  rods(12, 12, .7, &u20)};
    systems[2].pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = 1};
    systems[3].pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = .3};
    systems[4].pair =
        (struct theory_pair){.kind = THEORY_STICKY, .strength = 1, .range = .05, .exponent = 2.95};
    for (size_t i = 0; i < 6; i++) {
        check_system(&systems[i], i < 5 ? 4000 : 400, i > 0 && i < 5);
    }
}

static void same_uniforms_same_configuration(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, &u6);
    system.pair = (struct theory_pair){.kind = THEORY_BAXTER, .strength = 1};
    double y[2][16];
    for (int i = 0; i < 2; i++) {
        struct theory_sampler *sampler = sampler_of(&system);
        uint64_t seed = 77;
        struct theory_uniforms uniforms = {.next = next_uniform, .ctx = &seed};
        for (int k = 0; k < 10; k++) {
            assert_int_equal(theory_sampler_draw(sampler, y[i], &uniforms, NULL), BCD_OK);
        }
        theory_sampler_free(sampler);
    }
    assert_memory_equal(y[0], y[1], sizeof y[0]);
}

static double some_energy(const void *ctx, double r)
{
    (void)ctx;
    return 1 - r;
}

static void refusals(void **state)
{
    (void)state;
    struct theory_system systems[5];
    for (size_t i = 0; i < 5; i++) {
        systems[i] = rods(16, 20, .8, &u6);
    }
    systems[0].temperature = 0;
    systems[1].particles = 25;
    systems[2].pair =
        (struct theory_pair){.kind = THEORY_ENERGY, .energy = some_energy, .cutoff = 1};
    systems[3].length = 20.5;
    systems[4].particles = 2000000;
    systems[4].length = 2e6;
    for (size_t i = 0; i < 5; i++) {
        struct theory_sampler *sampler = NULL;
        struct bcd_error error = {0};
        assert_int_equal(theory_sampler_create(&sampler, &systems[i], &error), BCD_INVALID);
        assert_null(sampler);
        assert_true(strlen(error.text) > 10);
    }
    theory_sampler_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_kind_of_rods),
        cmocka_unit_test(same_uniforms_same_configuration),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
