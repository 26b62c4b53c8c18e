/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_worker_teams.c - chunks of small rings that workers run side by side. */
#include "plant.h"

#include "store_internal.h"
#include "store_results.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* They go side by side, more or fewer of them as there are workers, and are stopped on the way; in
 * the end they are what each is alone. */
static void teams_give_the_same_bytes(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE];
    int64_t together = 0;

    job_bench_submit(bench->store, NULL, job_bench_small_rings(12), id);
    for (size_t workers = 1; bench_state(bench->store, id) != JOB_DONE && workers < 5; workers++) {
        struct plant plant = plant_start(bench, workers);
        int64_t kept;

        plant_wait_progress(&plant, id, workers < 4 ? 0.2 * (double)workers : 2);
        if (workers == 4)
            assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
        plant_stop(&plant);
        kept = bench_number(bench->store, "SELECT count(*) FROM checkpoints");
        together = kept > together ? kept : together;
        bench_reopen(bench);
    }
    assert_true(together >= 4); /* the first worker alone had 8 of them */
    plant_assert_same_bytes(bench->store, id, job_bench_small_rings(12));
}

/* A checkpoint that is damaged costs its own chunk alone what was done. */
static void a_team_with_a_damaged_checkpoint(void **state)
{
    struct bench *bench = *state;
    struct bcd_scene *scene = job_bench_small_rings(8);
    const struct bcd_team_wanted wanted = {.scene = scene, .count = 8};
    struct bcd_team *team;
    struct plant plant;
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, NULL, job_bench_small_rings(8), id);
    assert_int_equal(store_jobs_start(bench->store, id), STORE_OK);
    assert_int_equal(bcd_team_create(&team, &wanted, NULL), BCD_OK);
    assert_int_equal(bcd_team_advance(team, 100000, NULL), BCD_OK);
    for (int64_t i = 0; i < 8; i++) {
        size_t size = bcd_run_checkpoint_size(bcd_team_run(team, i));
        char *bytes = malloc(size);

        assert_non_null(bytes);
        bcd_run_save(bcd_team_run(team, i), bytes);
        bytes[size / 2] = (char)(bytes[size / 2] ^ (i == 3));
        assert_int_equal(store_results_checkpoint(bench->store, id, i, bytes, size), STORE_OK);
        free(bytes);
    }
    bcd_team_free(team);
    bcd_scene_free(scene);
    plant = plant_start(bench, 1);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, job_bench_small_rings(8));
}

/* With its first checkpoint, long before its chunks are done. */
static void a_team_lets_others_in(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    const struct ticket bert = {.owner = "bert"};
    char team[JOB_ID_SIZE], one[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue,
                     experiment_scene("{'particles':10,'length':20,'time':1e5,'time_step':0.001,"
                                      "'realizations':8,'observables':{'energy':{}}}"),
                     team);
    plant_wait_start(&plant, team);
    job_bench_submit_as(bench->store, plant.queue, job_bench_scene(1, 1), &bert, one);
    assert_int_equal(job_bench_wait(bench->store, one), JOB_DONE);
    assert_int_equal(bench_state(bench->store, team), JOB_RUNNING);
    plant_stop(&plant);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM checkpoints"), 8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(teams_give_the_same_bytes),
        BENCH_TEST(a_team_with_a_damaged_checkpoint),
        BENCH_TEST(a_team_lets_others_in),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
