/* SPDX-License-Identifier: GPL-3.0-or-later
 * Equilibrium theory against itself: routes, consistency, extremes. */
#include "unit/theory_bench.h"

/* ------------------------------------------------------ one route against the other */

static void contour_and_recursion_agree(void **state)
{
    (void)state;
    struct theory_system systems[] = {rods(16, 20, .8, &u6),  rods(8, 10, .8, &u6),
                                      rods(8, 12, 1.3, &u6),  rods(20, 21, .99, &u6),
                                      rods(10, 20, .5, &u20), rods(16, 20, .8, &u6),
                                      rods(8, 10, .8, &u6),   rods(40, 50, .8, &u6),
                                      rods(20, 20, .7, &u20), rods(20, 25, 1e-3, &u6)};
    systems[5].pair = baxter(1);
    systems[6].pair = sticky(1, .05, 2.95);
    systems[7].pair = sticky(10, .05, 4.88);
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        struct theory_result *a = solve(theory_contour, &systems[i], &profiles);
        struct theory_result *b = solve(theory_chain, &systems[i], &profiles);
        assert_string_equal(a->route, "contour");
        assert_string_equal(b->route, "chain");
        assert_same(a, b, 1e-9);
        theory_result_free(a);
        theory_result_free(b);
    }
}

static void percus_and_transfer_operator_agree(void **state)
{
    (void)state;
    struct theory_system systems[] = {rods(80, 100, .8, &u6),  rods(100, 105, .99, &u6),
                                      rods(10, 20, 1.3, &u6),  rods(50, 100, 1e-3, &u6),
                                      rods(80, 100, .8, &u6),  rods(80, 100, .8, &u6),
                                      rods(80, 100, .8, &u6),  rods(10, 20, 1.3, &u6),
                                      rods(90, 100, .7, &u20), rods(16, 20, .8, NULL)};
    const double gamma[] = {0, 0, 0, 0, .01, 1, 10, 5, 0, 1};
    struct theory_wanted wanted = {.density_bins = 50, .contact_bins = 50};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        if (gamma[i] > 0) {
            systems[i].pair = baxter(gamma[i]);
        }
        struct theory_result *a = solve(theory_infinite, &systems[i], &wanted);
        struct theory_result *b = solve(theory_percus, &systems[i], &wanted);
        assert_same(a, b, 1e-9);
        assert_near(a->pressure, b->pressure, 1e-9);
        theory_result_free(a);
        theory_result_free(b);
    }
}

/* ---------------------------------------------------------------- consistency */

/* At L = 100 the ring differs from the infinite system by some per cent in the worst bin; not so
 * for many more rods. */
static void ring_tends_to_the_infinite_system(void **state)
{
    (void)state;
    double worst[3] = {0};
    for (int step = 0; step < 3; step++) {
        int64_t factor = step == 0 ? 1 : step == 1 ? 10 : 1000;
        struct theory_system system = rods(80 * factor, 100. * (double)factor, .8, &u6);
        system.pair = sticky(10, .05, 4.88);
        struct theory_wanted wanted = {.density_bins = 50};
        struct theory_result *a = solve(theory_canonical, &system, &wanted);
        struct theory_result *b = solve(theory_infinite, &system, &wanted);
        for (size_t i = 0; i < 50; i++) {
            worst[step] = fmax(worst[step], fabs(a->density[i] / b->density[i] - 1));
        }
        theory_result_free(a);
        theory_result_free(b);
    }
    print_message("worst bin, ring against infinite: %.3g %.3g %.3g\n", worst[0], worst[1],
                  worst[2]);
    assert_true(worst[0] > .01 && worst[0] < .1); /* physics.md 7: up to 8 % */
    assert_near(worst[0] / worst[1], 10, .2);
    assert_near(worst[1] / worst[2], 100, .02);
}

