/* SPDX-License-Identifier: GPL-3.0-or-later
 * A worker takes a job up, runs it and makes its tables while the n-th allocation fails,
 * for every n: the job is done all the same, with the same bits, and nothing is left behind. */
#include "short_memory.h"

#include "server/plant.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { ALLOCATIONS_MAX = 20000, WAIT_MS = 20000 };

static struct bcd_scene *scene(long seed)
{
    return experiment_scene("{'particles':10,'length':20,'diameter':0.5,'force':1,'time':0.5,"
                            "'time_step':0.01,'realizations':40,'seed':%ld,'observables':{"
                            "'msd':{'first':0.02,'last':0.1,'points':3},'density':{'bins':4},"
                            "'energy':{}}}",
                            seed);
}

/* Until the worker has done so many chunks and has nothing to do, or much time has gone by. The
 * store is asked for nothing: that would need memory here. */
static void wait_idle(const struct plant *plant, int64_t chunks)
{
    struct workers_counts counts = {0};

    for (int waited = 0; waited < WAIT_MS; waited++) {
        workers_count(plant->workers, &counts);
        if (counts.chunks >= chunks && counts.busy == 0)
            return;
        job_bench_nap(1);
    }
}

/* True while there was an allocation to fail. */
static bool fail_one(struct bench *bench, long n)
{
    struct plant plant = plant_start(bench, 1);
    struct bcd_scene *job = scene(n);
    int64_t chunks = bcd_scene_chunks(job);
    char id[JOB_ID_SIZE];
    bool failed;

    job_bench_submit(bench->store, NULL, job, id);
    short_memory_begin(n, false);
    queue_take(plant.queue, "local");
    wait_idle(&plant, chunks);
    failed = short_memory_end();
    if (job_bench_wait(bench->store, id) != JOB_DONE)
        fail_msg("allocation %ld failed, and with it the job", n);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, scene(n));
    return failed;
}

static void a_worker_does_without(void **state)
{
    struct bench *bench = *state;
    long blocks, n = 0;

    fail_one(bench, ALLOCATIONS_MAX); /* what is made once is made */
    blocks = short_memory_blocks();
    while (fail_one(bench, ++n)) {
        assert_true(n < ALLOCATIONS_MAX);
        if (short_memory_blocks() > blocks + 64)
            fail_msg("allocation %ld failed, %ld blocks are left", n,
                     short_memory_blocks() - blocks);
    }
    print_message("# %ld allocations\n", n - 1);
    assert_true(n > 50);
}

int main(void)
{
    const struct CMUnitTest tests[] = {BENCH_TEST(a_worker_does_without)};

    short_memory_init();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
