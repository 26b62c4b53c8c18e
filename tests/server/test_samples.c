/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_samples.c - store_samples.h against what it promises; jobs that take over what others of
 * their family measured, and jobs with a target, give the bytes of a job that was left alone,
 * however they are stopped, crowded, or given damaged goods. */
#include "plant.h"

#include "limits.h"
#include "store_internal.h"
#include "store_samples.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ------------------------------------------------------------------------ store */

/* A job of its own that leaves this behind. */
static void keep(struct store *store, int64_t realizations, const char *whole,
                 char from[JOB_ID_SIZE])
{
    unsigned char family[JOB_HASH_SIZE] = {7};
    char copy[16];
    struct sample_new sample = {.realizations = realizations, .chunks = 1, .whole.bytes = copy};
    const struct samples_kept kept = {
        .family = family, .outcome = "{\"a\":1}", .samples = &sample, .count = 1};
    const struct finish_new finish = {.kept = &kept};

    bench_insert(store, 100 + (int)bench_number(store, "SELECT count(*) FROM jobs"), "{}", from);
    assert_int_equal(store_results_finish_with(store, from, &finish), STORE_CONFLICT);
    assert_int_equal(store_jobs_start(store, from), STORE_OK);
    sample.whole.size = (size_t)snprintf(copy, sizeof copy, "%s", whole);
    assert_int_equal(store_results_finish_with(store, from, &finish), STORE_OK);
}

static void the_largest_that_fits_is_found(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    unsigned char family[JOB_HASH_SIZE] = {7}, other[JOB_HASH_SIZE] = {8};
    char from[JOB_ID_SIZE], id[JOB_ID_SIZE];
    struct sample_query query = {.id = id, .family = family, .most = 99};
    struct family_sample sample;

    keep(store, 8, "eight", from);
    keep(store, 27, "damaged", from);
    keep(store, 27, "27", id);
    bench_insert(store, 2, "{}", id);
    assert_int_equal(store_samples_find(store, &query, &sample), STORE_OK);
    assert_int_equal(sample.realizations, 27);
    assert_int_equal(sample.chunks, 1);
    assert_string_equal(sample.job, from);
    assert_null(sample.rest.bytes);
    bench_assert_blob(&sample.whole, "27");
    family_sample_fini(&sample);
    query.most = 26;
    assert_int_equal(store_samples_find(store, &query, &sample), STORE_OK);
    assert_int_equal(sample.realizations, 8);
    family_sample_fini(&sample);
    query.above = 8;
    assert_int_equal(store_samples_find(store, &query, &sample), STORE_NOT_FOUND);
    query = (struct sample_query){.id = id, .family = other, .most = 99};
    assert_int_equal(store_samples_find(store, &query, &sample), STORE_NOT_FOUND);
}

/* Who keeps a sample once more may have cut it another way. */
static void a_sample_kept_again_is_as_it_was_kept_last(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    unsigned char family[JOB_HASH_SIZE] = {7};
    char bytes[] = "abcd";
    struct sample_new sample;
    const struct samples_kept kept = {
        .family = family, .outcome = "{}", .samples = &sample, .count = 1};
    const struct finish_new finish = {.kept = &kept};
    char from[JOB_ID_SIZE], id[JOB_ID_SIZE];
    struct sample_query query = {.id = id, .family = family, .most = 99};
    struct family_sample found;

    bench_insert(store, 2, "{}", id);
    for (int i = 0; i < 3; i++) {
        bool whole = i == 1;

        sample = (struct sample_new){.realizations = 8, .chunks = whole};
        *(whole ? &sample.whole : &sample.rest) = (struct blob){.bytes = bytes, .size = 4};
        bench_insert(store, 200 + i, "{}", from);
        assert_int_equal(store_jobs_start(store, from), STORE_OK);
        assert_int_equal(store_results_finish_with(store, from, &finish), STORE_OK);
        assert_int_equal(store_samples_find(store, &query, &found), STORE_OK);
        assert_int_equal(found.chunks, whole);
        assert_int_equal(found.whole.bytes != NULL, whole);
        assert_int_equal(found.rest.bytes != NULL, !whole);
        family_sample_fini(&found);
    }
}