static void sums_come_out(void **state)
{
    (void)state;
    const route routes[] = {theory_contour, theory_chain, theory_infinite};
    for (int by = 0; by < 3; by++) {
        struct theory_system system = rods(16, 20, .8, &u6);
        system.pair = sticky(1, .05, 3);
        struct theory_wanted wanted = {.density_bins = 37,
                                       .contact_bins = 20,
                                       .contact_gap = .05,
                                       .gap_bins = 100,
                                       .gap_last = by < 2 ? 7.2 : 7};
        struct theory_result *r = solve(routes[by], &system, &wanted);
        double rods_per_period = 0, gaps = 0, bonds = 0, mean_gap = 0;
        for (size_t i = 0; i < 37; i++) {
            rods_per_period += r->density[i] / 37;
        }
        for (size_t i = 0; i < 100; i++) {
            gaps += r->gap[i] * wanted.gap_last / 100;
            mean_gap += r->gap[i] * ((double)i + .5) * pow(wanted.gap_last / 100, 2);
        }
        for (size_t i = 0; i < 20; i++) {
            bonds += r->contact_window[i] * .05 / 20 / .8;
        }
        assert_near(rods_per_period, .8, 1e-12);
        assert_near(gaps, 1, by < 2 ? 1e-9 : 1e-3);
        assert_near(mean_gap, .45, .03); /* bins of .07: as good as that */
        assert_near(bonds, r->bonded_fraction, 1e-9);
        theory_result_free(r);
    }
}

/* A pair distribution over all of the ring counts every other rod once: on half of it, half of
 * them. */
static void pairs_are_counted_once(void **state)
{
    (void)state;
    const struct theory_pair pairs[] = {{0}, sticky(1, .05, 3)};
    for (int p = 0; p < 2; p++) {
        struct theory_system system = rods(12, 16, .8, &u6);
        system.pair = pairs[p];
        struct theory_wanted wanted = {.pair_bins = 50, .pair_last = 8};
        struct theory_result *r = solve(theory_canonical, &system, &wanted);
        double others = 0;
        for (size_t i = 0; i < 50; i++) {
            others += r->pair[i] * .16 * .75;
        }
        assert_near(others, 5.5, 1e-9);
        theory_result_free(r);
    }
}

/* The first bins of the pair distribution are the gap distribution seen otherwise; bonds are
 * counted where they lie. */
static void neighbours_are_pairs(void **state)
{
    (void)state;
    struct theory_system system = rods(30, 40, .8, &u6);
    for (int sticks = 0; sticks < 2; sticks++) {
        system.pair = sticks ? sticky(1, .05, 3) : (struct theory_pair){0};
        for (int infinite = 0; infinite < 2; infinite++) {
            struct theory_wanted wanted = {
                .gap_bins = 16, .gap_last = .8, .pair_bins = 32, .pair_last = 1.6};
            struct theory_result *r =
                solve(infinite ? theory_infinite : theory_canonical, &system, &wanted);
            for (size_t i = 0; i < 16; i++) {
                assert_near(r->pair[16 + i] * .75, r->gap[i], 1e-7);
            }
            theory_result_free(r);
        }
    }
    system.pair = baxter(1);
    struct theory_wanted wanted = {
        .gap_bins = 16, .gap_last = .8, .pair_bins = 32, .pair_last = 1.6};
    struct theory_result *r = solve(theory_infinite, &system, &wanted);
    for (size_t i = 0; i < 16; i++) {
        assert_near(r->pair[16 + i] * .75, r->gap[i], 1e-7);
    }
    assert_true(r->gap[0] * .05 > r->bonded_fraction);
    theory_result_free(r);
}

/* A window changes a contact density by O(Delta'). */
static void window_shrinks_to_contact(void **state)
{
    (void)state;
    struct theory_system system = rods(16, 20, .8, &u6);
    double before = 0;
    for (double window = 8e-3; window > 1e-3; window /= 2) {
        struct theory_wanted wanted = {.contact_bins = 20, .contact_gap = window};
        struct theory_result *r = solve(theory_canonical, &system, &wanted);
        double now = distance(r->contact_window, r->contact, 20);
        assert_true(now < 10 * window);
        if (before > 0) {
            assert_near(before / now, 2, .05);
        }
        before = now;
        theory_result_free(r);
    }
}

