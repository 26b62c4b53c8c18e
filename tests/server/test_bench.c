/* SPDX-License-Identifier: GPL-3.0-or-later
 * The instrument itself: medians and their errors, two works in turns, what is refused. */
#include "bench_turns.h"
#include "cli_bench_observables.h"
#include "cli_bench_step.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

static void test_median(void **state)
{
    (void)state;
    double odd[] = {3, 1, 100}, even[] = {4, 1, 3, 2};
    assert_true(bench_median(odd, 3) == 3);
    assert_true(bench_median(even, 4) == 2.5);
}

/* Of 15 numbers evenly spread over [-7, 7] the median deviation is 4; one far off does not tell. */
static void test_median_stderr(void **state)
{
    (void)state;
    double values[15], disturbed[15];
    for (int i = 0; i < 15; i++)
        disturbed[i] = values[i] = i - 7;
    disturbed[14] = 1e9;
    double error = bench_median_stderr(values, 15);
    assert_true(fabs(error - 4 * 1.4826 * 1.2533 / sqrt(15)) < 1e-12);
    assert_true(bench_median_stderr(disturbed, 15) == error);
}

/* So many rounds of arithmetic a tick. */
struct rounds {
    int64_t per_tick, ticks;
    double x;
};

static bool advance(void *context, int64_t ticks)
{
    struct rounds *work = context;
    for (int64_t i = 0; i < ticks * work->per_tick; i++)
        work->x = sqrt(work->x + 1);
    work->ticks += ticks;
    return work->per_tick > 0;
}

static void test_turns(void **state)
{
    (void)state;
    const struct bench_effort effort = {2e6, 7};
    struct rounds one = {.per_tick = 1000}, three = {.per_tick = 3000}, broken = {0};
    struct bench_timing t;
    double ratio = INFINITY; /* nearest to 3 of a few: the machine has other things to do */
    for (int i = 0; i < 5; i++) {
        struct bench_work work[2] = {{advance, &one}, {advance, &three}};
        assert_int_equal(bench_turns(work, &effort, &t), BENCH_DONE);
        assert_true(t.ns[0] > 0 && t.ns[1] > 0 && t.ns_stderr[0] >= 0 && t.ratio_stderr >= 0);
        ratio = fabs(t.ratio - 3) < fabs(ratio - 3) ? t.ratio : ratio;
    }
    assert_true(fabs(ratio - 3) < 0.3);
    assert_true(one.ticks > 0 && three.ticks > 0);
    struct bench_work work[2] = {{advance, &one}, {advance, &broken}};
    assert_int_equal(bench_turns(work, &effort, &t), BENCH_FAILED);
}

static void test_steps(void **state)
{
    (void)state;
    const struct bench_effort brief = {1e5, 3};
    for (size_t i = 0; bench_scene_name(i); i++) {
        static const char *const methods[] = {"bcd", "lm", "strang"};
        for (size_t m = 0; m < 3; m++) {
            const struct bench_case which = {bench_scene_name(i), methods[m], 100, 1};
            struct bench_step step;
            assert_int_equal(bench_step_measure(&which, &brief, &step), BENCH_DONE);
            assert_true(step.timing.ratio > 0 && bench_step_ns(&which, &step, 1) > 0);
            assert_true(step.bytes_per_rod >= 8 && step.warm_steps > 0);
        }
    }
}

static void test_refused(void **state)
{
    (void)state;
    struct bench_step step;
    const struct bench_case no_method = {"sparse", "none", 100, 1},
                            no_scene = {"none", "bcd", 100, 1};
    assert_int_equal(bench_step_measure(&no_method, &bench_usual, &step), BENCH_REFUSED);
    assert_int_equal(bench_step_measure(&no_scene, &bench_usual, &step), BENCH_REFUSED);
    assert_null(bench_scene_members(&no_scene));
    assert_null(bench_scene_name(4));
    size_t count = 0;
    while (bench_observable_name(count))
        count++;
    assert_int_equal(count, 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_median), cmocka_unit_test(test_median_stderr),
        cmocka_unit_test(test_turns),  cmocka_unit_test(test_steps),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
