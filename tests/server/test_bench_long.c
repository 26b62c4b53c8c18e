/* SPDX-License-Identifier: GPL-3.0-or-later
 * What steps, observables and a second worker cost, as ratios: seconds say more about the machine
 * than about the program. Each takes the least of up to three medians, for load only ever adds.
 * Nothing is measured under sanitizers. */
#include "bcd.h"
#include "cli_bench_observables.h"
#include "cli_bench_scaling.h"
#include "cli_bench_step.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

#ifdef __has_feature
#define FEATURE(name) __has_feature(name)
#else
#define FEATURE(name) 0
#endif
#if FEATURE(address_sanitizer) || FEATURE(thread_sanitizer) || defined(__SANITIZE_ADDRESS__) || \
    defined(__SANITIZE_THREAD__)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

enum { TRIES = 3 };

/* ------------------------------------------------------------------- steps */

/* A quarter above what was measured with gcc 12 on AMD EPYC (AVX-512), at 1000 rods. */
static const struct {
    const char *scene, *method;
    double most; /* whole step over noise and force */
} bounds[] = {
    {"free", "bcd", 1.25},     {"free", "elastic", 1.05}, {"free", "strang", 1.05},
    {"sparse", "bcd", 1.7},    {"sparse", "lm", 1.75},    {"sparse", "elastic", 1.5},
    {"sparse", "strang", 2.9}, {"dense", "bcd", 4.5},     {"dense", "lm", 4.2},
    {"dense", "elastic", 4.9}, {"dense", "strang", 6.2},  {"sticky", "bcd", 2.2},
    {"sticky", "strang", 3.6},
};

static void test_steps(void **state)
{
    (void)state;
    bool good = true;
    if (SANITIZED)
        skip();
    for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++) {
        const struct bench_case which = {bounds[i].scene, bounds[i].method, 1000, 1};
        double least = INFINITY;
        for (int k = 0; k < TRIES && least > bounds[i].most; k++) {
            struct bench_step step;
            assert_int_equal(bench_step_measure(&which, &bench_careful, &step), BENCH_DONE);
            least = fmin(least, step.timing.ratio);
        }
        print_message("%s %s: %.2f times noise and force, at most %.2f\n", which.scene,
                      which.method, least, bounds[i].most);
        good = good && least <= bounds[i].most;
    }
    assert_true(good);
}

/* The same work per rod whatever their number, but for caches. */
static void test_linear(void **state)
{
    (void)state;
    static const char *const methods[] = {"bcd", "strang", "elastic", "lm", "bcd_premerging"};
    bool good = true;
    if (SANITIZED)
        skip();
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        double ratio[2] = {INFINITY, INFINITY};
        for (int k = 0; k < TRIES; k++)
            for (int large = 0; large < 2; large++) {
                const struct bench_case which = {"dense", methods[m], large ? 300000 : 1000, 1};
                struct bench_step step;
                assert_int_equal(bench_step_measure(&which, &bench_usual, &step), BENCH_DONE);
                ratio[large] = fmin(ratio[large], step.timing.ratio);
            }
        double power = 1 + log(ratio[1] / ratio[0]) / log(300);
        print_message("%s: a step's cost over noise and force grows as N^%.3f\n", methods[m],
                      power);
        good = good && power < 1.08 && power > 0.92;
    }
    assert_true(good);
}

/* --------------------------------------------------------------- observables */

/* The goal is a fifth; a tenth is granted to noisy machines. */
static void test_observables(void **state)
{
    (void)state;
    static const char *const methods[] = {"strang", "bcd"};
    static const int64_t rods[] = {16, 1000};
    const double most = 1.3;
    bool good = true;
    if (SANITIZED)
        skip();
    for (size_t m = 0; m < 2; m++)
        for (size_t r = 0; r < 2; r++)
            for (size_t o = 0; bench_observable_name(o); o++) {
                double least = INFINITY;
                for (int k = 0; k < TRIES && least > most; k++) {
                    struct bench_timing timing;
                    assert_int_equal(bench_observable_measure(o, methods[m], rods[r], &timing),
                                     BENCH_DONE);
                    least = fmin(least, timing.ratio);
                }
                print_message("%s, %d rods, %s: %.3f of the bare run%s\n", methods[m],
                              (int)rods[r], bench_observable_name(o), least,
                              least > most ? ", too much" : "");
                good = good && least <= most;
            }
    assert_true(good);
}

/* ------------------------------------------------------------------- workers */

/* The goal is 1.9; where the machine gives less than that to two processes that share nothing, what
 * it gives but for a part of the last chunk. What others do to the cores is measured along: where
 * they keep more than 2 % of one busy, the clock tells nothing about us. The best of three quiet
 * tries counts, for what slows two cores at once from outside can only add; without a quiet one the
 * test is skipped. */
static void test_two_workers(void **state)
{
    (void)state;
    enum { TRIES_MAX = 12 };
    const double goal = 1.9, of_machine = 0.97, most = 0.02;
    bool good = false;
    int quiet = 0;
    if (SANITIZED)
        skip();
    for (int k = 0; k < TRIES_MAX && quiet < TRIES && !good; k++) {
        struct bench_scaling s;
        assert_int_equal(bench_scaling_measure(&s), BENCH_DONE);
        print_message("%.3f s, %.3f s with two workers: %.3f times as fast; two processes %.3f; "
                      "without waiting %.3f; others used %.3f cores\n",
                      s.seconds[BENCH_ONE], s.seconds[BENCH_TWO], s.speedup, s.machine, s.possible,
                      s.others);
        if (!(s.others <= most))
            continue;
        quiet++;
        good = s.speedup >= goal || s.share >= of_machine;
    }
    if (quiet == 0) {
        print_message("cores are busy with other work, or fewer than two: nothing can be told\n");
        skip();
    }
    assert_true(good);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_linear),
        cmocka_unit_test(test_observables),
        cmocka_unit_test(test_two_workers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
