/* SPDX-License-Identifier: GPL-3.0-or-later
 * fault_tests.h - the tests, with main, of test_faults.c and test_faults_long.c. An enum before it
 * says which k are taken: EVERY_CUT_AT_START, EVERY_FULL, EVERY_EIO, EVERY_ALLOCATION. */
#ifndef FAULT_TESTS_H
#define FAULT_TESTS_H

#include "fault_bench.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* Two that write or checkpoint can destroy a database (the WAL-reset bug of 3.7.0 to 3.51.2). */
static void one_connection_writes_and_checkpoints(void **state)
{
    assert_int_equal(fault_writers(*state), 1);
}

static void power_may_go_at_any_write(void **state)
{
    assert_in_range(fault_power_cuts(*state, 1), 50, 5000);
}

static void power_may_go_while_it_is_made(void **state)
{
    assert_in_range(fault_power_cuts_at_start(*state, EVERY_CUT_AT_START), 100, 5000);
}

static void the_disk_may_be_full_at_any_write(void **state)
{
    assert_in_range(fault_disk(*state, POWER_FULL_ON, EVERY_FULL), 30, 5000);
}

static void a_call_may_fail(void **state)
{
    assert_in_range(fault_disk(*state, POWER_EIO, EVERY_EIO), 100, 5000);
}

static void all_calls_may_fail_for_a_while(void **state)
{
    assert_in_range(fault_disk(*state, POWER_EIO_ON, EVERY_EIO), 100, 5000);
}

static void memory_may_run_out(void **state)
{
    assert_in_range(fault_memory(*state, EVERY_ALLOCATION), 500, 50000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(one_connection_writes_and_checkpoints),
        BENCH_TEST(power_may_go_at_any_write),
        BENCH_TEST(power_may_go_while_it_is_made),
        BENCH_TEST(the_disk_may_be_full_at_any_write),
        BENCH_TEST(a_call_may_fail),
        BENCH_TEST(all_calls_may_fail_for_a_while),
        BENCH_TEST(memory_may_run_out),
    };

    fault_bench_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#endif