static void a_base_lasts_as_long_as_the_job_runs(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    unsigned char family[JOB_HASH_SIZE] = {7};
    char from[JOB_ID_SIZE], id[JOB_ID_SIZE], third[JOB_ID_SIZE];
    const struct sample_query query = {.id = id, .family = family, .most = 99};
    struct family_sample sample, base;

    keep(store, 8, "eight", from);
    bench_insert(store, 2, "{}", id);
    bench_insert(store, 3, "{}", third);
    assert_int_equal(store_samples_base(store, id, &base), STORE_NOT_FOUND);
    assert_int_equal(store_samples_find(store, &query, &sample), STORE_OK);
    assert_int_equal(store_samples_adopt(store, id, sample.seq), STORE_OK);
    assert_int_equal(store_samples_adopt(store, id, sample.seq), STORE_OK);
    assert_int_equal(store_samples_adopt(store, third, sample.seq), STORE_OK);
    assert_int_equal(store_samples_base(store, id, &base), STORE_OK);
    assert_int_equal(base.realizations, 8);
    family_sample_fini(&base);
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    assert_int_equal(store_samples_base(store, id, &base), STORE_NOT_FOUND);
    assert_int_equal(store_samples_adopt(store, id, sample.seq), STORE_CONFLICT);
    assert_int_equal(store_samples_adopt(store, third, sample.seq + 9), STORE_NOT_FOUND);
    /* Damaged: gone for everybody. */
    assert_int_equal(store_samples_drop(store, sample.seq), STORE_OK);
    assert_int_equal(store_samples_base(store, third, &base), STORE_NOT_FOUND);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM samples"), 0);
    family_sample_fini(&sample);
}

static void a_job_run_by_force_takes_nothing_over(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    unsigned char family[JOB_HASH_SIZE] = {7};
    char from[JOB_ID_SIZE], first[JOB_ID_SIZE];
    struct job_new job = bench_job(1, "{}");
    struct job_record record = {0};
    struct family_sample sample;
    bool existed = true;

    bench_insert(store, 1, "{}", first);
    assert_int_equal(store_jobs_start(store, first), STORE_OK);
    keep(store, 8, "eight", from);
    job.force = true;
    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
    assert_false(existed);
    const struct sample_query query = {.id = record.id, .family = family, .most = 99};
    assert_int_equal(store_samples_find(store, &query, &sample), STORE_NOT_FOUND);
    /* The newest stands; and the first again when that came to nothing. */
    assert_int_equal(store_jobs_cancel(store, record.id), STORE_OK);
    job_record_fini(&record);
    job.force = false;
    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
    assert_true(existed);
    assert_string_equal(record.id, first);
    job_record_fini(&record);
}

/* ---------------------------------------------------------------------- workers */

/* Realizations of a millisecond or so, 8 to a chunk. */
#define FAMILY(more)                                                                               \
    "{'particles':20,'length':40,'diameter':0.5,'force':1,'time':12,'time_step':0.001,"            \
    "'method':'strang','potential':{'type':'cosine','amplitude':6}," more                          \
    ",'observables':{'msd':{'first':0.01,'last':1,'points':8},'density':{'bins':20},"              \
    "'energy':{}}}"

static struct bcd_scene *of(int realizations)
{
    return experiment_scene(FAMILY("'realizations':%d"), realizations);
}

static struct bcd_scene *aiming(const char *relative_error)
{
    return experiment_scene(FAMILY("'realizations':400,"
                                   "'target':{'observable':'msd','relative_error':%s}"),
                            relative_error);
}

/* A number in the job's outcome, by a path of SQLite. */
static int64_t outcome(struct store *store, const char *id, const char *path)
{
    char sql[200];

    snprintf(sql, sizeof sql, "SELECT outcome ->> '%s' FROM jobs WHERE id = '%s'", path, id);
    return bench_number(store, sql);
}

static void run_job(struct bench *bench, size_t workers, struct bcd_scene *scene,
                    char id[JOB_ID_SIZE])
{
    struct plant plant = plant_start(bench, workers);

    job_bench_submit(bench->store, plant.queue, scene, id);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
}

static void assert_reused(struct bench *bench, int realizations, int reused)
{
    char id[JOB_ID_SIZE];

    run_job(bench, 2, of(realizations), id);
    assert_int_equal(outcome(bench->store, id, "$.realizations"), realizations);
    assert_int_equal(outcome(bench->store, id, "$.reused_realizations"), reused);
    plant_assert_same_bytes(bench->store, id, of(realizations));
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM bases"), 0);
}

