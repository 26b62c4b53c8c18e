/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store_results.c - store_results.h against what it promises. */
#include "store_bench.h"

#include "limits.h"
#include "store_internal.h"
#include "store_results.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---------------------------------------------------------------------- results */

static void checkpoints_replace_each_other(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];
    struct blob blob;

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_results_checkpoint(store, id, 0, "one", 3), STORE_CONFLICT);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_results_load_checkpoint(store, id, 0, &blob), STORE_NOT_FOUND);
    assert_int_equal(store_results_checkpoint(store, id, 0, "one", 3), STORE_OK);
    assert_int_equal(store_results_checkpoint(store, id, 1, "other", 5), STORE_OK);
    assert_int_equal(store_results_checkpoint(store, id, 0, "second", 6), STORE_OK);
    assert_int_equal(store_results_load_checkpoint(store, id, 0, &blob), STORE_OK);
    bench_assert_blob(&blob, "second");
    blob_fini(&blob);
    assert_int_equal(store_results_checkpoint(store, id, 3, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_results_checkpoint(store, "jnone", 0, "x", 1), STORE_NOT_FOUND);
}

static void a_chunk_is_put_once(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];
    bool flags[3];
    struct blob blob;

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_results_put_chunk(store, id, 0, "early", 5), STORE_CONFLICT);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_results_checkpoint(store, id, 2, "half", 4), STORE_OK);
    assert_int_equal(store_results_put_chunk(store, id, 2, "tally", 5), STORE_OK);
    assert_int_equal(store_results_load_checkpoint(store, id, 2, &blob), STORE_NOT_FOUND);
    assert_int_equal(store_results_put_chunk(store, id, 2, "again", 5), STORE_OK);
    assert_int_equal(bench_chunks_done(store, id), 1);
    assert_int_equal(store_results_load_chunk(store, id, 2, &blob), STORE_OK);
    bench_assert_blob(&blob, "tally");
    blob_fini(&blob);
    assert_int_equal(store_results_load_chunk(store, id, 0, &blob), STORE_NOT_FOUND);
    assert_int_equal(store_results_chunks(store, id, flags, 3), STORE_OK);
    assert_true(!flags[0] && !flags[1] && flags[2]);
    assert_int_equal(store_results_put_chunk(store, id, 3, "beyond", 6), STORE_CONFLICT);
    assert_int_equal(store_results_put_chunk(store, "jnone", 0, "x", 1), STORE_NOT_FOUND);
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    assert_int_equal(store_results_put_chunk(store, id, 0, "late", 4), STORE_CONFLICT);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM chunks"), 0);
}

static void finishing_writes_all_and_cleans_up(void **state)
{
    static const struct result_new results[] = {{"msd", "table", 5}, {"density", "", 0}};
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE], **names;
    struct blob blob;
    size_t count;

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_results_put_chunk(store, id, 0, "tally", 5), STORE_OK);
    assert_int_equal(store_results_checkpoint(store, id, 1, "half", 4), STORE_OK);
    assert_int_equal(store_results_get(store, id, "msd", &blob), STORE_NOT_FOUND);
    assert_int_equal(store_results_finish(store, id, results, 2), STORE_OK);
    assert_int_equal(bench_state(store, id), JOB_DONE);
    assert_int_equal(store_results_get(store, id, "msd", &blob), STORE_OK);
    bench_assert_blob(&blob, "table");
    blob_fini(&blob);
    assert_int_equal(store_results_get(store, id, "density", &blob), STORE_OK);
    bench_assert_blob(&blob, "");
    blob_fini(&blob);
    assert_int_equal(store_results_get(store, id, "energy", &blob), STORE_NOT_FOUND);
    assert_int_equal(store_results_names(store, id, &names, &count), STORE_OK);
    assert_int_equal(count, 2);
    assert_string_equal(names[0], "msd");
    assert_string_equal(names[1], "density");
    free(names[0]);
    free(names[1]);
    free(names);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM chunks"), 0);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM checkpoints"), 0);
}

/* The second table cannot be written: then neither is the first, and the job still runs. */
static void finishing_is_all_or_nothing(void **state)
{
    static const struct result_new twice[] = {{"msd", "a", 1}, {"msd", "b", 1}};
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];
    struct blob blob;

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_results_put_chunk(store, id, 0, "tally", 5), STORE_OK);
    assert_int_equal(store_results_finish(store, id, twice, 2), STORE_BROKEN);
    assert_int_equal(bench_state(store, id), JOB_RUNNING);
    assert_int_equal(store_results_get(store, id, "msd", &blob), STORE_NOT_FOUND);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM chunks"), 1);
    bench_assert_counts(store, (int64_t[]){0, 1, 0, 0, 0});
}

static void a_cancelled_job_cannot_be_finished(void **state)
{
    static const struct result_new results[] = {{"msd", "table", 5}};
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];
    struct blob blob;

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    assert_int_equal(store_results_finish(store, id, results, 1), STORE_CONFLICT);
    assert_int_equal(bench_state(store, id), JOB_CANCELLED);
    assert_int_equal(store_results_get(store, id, "msd", &blob), STORE_NOT_FOUND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(checkpoints_replace_each_other),     BENCH_TEST(a_chunk_is_put_once),
        BENCH_TEST(finishing_writes_all_and_cleans_up), BENCH_TEST(finishing_is_all_or_nothing),
        BENCH_TEST(a_cancelled_job_cannot_be_finished),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
