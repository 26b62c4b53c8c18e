/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_worker_hands.c - large rings that workers help one another with. */
#include "plant.h"

#include "support/experiment.h"
#include "store_jobs.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { WAIT_MS = 60000, LOOK_MS = 5 };

/* One ring, one chunk. Driven, so that no exact theory is looked for. */
static struct bcd_scene *one_ring(double time)
{
    struct bcd_scene *scene = experiment_scene(
        "{'particles':20000,'length':40000,'diameter':0.5,'time':%g,'force':1,'time_step':1e-4,"
        "'method':'bcd','time_step_error':'skipped','potential':{'type':'cosine','amplitude':6},"
        "'observables':{'msd':{'first':0.001,'last':0.01,'points':5},'density':{'bins':10},"
        "'energy':{}}}",
        time);

    assert_int_equal(bcd_scene_chunks(scene), 1);
    assert_true(bcd_scene_takes_hands(scene));
    return scene;
}

static void wait_helpers(const struct plant *plant, size_t wanted)
{
    struct workers_counts counts;

    for (int waited = 0; waited < WAIT_MS; waited += LOOK_MS) {
        workers_count(plant->workers, &counts);
        if (counts.helping == wanted)
            return;
        job_bench_nap(LOOK_MS);
    }
    fail_msg("%zu help, not %zu", counts.helping, wanted);
}

/* More or fewer help, and it is stopped on the way. */
static void helped_rings_give_the_same_bytes(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, NULL, one_ring(0.3), id);
    for (size_t workers = 2; bench_state(bench->store, id) != JOB_DONE && workers < 5; workers++) {
        struct plant plant = plant_start(bench, workers);

        plant_wait_progress(&plant, id, workers < 4 ? 0.3 * (double)(workers - 1) : 2);
        if (workers == 4)
            assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
        plant_stop(&plant);
        bench_reopen(bench);
    }
    plant_assert_same_bytes(bench->store, id, one_ring(0.3));
}

/* Who helps is there for others at once, and helps again afterwards. */
static void helpers_are_at_hand_for_others(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    const struct ticket bert = {.owner = "bert"};
    char ring[JOB_ID_SIZE], other[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue, one_ring(1000), ring);
    wait_helpers(&plant, 1);
    for (int i = 0; i < 3; i++) {
        job_bench_submit_as(bench->store, plant.queue, job_bench_scene(1, i), &bert, other);
        assert_int_equal(job_bench_wait(bench->store, other), JOB_DONE);
        assert_int_equal(bench_state(bench->store, ring), JOB_RUNNING);
        wait_helpers(&plant, 1);
    }
    assert_int_equal(store_jobs_cancel(bench->store, ring), STORE_OK);
    queue_cancel(plant.queue, ring);
    wait_helpers(&plant, 0);
    plant_stop(&plant);
}

/* A daemon that stops does not wait for who helps. */
static void a_helped_ring_is_stopped(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 3);
    char ring[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue, one_ring(1000), ring);
    wait_helpers(&plant, 2);
    plant_stop(&plant);
    assert_int_equal(bench_state(bench->store, ring), JOB_RUNNING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(helped_rings_give_the_same_bytes),
        BENCH_TEST(helpers_are_at_hand_for_others),
        BENCH_TEST(a_helped_ring_is_stopped),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
