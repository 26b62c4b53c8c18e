/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_worker_limits.c - exact theory at a job's end is shared, and stops when the job or the
 * daemon does; jobs that take more than they may are failed, and the worker is clean for the next
 * one. */
#include "plant.h"

#include "store_results.h"
#include "support/experiment.h"
#include "worker.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define SHORT                                                                                      \
    "'particles':10,'length':20,'diameter':0.5,'potential':{'type':'cosine','amplitude':2},"       \
    "'time_step':0.001,'observables':{'density':{'bins':20},'energy':{},"                          \
    "'contact_density':{'bins':5,'gap':0.01}}"

/* A run of a moment, and a theory of half a minute. */
static struct bcd_scene *slow_theory(void)
{
    return experiment_scene("{'particles':9,'length':4000,'diameter':0.5,'time':0.1,"
                            "'potential':{'type':'cosine','amplitude':6},'time_step':0.001,"
                            "'observables':{'density':{'bins':20}}}");
}

/* Of this process alone: what else the machine does is no matter. */
static double processor_s(void)
{
    struct timespec now;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Until the run is over and the theory has begun. */
static void wait_for_theory(struct plant *plant, const char *id)
{
    struct theory_counts counts = {0};

    plant_wait_progress(plant, id, 1);
    for (int waited = 0; waited < 60000 && counts.computed == 0; waited++) {
        theory_cache_count(queue_theories(plant->queue), &counts);
        job_bench_nap(1);
    }
    assert_int_equal(counts.computed, 1);
    job_bench_nap(50);
}

static void wait_until_idle(const struct plant *plant)
{
    struct workers_counts counts = {.busy = 1};

    for (int waited = 0; waited < 60000 && counts.busy > 0; waited++) {
        workers_count(plant->workers, &counts);
        job_bench_nap(1);
    }
    assert_int_equal(counts.busy, 0);
}

static void a_cancel_reaches_the_theory(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    char id[JOB_ID_SIZE], next[JOB_ID_SIZE];
    struct bcd_theory_cost cost;
    struct bcd_scene *scene = slow_theory();

    bcd_theory_estimate(scene, BCD_THEORY_RING, 0, &cost);
    assert_true(cost.seconds > 10); /* else this test shows nothing */
    job_bench_submit(bench->store, plant.queue, scene, id);
    wait_for_theory(&plant, id);
    double before = processor_s();
    assert_int_equal(store_jobs_cancel(bench->store, id), STORE_OK);
    queue_cancel(plant.queue, id);
    wait_until_idle(&plant);
    assert_true(processor_s() - before < 2);
    assert_int_equal(bench_state(bench->store, id), JOB_CANCELLED);
    job_bench_submit(bench->store, plant.queue, experiment_scene("{%s,'time':1}", SHORT), next);
    assert_int_equal(job_bench_wait(bench->store, next), JOB_DONE);
    plant_stop(&plant);
}

static void a_stop_reaches_the_theory(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue, slow_theory(), id);
    wait_for_theory(&plant, id);
    double before = processor_s();
    plant_stop(&plant);
    assert_true(processor_s() - before < 2);
    assert_int_equal(bench_state(bench->store, id), JOB_RUNNING); /* the next start ends it */
    plant = plant_start(bench, 1);
    wait_for_theory(&plant, id);
    plant_stop(&plant);
    assert_int_equal(bench_state(bench->store, id), JOB_RUNNING);
}

/* Two workers, two jobs: one theory, and the bytes are those of each alone. */
static void jobs_share_a_theory(void **state)
{
    static const char *const rest[] = {"'time':1,'seed':1", "'time':2,'seed':2,'realizations':3",
                                       "'time':1,'seed':1,'equilibration_time':1"};
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    struct theory_counts counts;
    char id[3][JOB_ID_SIZE], other[JOB_ID_SIZE];

    for (int i = 0; i < 3; i++)
        job_bench_submit(bench->store, plant.queue, experiment_scene("{%s,%s}", SHORT, rest[i]),
                         id[i]);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(job_bench_wait(bench->store, id[i]), JOB_DONE);
        plant_assert_same_bytes(bench->store, id[i], experiment_scene("{%s,%s}", SHORT, rest[i]));
    }
    theory_cache_count(queue_theories(plant.queue), &counts);
    assert_int_equal(counts.computed, 1);
    assert_int_equal(counts.shared, 2);
    /* Another temperature is another equilibrium. */
    job_bench_submit(bench->store, plant.queue,
                     experiment_scene("{%s,%s,'temperature':2}", SHORT, rest[0]), other);
    assert_int_equal(job_bench_wait(bench->store, other), JOB_DONE);
    theory_cache_count(queue_theories(plant.queue), &counts);
    assert_int_equal(counts.computed, 2);
    plant_stop(&plant);
}

