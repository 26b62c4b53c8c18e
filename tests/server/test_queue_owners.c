/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_queue_owners.c - whose turn it is: fair share, priorities, newcomers, many queued jobs. */
#include "job_bench.h"

#include "limits.h"
#include "scene_json.h"
#include "store_internal.h"
#include "store_owners.h"
#include "store_results.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static struct queue *make_queue(struct store *store)
{
    struct queue *queue = NULL;

    assert_int_equal(queue_create(&queue, store), STORE_OK);
    return queue;
}

static void submit_chunks(struct store *store, struct queue *queue, const struct ticket *ticket,
                          int chunks, int seed)
{
    char id[JOB_ID_SIZE];

    job_bench_submit_as(store, queue, job_bench_scene(chunks, seed), ticket, id);
}

static void submit(struct store *store, struct queue *queue, const char *owner, int priority,
                   int seed)
{
    struct ticket ticket = {.priority = priority};

    snprintf(ticket.owner, sizeof ticket.owner, "%s", owner);
    submit_chunks(store, queue, &ticket, 2, seed);
}

static void submit_short(struct store *store, struct queue *queue, const char *owner, int seed)
{
    struct ticket ticket = {.priority = 0};

    snprintf(ticket.owner, sizeof ticket.owner, "%s", owner);
    submit_chunks(store, queue, &ticket, 1, seed);
}

static void claim(struct store *store, struct queue *queue, struct task *task, char *owner)
{
    struct job_record record;

    assert_true(queue_claim(queue, task));
    assert_int_equal(store_jobs_get(store, task->id, &record), STORE_OK);
    snprintf(owner, OWNER_SIZE, "%s", record.ticket.owner);
    job_record_fini(&record);
}

/* One chunk is worked on for so long; whose was it? */
static void work(struct store *store, struct queue *queue, double seconds, char *owner)
{
    struct task task;
    bool last = false;

    claim(store, queue, &task, owner);
    queue_spend(queue, &task, seconds);
    if (task.chunk != QUEUE_FINISH)
        queue_done(queue, &task, &last);
    if (last)
        assert_int_equal(store_results_finish(store, task.id, NULL, 0), STORE_OK);
    if (last || task.chunk == QUEUE_FINISH)
        queue_forget(queue, task.id);
}

static void assert_next_takes(struct store *store, struct queue *queue, const char *owner,
                              double seconds)
{
    char whose[OWNER_SIZE];

    work(store, queue, seconds, whose);
    assert_string_equal(whose, owner);
}

static void assert_next(struct store *store, struct queue *queue, const char *owner)
{
    assert_next_takes(store, queue, owner, 1);
}

static void end(struct queue *queue)
{
    queue_stop(queue);
    queue_free(queue);
}

/* Two with the same work get the same time, though the chunks of one are three times as long. */
static void owners_share_time(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    double used[2] = {0};

    for (int i = 0; i < 40; i++) {
        submit(store, queue, "anna", 0, 2 * i + 1);
        submit(store, queue, "bert", 0, 2 * i + 2);
    }
    for (int i = 0; i < 40; i++) {
        struct task task;
        char owner[OWNER_SIZE];
        bool last = false;

        claim(store, queue, &task, owner);
        queue_spend(queue, &task, owner[0] == 'a' ? 3 : 1);
        used[owner[0] != 'a'] += owner[0] == 'a' ? 3 : 1;
        queue_done(queue, &task, &last);
        if (last)
            queue_forget(queue, task.id);
    }
    assert_in_range((int)used[0], 28, 32);
    assert_in_range((int)used[1], 28, 32);
    end(queue);
}

/* What everybody used is kept across a restart: who used more waits. */
static void use_outlives_the_queue(void **state)
{
    struct bench *bench = *state;
    struct queue *queue = make_queue(bench->store);
    struct owner_record record;
    char owner[OWNER_SIZE];

    submit(bench->store, queue, "anna", 0, 1);
    work(bench->store, queue, 500, owner);
    queue_stop(queue);
    queue_free(queue);
    assert_int_equal(store_owners_get(bench->store, "anna", &record), STORE_OK);
    assert_float_equal(record.usage_seconds, 500, 0.1);
    assert_float_equal(record.day_seconds, 500, 0.1);
    bench_reopen(bench);
    submit(bench->store, NULL, "anna", 0, 2);
    submit(bench->store, NULL, "bert", 0, 3);
    submit(bench->store, NULL, "bert", 0, 4);
    queue = make_queue(bench->store);
    assert_int_equal(queue_recover(queue), STORE_OK);
    assert_next(bench->store, queue, "bert");
    /* As everybody is new after a start, she has one chunk out of turn. */
    assert_next(bench->store, queue, "anna");
    for (int i = 0; i < 3; i++)
        assert_next(bench->store, queue, "bert");
    assert_next(bench->store, queue, "anna");
    end(queue);
}