static void more_or_fewer_realizations_begin_where_others_were(void **state)
{
    struct bench *bench = *state;
    struct bcd_scene *scene = of(100);

    assert_int_equal(bcd_scene_realizations(scene, 1), 8);
    bcd_scene_free(scene);
    assert_reused(bench, 1, 0);   /* blocks of a single one begin nothing */
    assert_reused(bench, 5, 0);   /* nor does anything begin with them */
    assert_reused(bench, 11, 5);  /* in the middle of the first chunk */
    assert_reused(bench, 45, 11); /* in the middle of the second */
    assert_reused(bench, 46, 45);
    assert_reused(bench, 40, 32); /* fewer: from a milestone */
    assert_reused(bench, 39, 32);
    assert_reused(bench, 56, 46);
}

static void corrupt(struct store *store, const char *column)
{
    char sql[200];
    sqlite3 *db;

    snprintf(sql, sizeof sql,
             "UPDATE samples SET %s = CAST(substr(%s, 1, 100) || x'5a' || substr(%s, 102) AS BLOB)",
             column, column, column);
    assert_int_equal(STORE_BEGIN(store, &db), STORE_OK);
    assert_int_equal(store_end(store, store_exec(db, sql)), STORE_OK);
}

/* A whole chunk is the end of a job of one chunk, to be gone on with, and a milestone of longer
 * ones: both are the same sample. */
static void a_single_chunk_and_a_milestone_are_one_sample(void **state)
{
    struct bench *bench = *state;
    struct plant plant;
    char shorter[JOB_ID_SIZE], longer[JOB_ID_SIZE];

    assert_reused(bench, 8, 0);
    assert_reused(bench, 11, 8); /* puts its milestone in that place */
    assert_reused(bench, 19, 11);
    bench_tear_down(state);
    bench_set_up(state);
    bench = *state;
    plant = plant_start(bench, 2);
    job_bench_submit(bench->store, plant.queue, of(8), shorter);
    job_bench_submit(bench->store, plant.queue, of(16), longer);
    assert_int_equal(job_bench_wait(bench->store, shorter), JOB_DONE);
    assert_int_equal(job_bench_wait(bench->store, longer), JOB_DONE);
    plant_stop(&plant);
    assert_reused(bench, 12, 8);
}

static void damaged_samples_are_run_anew(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE];

    run_job(bench, 2, of(21), id);
    corrupt(bench->store, "whole");
    assert_reused(bench, 30, 0);
    corrupt(bench->store, "rest"); /* of 30: milestones have none */
    assert_reused(bench, 33, 24);
}

/* Damaged after they were taken over: what they held is run before the job ends. */
static void a_base_that_goes_bad_is_run_anew(void **state)
{
    struct bench *bench = *state;
    struct plant plant;
    char id[JOB_ID_SIZE];

    run_job(bench, 2, of(43), id);
    for (int trial = 0; trial < 2; trial++) {
        int realizations = 160 + trial;

        plant = plant_start(bench, 2);
        job_bench_submit(bench->store, plant.queue, of(realizations), id);
        plant_wait_start(&plant, id);
        plant_stop(&plant);
        assert_int_equal(bench_state(bench->store, id), JOB_RUNNING);
        assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM bases"), 1);
        if (trial == 0)
            corrupt(bench->store, "whole");
        else
            assert_int_equal(
                store_samples_drop(bench->store,
                                   bench_number(bench->store, "SELECT sample FROM bases")),
                STORE_OK);
        plant = plant_start(bench, 2);
        assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
        plant_stop(&plant);
        plant_assert_same_bytes(bench->store, id, of(realizations));
    }
}

static void a_tally_too_large_is_not_kept(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE];

    run_job(bench, 2,
            experiment_scene("{'particles':2,'length':9000,'time':1e-3,'time_step':1e-3,"
                             "'method':'bcd','realizations':4,'observables':{'density':{'bins':"
                             "%d}}}",
                             LIMIT_SAMPLE_BYTES_MAX / 24 + 1),
            id);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM samples"), 0);
    assert_int_equal(outcome(bench->store, id, "$.realizations"), 4);
}

