/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store_jobs.c - store_jobs.h against what it promises. */
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

/* ------------------------------------------------------------------ submission */

static void a_new_job_is_recorded(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct job_new job = bench_job(7, "{\"particles\":5}");
    struct job_record record, read;
    bool existed = true;

    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
    assert_false(existed);
    assert_int_equal(record.state, JOB_QUEUED);
    assert_true(record.submitted_ms > 1600000000000);
    assert_int_equal(record.started_ms, 0);
    assert_int_equal(record.finished_ms, 0);
    assert_int_equal(record.chunks, 3);
    assert_int_equal(record.chunks_done, 0);
    assert_string_equal(record.job, job.job);
    assert_string_equal(record.derived, job.derived);
    assert_null(record.error);
    assert_memory_equal(record.hash, job.hash, JOB_HASH_SIZE);
    assert_true(strlen(record.id) >= 12 && record.id[0] == 'j');
    assert_int_equal(strspn(record.id, "abcdefghijklmnopqrstuvwxyz0123456789-"), strlen(record.id));

    assert_int_equal(store_jobs_get(store, record.id, &read), STORE_OK);
    assert_int_equal(read.seq, record.seq);
    assert_string_equal(read.job, job.job);
    job_record_fini(&read);
    job_record_fini(&record);
    assert_int_equal(store_jobs_get(store, "jnone", &read), STORE_NOT_FOUND);
}

static void the_same_job_stands_once(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct job_new job = bench_job(1, "{\"particles\":5}");
    struct job_record again;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE];
    bool existed = false;

    bench_insert(store, 1, job.job, id);
    bench_insert(store, 2, job.job, other);
    assert_string_not_equal(id, other);
    assert_int_equal(store_jobs_insert(store, &job, &again, &existed), STORE_OK);
    assert_true(existed);
    assert_string_equal(again.id, id);
    job_record_fini(&again);
    bench_assert_counts(store, (int64_t[]){2, 0, 0, 0, 0});
}

static void a_cancelled_or_failed_job_can_be_tried_again(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char first[JOB_ID_SIZE], second[JOB_ID_SIZE], third[JOB_ID_SIZE];

    bench_insert(store, 1, "{}", first);
    assert_int_equal(store_jobs_cancel(store, first), STORE_OK);
    bench_insert(store, 1, "{}", second);
    assert_int_equal(store_jobs_fail(store, second, "no reason"), STORE_OK);
    bench_insert(store, 1, "{}", third);
    bench_assert_counts(store, (int64_t[]){1, 0, 0, 1, 1});
}

static void an_idempotency_key_answers_with_its_job(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct job_new job = bench_job(1, "{}"), other = bench_job(2, "{}");
    struct job_record first, again;
    bool existed;

    job.idempotency_key = other.idempotency_key = "key";
    assert_int_equal(store_jobs_insert(store, &job, &first, &existed), STORE_OK);
    assert_false(existed);
    assert_int_equal(store_jobs_insert(store, &job, &again, &existed), STORE_OK);
    assert_true(existed);
    assert_string_equal(again.id, first.id);
    job_record_fini(&again);
    assert_int_equal(store_jobs_insert(store, &other, &again, &existed), STORE_CONFLICT);
    /* Whatever became of the job. */
    assert_int_equal(store_jobs_cancel(store, first.id), STORE_OK);
    assert_int_equal(store_jobs_insert(store, &job, &again, &existed), STORE_OK);
    assert_true(existed);
    assert_int_equal(again.state, JOB_CANCELLED);
    assert_string_equal(again.id, first.id);
    job_record_fini(&again);
    /* A key given with a job that stood already is remembered, too. */
    job.idempotency_key = NULL;
    assert_int_equal(store_jobs_insert(store, &job, &again, &existed), STORE_OK);
    assert_false(existed);
    job_record_fini(&again);
    job.idempotency_key = other.idempotency_key = "second";
    assert_int_equal(store_jobs_insert(store, &job, &again, &existed), STORE_OK);
    assert_true(existed);
    job_record_fini(&again);
    assert_int_equal(store_jobs_insert(store, &other, &again, &existed), STORE_CONFLICT);
    bench_assert_counts(store, (int64_t[]){1, 0, 0, 0, 1});
    /* Somebody else's key of the same name is another key. */
    other.ticket = &(const struct ticket){.owner = "anna"};
    assert_int_equal(store_jobs_insert(store, &other, &again, &existed), STORE_OK);
    assert_false(existed);
    job_record_fini(&again);
    bench_assert_counts(store, (int64_t[]){2, 0, 0, 0, 1});
    job_record_fini(&first);
}

static void nothing_that_is_no_json_gets_in(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct job_new job = bench_job(1, "{\"particles\":");
    struct job_record record;
    bool existed;

    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_BROKEN);
    bench_assert_counts(store, (int64_t[]){0, 0, 0, 0, 0});
}

/* ------------------------------------------------------------------ transitions */