/* Each of more kinds of jobs than are kept is computed, and none of them is lost to the others. */
static void the_cache_is_bounded(void **state)
{
    (void)state;
    struct theory_cache *cache = theory_cache_create();
    struct theory_counts counts;

    for (int turn = 0; turn < 2; turn++) {
        for (int i = 0; i < 70; i++) {
            struct bcd_watch watch = {0};
            struct bcd_theory *theory = NULL;
            struct bcd_scene *scene =
                experiment_scene("{'particles':1,'length':%d,'diameter':0.5,'time':1,"
                                 "'observables':{'density':{'bins':5}}}",
                                 i + 2);
            assert_int_equal(theory_cache_make(cache, scene, BCD_THEORY_RING, &watch, &theory),
                             BCD_OK);
            bcd_theory_free(theory);
            bcd_scene_free(scene);
        }
    }
    theory_cache_count(cache, &counts);
    assert_int_equal(counts.shared, 0); /* the oldest always has just gone */
    assert_int_equal(counts.computed, 140);
    theory_cache_free(cache);
}

/* What is over the limit by far is not begun, and says so; the job has its other columns. */
static void hopeless_theories_are_not_begun(void **state)
{
    (void)state;
    struct bcd_watch watch = {.seconds_max = 1e-3};
    struct bcd_theory *theory = NULL;
    struct bcd_table *table = NULL;
    struct bcd_scene *scene = experiment_scene("{%s,'time':1}", SHORT);

    assert_int_equal(bcd_theory_create(&theory, scene, BCD_THEORY_RING, &watch, NULL), BCD_OK);
    assert_true(bcd_theory_cut_short(theory) && watch.seconds == 0);
    assert_int_equal(bcd_theory_table(theory, scene, 0, &table), BCD_OK);
    const struct bcd_column *column = bcd_table_column(table, BCD_ROLE_THEORY);
    assert_null(column->values);
    assert_non_null(strstr(column->reason, "would take about"));
    bcd_table_free(table);
    bcd_theory_free(theory);
    bcd_scene_free(scene);
}

static void assert_failed(struct store *store, const char *id, const char *reason)
{
    struct job_record record;

    assert_int_equal(job_bench_wait(store, id), JOB_FAILED);
    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    if (!strstr(record.error, reason))
        fail_msg("no \"%s\" in \"%s\"", reason, record.error);
    job_record_fini(&record);
}

static void too_long_a_run_is_failed(void **state)
{
    struct bench *bench = *state;
    struct job_limits limits = job_limits_usual();
    char id[JOB_ID_SIZE], next[JOB_ID_SIZE];

    limits.overrun_factor = 0;
    limits.overrun_seconds = 0.2;
    struct plant plant = plant_start_within(bench, 1, &limits);
    job_bench_submit(bench->store, plant.queue, experiment_scene("{%s,'time':1e6,'seed':3}", SHORT),
                     id);
    assert_failed(bench->store, id, "more than 0 times the estimate and 0.2 more");
    job_bench_submit(bench->store, plant.queue, experiment_scene("{%s,'time':1}", SHORT), next);
    assert_int_equal(job_bench_wait(bench->store, next), JOB_DONE);
    plant_assert_same_bytes(bench->store, next, experiment_scene("{%s,'time':1}", SHORT));
    plant_stop(&plant);
}

static void too_much_memory_is_failed(void **state)
{
    struct bench *bench = *state;
    struct job_limits limits = job_limits_usual();
    char id[JOB_ID_SIZE], next[JOB_ID_SIZE];

    limits.run_bytes = 1e5;
    struct plant plant = plant_start_within(bench, 1, &limits);
    job_bench_submit(bench->store, plant.queue,
                     experiment_scene("{'particles':100000,'length':200000,'diameter':0.5,"
                                      "'time':1,'force':1,'observables':{'energy':{}}}"),
                     id);
    assert_failed(bench->store, id, "more than 100000 bytes of memory");
    job_bench_submit(bench->store, plant.queue,
                     experiment_scene("{'particles':5,'length':10,'diameter':0.5,'time':1,"
                                      "'force':1,'observables':{'energy':{}}}"),
                     next);
    assert_int_equal(job_bench_wait(bench->store, next), JOB_DONE);
    plant_stop(&plant);
}

/* What it took is known to the calibration, for the next estimate. */
static void theory_is_calibrated(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    double seconds = 0;
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue, experiment_scene("{%s,'time':1}", SHORT), id);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    calibration_factor(queue_calibration(plant.queue), CALIBRATION_THEORY, &seconds);
    assert_true(seconds > 0.002);
    plant_stop(&plant);
}

#define LIMITS_TEST(function)                                                                      \
    cmocka_unit_test_setup_teardown(function, bench_set_up, bench_tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        LIMITS_TEST(a_cancel_reaches_the_theory),
        LIMITS_TEST(a_stop_reaches_the_theory),
        LIMITS_TEST(jobs_share_a_theory),
        cmocka_unit_test(the_cache_is_bounded),
        cmocka_unit_test(hopeless_theories_are_not_begun),
        LIMITS_TEST(too_long_a_run_is_failed),
        LIMITS_TEST(too_much_memory_is_failed),
        LIMITS_TEST(theory_is_calibrated),
    };
    return cmocka_run_group_tests_name("limits of jobs", tests, NULL, NULL);
}
