/* SPDX-License-Identifier: GPL-3.0-or-later
 * feed.c and store_watch.c: who listens hears of every change of a job's state, once it is on disk.
 */
#include "feed.h"
#include "limits.h"
#include "queue.h"
#include "store_internal.h"
#include "store_jobs.h"
#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct fixture {
    char dir[TEMP_DIR_SIZE];
    struct store *store;
    struct queue *queue;
    struct feed *feed;
    int woken, made;
};

static void wake(void *context)
{
    ((struct fixture *)context)->woken++;
}

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    char reason[256];
    temp_dir_make(f->dir);
    assert_int_equal(store_open(&f->store, f->dir, reason, sizeof(reason)), STORE_OK);
    assert_int_equal(queue_create(&f->queue, f->store), STORE_OK);
    assert_int_equal(feed_create(&f->feed, f->store, f->queue), STORE_OK);
    feed_wake(f->feed, wake, f);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    feed_free(f->feed);
    queue_free(f->queue);
    store_close(f->store);
    temp_dir_remove(f->dir);
    free(f);
    return 0;
}

static int64_t insert(struct fixture *f, char id[JOB_ID_SIZE])
{
    struct job_new job = {.job = "{}", .derived = "{}", .chunks = 1};
    struct job_record record;
    bool existed;
    snprintf((char *)job.hash, sizeof(job.hash), "%d", ++f->made);
    assert_int_equal(store_jobs_insert(f->store, &job, &record, &existed), STORE_OK);
    int64_t seq = record.seq;
    memcpy(id, record.id, JOB_ID_SIZE);
    job_record_fini(&record);
    return seq;
}

static void a_life_is_told(void **state)
{
    struct fixture *f = *state;
    struct job_move moves[8];
    char id[JOB_ID_SIZE];
    uint64_t since = feed_now(f->feed);
    bool lost;
    int64_t seq = insert(f, id);
    assert_int_equal(store_jobs_start(f->store, id), STORE_OK);
    assert_int_equal(store_jobs_cancel(f->store, id), STORE_OK);
    assert_int_equal(store_jobs_cancel(f->store, id), STORE_CONFLICT); /* no change, no news */
    assert_int_equal(f->woken, 3);
    assert_int_equal(feed_read(f->feed, &since, moves, 8, &lost), 3);
    assert_false(lost);
    static const enum job_state states[] = {JOB_QUEUED, JOB_RUNNING, JOB_CANCELLED};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(moves[i].seq, seq);
        assert_string_equal(moves[i].id, id);
        assert_string_equal(moves[i].owner, OWNER_LOCAL);
        assert_int_equal(moves[i].state, states[i]);
    }
    assert_int_equal(feed_read(f->feed, &since, moves, 8, &lost), 0);
    assert_int_equal(since, feed_now(f->feed));
}

static void only_what_is_on_disk_is_told(void **state)
{
    struct fixture *f = *state;
    sqlite3 *db;
    char id[JOB_ID_SIZE];
    insert(f, id);
    uint64_t before = feed_now(f->feed);
    assert_int_equal(STORE_BEGIN(f->store, &db), STORE_OK);
    assert_int_equal(store_jobs_move(db, id, JOB_RUNNING, NULL), STORE_OK);
    store_end(f->store, STORE_CONFLICT); /* rolled back */
    assert_int_equal(feed_now(f->feed), before);
    assert_int_equal(f->woken, 1);
    assert_int_equal(store_jobs_start(f->store, id), STORE_OK);
    assert_int_equal(feed_now(f->feed), before + 1);
}

static void one_job_among_others(void **state)
{
    struct fixture *f = *state;
    char first[JOB_ID_SIZE], second[JOB_ID_SIZE];
    int64_t seq = insert(f, first);
    insert(f, second);
    uint64_t since = feed_now(f->feed), kept = since;
    assert_false(feed_moved(f->feed, &since, seq));
    assert_int_equal(store_jobs_start(f->store, second), STORE_OK);
    assert_false(feed_moved(f->feed, &since, seq));
    assert_int_equal(since, kept + 1);
    assert_int_equal(store_jobs_start(f->store, first), STORE_OK);
    assert_true(feed_moved(f->feed, &since, seq));
    assert_int_equal(since, kept + 1);
    assert_true(feed_moved(f->feed, &kept, seq));
}