static void states_move_as_the_header_says(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE];
    struct job_record record;

    bench_insert(store, 1, "{}", a);
    bench_insert(store, 2, "{}", b);
    assert_int_equal(store_jobs_start(store, a), STORE_OK);
    bench_assert_counts(store, (int64_t[]){1, 1, 0, 0, 0});
    assert_int_equal(store_jobs_start(store, a), STORE_CONFLICT);
    assert_int_equal(store_results_finish(store, b, NULL, 0), STORE_CONFLICT);
    assert_int_equal(store_results_finish(store, a, NULL, 0), STORE_OK);
    assert_int_equal(store_jobs_get(store, a, &record), STORE_OK);
    assert_int_equal(record.state, JOB_DONE);
    assert_true(record.submitted_ms <= record.started_ms);
    assert_true(record.started_ms > 0 && record.started_ms <= record.finished_ms);
    job_record_fini(&record);
    assert_int_equal(store_jobs_start(store, a), STORE_CONFLICT);
    assert_int_equal(store_jobs_fail(store, a, "late"), STORE_CONFLICT);
    assert_int_equal(store_jobs_cancel(store, a), STORE_CONFLICT);
    assert_int_equal(store_results_finish(store, a, NULL, 0), STORE_CONFLICT);

    assert_int_equal(store_jobs_fail(store, b, "out of \"luck\""), STORE_OK);
    assert_int_equal(store_jobs_get(store, b, &record), STORE_OK);
    assert_int_equal(record.state, JOB_FAILED);
    assert_string_equal(record.error, "out of \"luck\"");
    job_record_fini(&record);
    assert_int_equal(store_jobs_cancel(store, b), STORE_CONFLICT);
    assert_int_equal(store_jobs_start(store, b), STORE_CONFLICT);
    bench_assert_counts(store, (int64_t[]){0, 0, 1, 1, 0});

    assert_int_equal(store_jobs_start(store, "jnone"), STORE_NOT_FOUND);
    assert_int_equal(store_jobs_fail(store, "jnone", "x"), STORE_NOT_FOUND);
    assert_int_equal(store_jobs_cancel(store, "jnone"), STORE_NOT_FOUND);
    assert_int_equal(store_results_finish(store, "jnone", NULL, 0), STORE_NOT_FOUND);
}

/* Whoever writes SQL by hand is held to the table of transitions, too. */
static void the_schema_itself_guards_the_states(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_exec(store->writer, "UPDATE jobs SET state = 'done', started_ms = 1,"
                                               " finished_ms = 1"),
                     STORE_BROKEN);
    assert_int_equal(store_exec(store->writer, "UPDATE jobs SET state = 'lost'"), STORE_BROKEN);
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    assert_int_equal(
        store_exec(store->writer, "UPDATE jobs SET state = 'queued', finished_ms = NULL"),
        STORE_BROKEN);
    assert_int_equal(bench_state(store, id), JOB_CANCELLED);
}

static void state_names_are_the_contract(void **state)
{
    static const char *const names[] = {"queued", "running", "done", "failed", "cancelled"};
    enum job_state parsed;

    (void)state;
    for (int i = 0; i < JOB_STATES; i++) {
        assert_string_equal(job_state_name((enum job_state)i), names[i]);
        assert_true(job_state_parse(names[i], &parsed));
        assert_int_equal(parsed, i);
    }
    assert_false(job_state_parse("", &parsed));
    assert_false(job_state_parse("Done", &parsed));
}

/* ------------------------------------------------------------------------ lists */

static void running_jobs_come_in_order_of_submission(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[4][JOB_ID_SIZE];
    struct job_record *records;
    struct job_waiting waiting[2];
    size_t count;

    for (int i = 0; i < 4; i++)
        bench_insert(store, i, "{}", id[i]);
    assert_int_equal(store_jobs_start(store, id[2]), STORE_OK);
    assert_int_equal(store_jobs_start(store, id[0]), STORE_OK);
    assert_int_equal(store_jobs_running(store, &records, &count), STORE_OK);
    assert_int_equal(count, 2);
    assert_string_equal(records[0].id, id[0]);
    assert_string_equal(records[1].id, id[2]);
    assert_int_equal(records[1].state, JOB_RUNNING);
    job_records_free(records, count);
    assert_int_equal(store_jobs_waiting(store, OWNER_LOCAL, waiting, 2, &count), STORE_OK);
    assert_int_equal(count, 2);
    assert_string_equal(waiting[0].id, id[1]);
    assert_string_equal(waiting[1].id, id[3]);
    assert_int_equal(store_jobs_cancel(store, id[1]), STORE_OK);
    assert_int_equal(store_jobs_waiting(store, OWNER_LOCAL, waiting, 1, &count), STORE_OK);
    assert_int_equal(count, 1);
    assert_string_equal(waiting[0].id, id[3]);
    assert_int_equal(store_jobs_waiting(store, "nobody", waiting, 2, &count), STORE_OK);
    assert_int_equal(count, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(a_new_job_is_recorded),
        BENCH_TEST(the_same_job_stands_once),
        BENCH_TEST(a_cancelled_or_failed_job_can_be_tried_again),
        BENCH_TEST(an_idempotency_key_answers_with_its_job),
        BENCH_TEST(nothing_that_is_no_json_gets_in),
        BENCH_TEST(states_move_as_the_header_says),
        BENCH_TEST(the_schema_itself_guards_the_states),
        cmocka_unit_test(state_names_are_the_contract),
        BENCH_TEST(running_jobs_come_in_order_of_submission),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