static void use_is_forgotten_by_half(void **state)
{
    (void)state;
    assert_float_equal(owner_decay(8, 0), 8, 0);
    assert_float_equal(owner_decay(8, -5), 8, 0); /* the clock was set back */
    assert_float_equal(owner_decay(8, 3 * (int64_t)LIMIT_USAGE_HALF_LIFE_MS), 1, 1e-12);
}

/* Somebody who used a lot yesterday comes with one job while a sweep of another goes on. */
static void a_newcomer_waits_for_one_chunk(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char owner[OWNER_SIZE];

    submit(store, queue, "bert", 0, 1);
    for (int i = 0; i < 2; i++)
        work(store, queue, 1e6, owner);
    for (int i = 0; i < 20; i++)
        submit(store, queue, "anna", 0, 10 + i);
    for (int round = 0; round < 5; round++) {
        assert_next(store, queue, "anna");
        submit(store, queue, "bert", 0, 100 + round);
        assert_next(store, queue, "bert");
        assert_next(store, queue, "anna");
        /* From his second chunk on it counts what he used; he is cancelled to be new again. */
        assert_int_equal(bench_number(store, "SELECT count(*) FROM jobs WHERE owner = 'bert'"
                                             " AND state = 'running'"),
                         1);
        struct job_record *records;
        size_t count;
        assert_int_equal(store_jobs_running(store, &records, &count), STORE_OK);
        for (size_t i = 0; i < count; i++) {
            if (strcmp(records[i].ticket.owner, "bert") != 0)
                continue;
            assert_int_equal(store_jobs_cancel(store, records[i].id), STORE_OK);
            queue_cancel(queue, records[i].id);
        }
        job_records_free(records, count);
    }
    end(queue);
}

/* Two who have used a lot come back all the time, one of them always new: they go out of turn, but
 * the sweep has every other chunk. */
static void newcomers_starve_nobody(void **state)
{
    static const char *const names[] = {"anna", "bert"};
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    bool there[2] = {false, false};
    char owner[OWNER_SIZE];
    int swept = 0, seed = 1000;

    for (int i = 0; i < 2; i++) {
        submit_short(store, queue, names[i], ++seed);
        work(store, queue, 1e6, owner);
    }
    for (int i = 0; i < 20; i++)
        submit_short(store, queue, "sweep", ++seed);
    for (int i = 0; i < 20; i++) {
        for (int k = 0; k < 2; k++) {
            if (!there[k])
                submit_short(store, queue, names[k], ++seed);
            there[k] = true;
        }
        work(store, queue, 1, owner);
        swept += strcmp(owner, "sweep") == 0;
        for (int k = 0; k < 2; k++)
            there[k] = there[k] && strcmp(owner, names[k]) != 0;
    }
    assert_in_range(swept, 9, 11);
    end(queue);
}

static void priority_goes_first_within_an_owner(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    struct task task[4];
    char low[JOB_ID_SIZE], high[JOB_ID_SIZE], same[JOB_ID_SIZE];
    struct ticket ticket = {.owner = "anna", .priority = -3};

    job_bench_submit_as(store, queue, job_bench_scene(3, 1), &ticket, low);
    assert_true(queue_claim(queue, &task[0]));
    assert_string_equal(task[0].id, low);
    /* The same priority waits for the job that runs; a higher one goes before its next chunk. */
    job_bench_submit_as(store, queue, job_bench_scene(1, 2), &ticket, same);
    assert_true(queue_claim(queue, &task[1]));
    assert_string_equal(task[1].id, low);
    ticket.priority = 100;
    job_bench_submit_as(store, queue, job_bench_scene(1, 3), &ticket, high);
    assert_true(queue_claim(queue, &task[2]));
    assert_string_equal(task[2].id, high);
    assert_true(queue_claim(queue, &task[3]));
    assert_string_equal(task[3].id, low);
    assert_int_equal(task[3].chunk, 2);
    assert_int_equal(bench_state(store, same), JOB_QUEUED);
    for (int i = 0; i < 4; i++)
        queue_release(queue, &task[i]);
    end(queue);
}

