/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "store_bench.h"

#include "store_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

void bench_reopen(struct bench *bench)
{
    char reason[512] = "";

    store_close(bench->store);
    bench->store = NULL;
    if (store_open(&bench->store, bench->dir, reason, sizeof reason) != STORE_OK)
        fail_msg("store_open: %s", reason);
}

int bench_set_up(void **state)
{
    struct bench *bench = calloc(1, sizeof *bench);

    temp_dir_make(bench->dir);
    bench_reopen(bench);
    *state = bench;
    return 0;
}

int bench_tear_down(void **state)
{
    struct bench *bench = *state;

    store_close(bench->store);
    temp_dir_remove(bench->dir);
    free(bench);
    return 0;
}

struct job_new bench_job(int tag, const char *text)
{
    struct job_new job = {.job = text, .derived = "{\"steps\":10}", .chunks = 3};

    memset(job.hash, tag, sizeof job.hash);
    return job;
}

void bench_insert(struct store *store, int tag, const char *text, char id[JOB_ID_SIZE])
{
    struct job_new job = bench_job(tag, text);
    struct job_record record;
    bool existed;

    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
    assert_false(existed);
    snprintf(id, JOB_ID_SIZE, "%s", record.id);
    job_record_fini(&record);
}

enum job_state bench_state(struct store *store, const char *id)
{
    struct job_record record;
    enum job_state found;

    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    found = record.state;
    job_record_fini(&record);
    return found;
}

void bench_assert_counts(struct store *store, const int64_t expected[JOB_STATES])
{
    int64_t counts[JOB_STATES];

    assert_int_equal(store_jobs_counts(store, counts), STORE_OK);
    for (int i = 0; i < JOB_STATES; i++)
        assert_int_equal(counts[i], expected[i]);
}

int64_t bench_number(struct store *store, const char *sql)
{
    struct stmt row = stmt_init(store->writer, sql);
    int64_t number;

    assert_true(stmt_step(&row));
    number = stmt_integer(&row, 0);
    assert_int_equal(stmt_fini(&row), STORE_OK);
    return number;
}

int64_t bench_chunks_done(struct store *store, const char *id)
{
    struct job_record record;

    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    job_record_fini(&record);
    return record.chunks_done;
}

void bench_assert_blob(const struct blob *blob, const char *text)
{
    assert_int_equal(blob->size, strlen(text));
    assert_memory_equal(blob->bytes, text, blob->size);
}