/* --------------------------------------------------------------------- extremes */

static void dense_and_deep_systems(void **state)
{
    (void)state;
    static const double u100 = 100;
    const struct theory_system systems[] = {
        rods(100, 105, .99, &u6),  rods(80, 100, .8, &u20),        rods(60, 80, 1.3, &u20),
        rods(50, 100, 1e-3, &u20), rods(40, 100, .5, &u100),       rods(50, 50, .7, &u100),
        rods(1000, 1250, .8, &u6), rods(1000000, 1250000, .8, &u6)};
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        struct theory_wanted wanted = {.density_bins = 50};
        struct theory_result *r = solve(theory_canonical, &systems[i], &wanted);
        double sum = 0;
        for (size_t bin = 0; bin < 50; bin++) {
            assert_true(r->density[bin] >= 0);
            sum += r->density[bin] / 50;
        }
        assert_near(sum, (double)systems[i].particles / systems[i].length, 1e-10);
        theory_result_free(r);
    }
}

static void speed(void **state)
{
    (void)state;
    struct theory_system system = rods(80, 100, .8, &u6);
    system.pair = sticky(10, .05, 4.88);
    clock_t start = clock();
    struct theory_wanted wanted = profiles;
    wanted.pair_bins = 50;
    wanted.pair_last = 2;
    struct theory_result *r = solve(theory_canonical, &system, &wanted);
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    print_message("N = 80, L = 100, gamma = 10, range .05: %.2f s, %zu points, error %.1e\n",
                  seconds, r->points, r->error);
    assert_true(seconds < 20);
    theory_result_free(r);
}

static double not_finite(const void *ctx, double x)
{
    (void)ctx;
    return x > .5 ? NAN : 0;
}

static double step(const void *ctx, double x)
{
    (void)ctx;
    return x - floor(x) < .37 ? 0 : 2;
}

static void hopeless_is_refused_in_words(void **state)
{
    (void)state;
    struct theory_system system[13];
    struct theory_wanted wanted[13];
    const route routes[] = {theory_canonical, theory_infinite};
    for (size_t i = 0; i < 13; i++) {
        system[i] = rods(8, 10, .8, &u6);
        wanted[i] = (struct theory_wanted){.density_bins = 10};
    }
    system[0].temperature = 0;
    system[1].diameter = 1.25;
    system[2].diameter = 1.3;
    system[3].length = 10.5;
    system[4].particles = 0;
    system[5].energy = not_finite;
    system[6].energy = step; /* never resolved to 1e-9 */
    system[7].pair = sticky(1, .9, 3);
    system[8].pair = (struct theory_pair){.kind = THEORY_ENERGY, .energy = as_energy, .cutoff = 2};
    system[9].pair = baxter(NAN);
    system[10].temperature = NAN;
    wanted[11].tolerance = 1e-15;
    wanted[12].pair_bins = 10; /* without a last distance */
    for (size_t i = 0; i < 13; i++) {
        for (int by = 0; by < 2; by++) {
            struct theory_result *result = (struct theory_result *)&system;
            struct bcd_error error = {0};
            assert_int_equal(routes[by](&result, &system[i], &wanted[i], &error), BCD_INVALID);
            assert_int_equal(error.code, BCD_INVALID);
            assert_true(strlen(error.text) > 10);
            assert_ptr_equal(result, &system);
            if (i < 3) { /* nobody needs to ask why */
                assert_int_equal(routes[by](&result, &system[i], &wanted[i], NULL), BCD_INVALID);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(contour_and_recursion_agree),
        cmocka_unit_test(percus_and_transfer_operator_agree),
        cmocka_unit_test(ring_tends_to_the_infinite_system),
        cmocka_unit_test(sums_come_out),
        cmocka_unit_test(pairs_are_counted_once),
        cmocka_unit_test(neighbours_are_pairs),
        cmocka_unit_test(window_shrinks_to_contact),
        cmocka_unit_test(dense_and_deep_systems),
        cmocka_unit_test(speed),
        cmocka_unit_test(hopeless_is_refused_in_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