/* But nobody's priority takes anything from others. */
static void priority_does_not_reach_other_owners(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);

    submit(store, queue, "anna", 100, 1);
    submit(store, queue, "anna", 100, 2);
    assert_next(store, queue, "anna");
    submit(store, queue, "bert", -100, 3);
    assert_next_takes(store, queue, "bert", 1.5); /* not the same, for a start costs a little too */
    assert_next(store, queue, "anna");
    assert_next(store, queue, "bert");
    end(queue);
}

/* --------------------------------------------------------------------- many jobs */

enum { MANY = 100000 };

/* Of this process alone: what else the machine does is no matter. */
static double processor_s(void)
{
    struct timespec now;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Copies of one job, as a sweep of `MANY` points; that their hashes are wrong matters when they are
 * started, which fails them. */
static void submit_many(struct store *store)
{
    submit(store, NULL, "sweep", 0, 1);
    assert_int_equal(
        store_exec(store->writer,
                   "WITH RECURSIVE n (i) AS (SELECT 2 UNION ALL SELECT i + 1 FROM n"
                   " WHERE i < 100000)"
                   " INSERT INTO jobs (id, hash, submitted_ms, chunks, job, derived, owner)"
                   " SELECT 'jmany' || i, randomblob(32), 1, 1, job, derived, owner"
                   " FROM n, (SELECT * FROM jobs LIMIT 1)"),
        STORE_OK);
    assert_int_equal(bench_number(store, "SELECT queued FROM owners"), MANY);
}

static void a_sweep_delays_others_by_one_chunk(void **state)
{
    struct bench *bench = *state;
    struct queue *queue;
    struct task task;
    char owner[OWNER_SIZE];
    double started;

    submit_many(bench->store);
    bench_reopen(bench);
    queue = make_queue(bench->store);
    started = processor_s();
    assert_int_equal(queue_recover(queue), STORE_OK);
    claim(bench->store, queue, &task, owner);
    /* A tenth of a second would do; machines are slow at times. */
    if (processor_s() - started > 1)
        fail_msg("the start took %.2f s", processor_s() - started);
    assert_string_equal(owner, "sweep");
    submit(bench->store, queue, "bert", -100, 7);
    queue_spend(queue, &task, 1);
    queue_done(queue, &task, &(bool){false});
    started = processor_s();
    assert_next_takes(bench->store, queue, "bert", 1.5);
    assert_true(processor_s() - started < 1);
    assert_next(bench->store, queue, "sweep");
    end(queue);
}

/* What goes together is not let go at the end of a chunk: it gives way before, to who is next. */
static void teams_give_way(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    struct task team, one;
    char owner[OWNER_SIZE], id[JOB_ID_SIZE];
    struct ticket ticket = {.owner = "anna"};

    queue_set_workers(queue, 3);
    job_bench_submit_as(store, queue, job_bench_small_rings(12), &ticket, id);
    claim(store, queue, &team, owner);
    assert_int_equal(team.chunk, 0);
    assert_int_equal(team.count, 4); /* of 12 chunks, one of three workers */
    claim(store, queue, &one, owner);
    assert_int_equal(one.chunk, 4);
    assert_int_equal(one.count, 2);              /* a power of two of what is left, 8 */
    assert_false(queue_gives_way(queue, &team)); /* to none */
    queue_spend(queue, &team, 5);
    submit(store, queue, "bert", 0, 1);
    assert_true(queue_gives_way(queue, &team));
    queue_release(queue, &team);
    queue_release(queue, &one);
    claim(store, queue, &one, owner);
    assert_string_equal(owner, "bert");
    assert_int_equal(one.count, 1);
    assert_false(queue_gives_way(queue, &one)); /* a chunk goes on to its end */
    queue_spend(queue, &one, 50);
    claim(store, queue, &team, owner);
    assert_string_equal(owner, "anna");
    assert_int_equal(team.chunk, 0);
    assert_int_equal(team.count, 4);
    assert_false(queue_gives_way(queue, &team)); /* bert has had more */
    queue_release(queue, &one);
    queue_release(queue, &team);
    end(queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(owners_share_time),
        BENCH_TEST(use_outlives_the_queue),
        BENCH_TEST(use_is_forgotten_by_half),
        BENCH_TEST(a_newcomer_waits_for_one_chunk),
        BENCH_TEST(newcomers_starve_nobody),
        BENCH_TEST(priority_goes_first_within_an_owner),
        BENCH_TEST(priority_does_not_reach_other_owners),
        BENCH_TEST(a_sweep_delays_others_by_one_chunk),
        BENCH_TEST(teams_give_way),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
