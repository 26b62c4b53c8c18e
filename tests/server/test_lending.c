/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_lending.c - the threads that lend chunks: as many as there are chunks in workers' hands, and
 * no more chunks waiting for a worker than may soon be taken. */
#include "job_bench.h"
#include "lease.h"
#include "limits.h"
#include "worker.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { CHUNKS = 60, PATIENCE_MS = 60000 };

struct lending {
    struct queue *queue;
    struct leases *leases;
    struct workers *workers;
    struct lease_loan loans[CHUNKS];
    int64_t held;
};

static struct lending begin(struct bench *bench, size_t most)
{
    struct lending lending = {.leases = leases_create(600000)};

    assert_int_equal(queue_create(&lending.queue, bench->store), STORE_OK);
    assert_int_equal(queue_recover(lending.queue), STORE_OK);
    lending.workers = workers_start_lending(most, lending.queue, bench->store, lending.leases);
    assert_non_null(lending.workers);
    return lending;
}

static void end(struct lending *lending)
{
    workers_stop(lending->workers);
    leases_free(lending->leases);
    queue_free(lending->queue);
    while (lending->held > 0)
        lease_loan_fini(&lending->loans[--lending->held]);
}

static struct lease_counts counts(const struct lending *lending)
{
    struct lease_counts found;

    leases_count(lending->leases, &found);
    return found;
}

/* One more worker comes and stays; false = there is nothing for it even after that time. */
static bool take(struct lending *lending, int wait_ms)
{
    const struct lease_asker asker = {"ada", "node"};
    struct lease_loan *loan = &lending->loans[lending->held];

    for (; leases_take(lending->leases, &asker, loan) != STORE_OK; wait_ms--) {
        if (wait_ms <= 0)
            return false;
        job_bench_nap(1);
    }
    lending->held++;
    return true;
}

static void until_offered(const struct lending *lending, size_t wanted)
{
    for (int waited = 0; waited < PATIENCE_MS && counts(lending).offered != wanted; waited++)
        job_bench_nap(1);
    assert_int_equal(counts(lending).offered, wanted);
}

static void threads_come_with_workers(void **state)
{
    struct bench *bench = *state;
    struct lending lending = begin(bench, LIMIT_WORKERS_MAX);
    struct workers_counts threads;
    char id[JOB_ID_SIZE];

    workers_count(lending.workers, &threads);
    assert_int_equal(threads.started, LIMIT_LENDING_FIRST);
    assert_int_equal(threads.most, LIMIT_WORKERS_MAX);
    job_bench_submit(bench->store, lending.queue, job_bench_scene(CHUNKS, 1), id);
    assert_true(CHUNKS > 2 * LIMIT_LENDING_FIRST);
    for (int i = 0; i < CHUNKS; i++)
        assert_true(take(&lending, PATIENCE_MS));
    assert_int_equal(counts(&lending).held, CHUNKS);
    workers_count(lending.workers, &threads);
    assert_true(threads.started >= CHUNKS && threads.alive == threads.started);
    assert_true(threads.started < CHUNKS + 2 * LIMIT_LENDING_FIRST);
    end(&lending);
}

static void what_nobody_takes_stays_in_the_queue(void **state)
{
    struct bench *bench = *state;
    struct lending lending = begin(bench, LIMIT_WORKERS_MAX);
    char id[JOB_ID_SIZE];
    size_t offered;

    job_bench_submit(bench->store, lending.queue, job_bench_scene(CHUNKS, 1), id);
    for (int waited = 0; waited < PATIENCE_MS && counts(&lending).offered < LIMIT_LEASES_OFFERED;
         waited++)
        job_bench_nap(1);
    job_bench_nap(100);
    offered = counts(&lending).offered; /* those who take chunks at the same time look before */
    assert_in_range(offered, LIMIT_LEASES_OFFERED, LIMIT_LEASES_OFFERED + LIMIT_LENDING_TAKE);

    /* Slurm is asked for as many workers as chunks are offered. */
    leases_expect(lending.leases, CHUNKS);
    until_offered(&lending, CHUNKS);
    assert_int_equal(counts(&lending).expected, CHUNKS);
    end(&lending);
}

static void no_more_are_lent_than_said(void **state)
{
    enum { MOST = 3 };
    struct bench *bench = *state;
    struct lending lending = begin(bench, MOST);
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, lending.queue, job_bench_scene(CHUNKS, 1), id);
    for (int i = 0; i < MOST; i++)
        assert_true(take(&lending, PATIENCE_MS));
    assert_false(take(&lending, 100));
    assert_true(counts(&lending).missed > 0);
    assert_int_equal(counts(&lending).held + counts(&lending).offered, MOST);
    end(&lending);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(threads_come_with_workers),
        BENCH_TEST(what_nobody_takes_stays_in_the_queue),
        BENCH_TEST(no_more_are_lent_than_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