/* ----------------------------------------------------------------------- target */

/* Ends with the same bytes, and after as many realizations, as in one thread left alone. */
static void assert_hits(struct bench *bench, const char *id, const char *relative_error,
                        int realizations)
{
    assert_int_equal(outcome(bench->store, id, "$.realizations"), realizations);
    assert_true(bench_number(bench->store, "SELECT count(*) FROM chunks") == 0);
    plant_assert_same_bytes(bench->store, id, of(realizations));
    (void)relative_error;
}

static void a_target_ends_where_it_ends(void **state)
{
    static const size_t workers[] = {1, 4};
    struct bench *bench = *state;
    int64_t realizations = 0;

    for (size_t i = 0; i < sizeof workers / sizeof workers[0]; i++) {
        char id[JOB_ID_SIZE];

        run_job(bench, workers[i], aiming("0.03"), id);
        if (i == 0)
            realizations = outcome(bench->store, id, "$.realizations");
        assert_in_range(realizations, 16, 300);
        assert_int_equal(outcome(bench->store, id, "$.target.reached"), 1);
        assert_hits(bench, id, "0.03", (int)realizations);
        bench_tear_down(state);
        bench_set_up(state);
        bench = *state;
    }
}

/* Stopped again and again; what it had taken over and found stays. */
static void an_interrupted_target_ends_there_too(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE], first[JOB_ID_SIZE];
    struct plant plant;
    double progress = 0;

    run_job(bench, 2, aiming("0.025"), first);
    int64_t realizations = outcome(bench->store, first, "$.realizations");
    bench_tear_down(state);
    bench_set_up(state);
    bench = *state;
    run_job(bench, 2, of(27), first);
    job_bench_submit(bench->store, NULL, aiming("0.025"), id);
    for (int i = 0; i < 12; i++) {
        plant = plant_start(bench, 1 + (size_t)i % 3);
        for (int naps = 0; naps < 40; naps++) {
            double now = queue_progress(plant.queue, id);

            if (now >= 0 && i == 0) {
                assert_true(now >= progress && now <= 1);
                progress = now;
            }
            job_bench_nap(1);
        }
        plant_stop(&plant);
    }
    plant = plant_start(bench, 2);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    assert_int_equal(outcome(bench->store, id, "$.realizations"), realizations);
    assert_int_equal(outcome(bench->store, id, "$.reused_realizations"), 27);
    assert_hits(bench, id, "0.025", (int)realizations);
}

/* A target continues what another one left, and where that was enough runs nothing. */
static void targets_build_on_one_another(void **state)
{
    struct bench *bench = *state;
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE], c[JOB_ID_SIZE];

    run_job(bench, 2, aiming("0.03"), a);
    run_job(bench, 2, aiming("0.0301"), b);
    int64_t found = outcome(bench->store, a, "$.realizations");
    assert_int_equal(outcome(bench->store, b, "$.realizations"), found);
    assert_int_equal(outcome(bench->store, b, "$.reused_realizations"), found);
    assert_hits(bench, b, "0.0301", (int)found);
    run_job(bench, 2, aiming("0.025"), c);
    assert_true(outcome(bench->store, c, "$.realizations") > found);
    assert_int_equal(outcome(bench->store, c, "$.reused_realizations"), found);
    assert_hits(bench, c, "0.025", (int)outcome(bench->store, c, "$.realizations"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(the_largest_that_fits_is_found),
        BENCH_TEST(a_sample_kept_again_is_as_it_was_kept_last),
        BENCH_TEST(a_base_lasts_as_long_as_the_job_runs),
        BENCH_TEST(a_job_run_by_force_takes_nothing_over),
        BENCH_TEST(more_or_fewer_realizations_begin_where_others_were),
        BENCH_TEST(a_single_chunk_and_a_milestone_are_one_sample),
        BENCH_TEST(damaged_samples_are_run_anew),
        BENCH_TEST(a_base_that_goes_bad_is_run_anew),
        BENCH_TEST(a_tally_too_large_is_not_kept),
        BENCH_TEST(a_target_ends_where_it_ends),
        BENCH_TEST(an_interrupted_target_ends_there_too),
        BENCH_TEST(targets_build_on_one_another),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