/* One statement that moves many jobs: as many as fit, then that there are more. */
static void many_at_once(void **state)
{
    struct fixture *f = *state;
    static struct job_move moves[2 * LIMIT_FEED_CHANGES];
    char id[JOB_ID_SIZE];
    sqlite3 *db;
    bool lost;
    int64_t last = 0;
    for (int i = 0; i < 10; i++)
        last = insert(f, id);
    uint64_t since = feed_now(f->feed), whole = since;
    assert_int_equal(STORE_BEGIN(f->store, &db), STORE_OK);
    assert_int_equal(
        store_exec(db, "UPDATE jobs SET state = 'cancelled', finished_ms = 1 WHERE seq > 2"),
        STORE_OK);
    assert_int_equal(store_end(f->store, STORE_OK), STORE_OK);
    assert_int_equal(feed_read(f->feed, &since, moves, 100, &lost), 8);
    assert_false(lost);
    assert_int_equal(moves[7].state, JOB_CANCELLED);

    assert_int_equal(STORE_BEGIN(f->store, &db), STORE_OK);
    assert_int_equal(
        store_exec(db, "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 2000)"
                       " INSERT INTO jobs (id, hash, submitted_ms, chunks, job, derived)"
                       " SELECT 'x' || i, randomblob(32), 1, 1, '{}', '{}' FROM n"),
        STORE_OK);
    assert_int_equal(store_end(f->store, STORE_OK), STORE_OK);
    assert_true(feed_moved(f->feed, &since, last)); /* may have */
    assert_int_equal(feed_read(f->feed, &since, moves, 4096, &lost), 0);
    assert_true(lost);
    assert_int_equal(feed_read(f->feed, &since, moves, 4096, &lost), 0);
    assert_false(lost);
    assert_int_equal(store_jobs_start(f->store, id), STORE_CONFLICT);
    whole = FEED_UNKNOWN;
    assert_int_equal(feed_read(f->feed, &whole, moves, 4096, &lost), 0);
    assert_true(lost);
    assert_int_equal(whole, feed_now(f->feed));
}

/* Who listens too slowly is told so, and goes on with what is left. */
static void ring_is_overrun(void **state)
{
    struct fixture *f = *state;
    static struct job_move moves[2 * LIMIT_FEED_CHANGES];
    sqlite3 *db;
    bool lost;
    uint64_t since = feed_now(f->feed);
    for (int i = 0; i * 200 < LIMIT_FEED_CHANGES + 200; i++) {
        char sql[400];
        snprintf(sql, sizeof(sql),
                 "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 200)"
                 " INSERT INTO jobs (id, hash, submitted_ms, chunks, job, derived)"
                 " SELECT 'x%d-' || i, randomblob(32), 1, 1, '{}', '{}' FROM n",
                 i);
        assert_int_equal(STORE_BEGIN(f->store, &db), STORE_OK);
        assert_int_equal(store_exec(db, sql), STORE_OK);
        assert_int_equal(store_end(f->store, STORE_OK), STORE_OK);
    }
    size_t count = feed_read(f->feed, &since, moves, 2 * LIMIT_FEED_CHANGES, &lost);
    assert_true(lost);
    assert_int_equal(count, LIMIT_FEED_CHANGES);
    assert_int_equal(since, feed_now(f->feed));
    for (size_t i = 1; i < count; i++)
        assert_int_equal(moves[i].seq, moves[0].seq + (int64_t)i);
}

/* A job's moves name the sweeps that it belongs to by then. */
static void moves_of_sweeps(void **state)
{
    struct fixture *f = *state;
    struct job_move moves[8], now;
    int64_t counts[JOB_STATES], seq = 0;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE], sql[600];
    sqlite3 *db;
    bool lost;
    uint64_t since = feed_now(f->feed);
    int64_t job = insert(f, id);
    insert(f, other);
    assert_int_equal(STORE_BEGIN(f->store, &db), STORE_OK);
    snprintf(sql, sizeof(sql),
             "INSERT INTO sweeps (seq, id, hash, owner, priority, submitted_ms, base, axes, zip)"
             " VALUES (3, 'sa', zeroblob(32), 'local', 0, 1, '{}', '{}', '[]'),"
             " (17, 'sb', randomblob(32), 'local', 0, 1, '{}', '{}', '[]');"
             "INSERT INTO sweep_points (sweep, point, job, place)"
             " VALUES (3, 0, %lld, '[0]'), (3, 1, %lld, '[1]'), (17, 0, %lld, '[0]');"
             "UPDATE sweep_counts SET points = 5 WHERE state = 'queued'",
             (long long)job, (long long)job, (long long)job);
    assert_int_equal(store_exec(db, sql), STORE_OK);
    assert_int_equal(store_end(f->store, STORE_OK), STORE_OK);
    assert_int_equal(store_jobs_start(f->store, id), STORE_OK);
    assert_int_equal(store_jobs_start(f->store, other), STORE_OK);
    assert_int_equal(feed_read(f->feed, &since, moves, 8, &lost), 4);
    assert_false(job_move_in_sweep(&moves[0], 3)); /* not yet */
    assert_true(job_move_in_sweep(&moves[2], 3));
    assert_true(job_move_in_sweep(&moves[2], 17));
    assert_false(job_move_in_sweep(&moves[2], 4));
    assert_false(job_move_in_sweep(&moves[3], 3));
    assert_int_equal(store_watch_job(f->store, id, &now), STORE_OK);
    assert_memory_equal(&now, &moves[2], sizeof(now));
    assert_int_equal(store_watch_job(f->store, "jnone", &now), STORE_NOT_FOUND);
    assert_int_equal(store_watch_sweep(f->store, "sb", &seq), STORE_OK);
    assert_int_equal(seq, 17);
    assert_int_equal(store_watch_sweep(f->store, "sc", &seq), STORE_NOT_FOUND);
    assert_int_equal(store_watch_counts(f->store, 17, counts), STORE_OK);
    assert_int_equal(counts[JOB_QUEUED], 4);
    assert_int_equal(counts[JOB_RUNNING], 1);
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_life_is_told),       TEST(only_what_is_on_disk_is_told),
        TEST(one_job_among_others), TEST(many_at_once),
        TEST(ring_is_overrun),      TEST(moves_of_sweeps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
