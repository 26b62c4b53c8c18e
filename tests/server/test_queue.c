/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_queue.c - queue.h against what it promises: order, release, cancel, recovery, threads. */
#include "job_bench.h"

#include "limits.h"
#include "store_results.h"
#include "support/experiment.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct queue *make_queue(struct store *store)
{
    struct queue *queue = NULL;

    assert_int_equal(queue_create(&queue, store), STORE_OK);
    return queue;
}

static void assert_claim(struct queue *queue, struct task *task, const char *id, int64_t chunk)
{
    assert_true(queue_claim(queue, task));
    assert_string_equal(task->id, id);
    assert_int_equal(task->chunk, chunk);
    assert_false(atomic_load(task->cancelled));
}

static void assert_done(struct queue *queue, struct task *task, bool expected)
{
    bool last = !expected;

    queue_done(queue, task, &last);
    assert_int_equal(last, expected);
}

/* Nothing is to be claimed: the queue would wait, so it is stopped first. Ends the queue. */
static void assert_nothing_left(struct queue *queue, const char *id)
{
    assert_true(queue_progress(queue, id) < 0);
    queue_stop(queue);
    assert_false(queue_claim(queue, &(struct task){0}));
    queue_free(queue);
}

/* --------------------------------------------------------------------- claiming */

static void chunks_of_the_oldest_job_come_first(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE];
    struct task task[4];

    job_bench_submit(store, queue, job_bench_scene(2, 1), a);
    job_bench_submit(store, queue, job_bench_scene(2, 2), b);
    assert_int_equal(bench_state(store, a), JOB_QUEUED);
    assert_claim(queue, &task[0], a, 0);
    assert_int_equal(bench_state(store, a), JOB_RUNNING);
    assert_claim(queue, &task[1], a, 1);
    assert_int_equal(bench_state(store, b), JOB_QUEUED);
    assert_claim(queue, &task[2], b, 0);
    assert_int_equal(bench_state(store, b), JOB_RUNNING);
    /* What goes back is the first to be handed out again. */
    queue_release(queue, &task[0]);
    assert_claim(queue, &task[0], a, 0);
    assert_claim(queue, &task[3], b, 1);
    assert_done(queue, &task[1], false);
    assert_done(queue, &task[0], true);
    queue_forget(queue, a);
    assert_true(queue_progress(queue, a) < 0);
    assert_done(queue, &task[3], false);
    assert_done(queue, &task[2], true);
    queue_forget(queue, b);
    assert_nothing_left(queue, b);
}

static void progress_counts_ticks(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char id[JOB_ID_SIZE];
    struct task task[2];

    job_bench_submit(store, queue, job_bench_scene(2, 1), id);
    assert_true(queue_progress(queue, id) < 0); /* the store knows that it is queued */
    assert_true(queue_progress(queue, "jnone") < 0);
    assert_claim(queue, &task[0], id, 0);
    assert_claim(queue, &task[1], id, 1);
    assert_float_equal(queue_progress(queue, id), 0.0, 0.0);
    atomic_store(task[0].ticks_total, 1000);
    atomic_store(task[0].ticks_done, 500);
    assert_float_equal(queue_progress(queue, id), 0.25, 0.0);
    atomic_store(task[1].ticks_total, 1000);
    atomic_store(task[1].ticks_done, 1000);
    assert_float_equal(queue_progress(queue, id), 0.75, 0.0);
    assert_done(queue, &task[1], false);
    assert_float_equal(queue_progress(queue, id), 0.75, 0.0);
    queue_release(queue, &task[0]);
    assert_float_equal(queue_progress(queue, id), 0.5, 0.0);
    queue_stop(queue);
    queue_free(queue);
}

/* ---------------------------------------------------------------------- cancel */

/* As the handler does it: the store first. */
static void cancel(struct store *store, struct queue *queue, const char *id)
{
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    queue_cancel(queue, id);
}

static void a_cancelled_job_is_handed_out_no_more(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE], c[JOB_ID_SIZE];
    struct task task[3];

    job_bench_submit(store, queue, job_bench_scene(3, 1), a);
    job_bench_submit(store, queue, job_bench_scene(1, 2), b);
    job_bench_submit(store, queue, job_bench_scene(1, 3), c);
    assert_claim(queue, &task[0], a, 0);
    assert_claim(queue, &task[1], a, 1);
    cancel(store, queue, b);
    cancel(store, queue, a);
    queue_cancel(queue, a);
    queue_cancel(queue, "jnone");
    assert_true(atomic_load(task[0].cancelled));
    assert_true(queue_progress(queue, a) < 0);
    assert_claim(queue, &task[2], c, 0);
    /* The scene stays until the last worker lets go. */
    assert_true(bcd_scene_chunks(task[1].scene) == 3);
    queue_release(queue, &task[0]);
    assert_true(bcd_scene_chunks(task[1].scene) == 3);
    assert_done(queue, &task[1], false);
    assert_done(queue, &task[2], true);
    queue_forget(queue, c);
    assert_nothing_left(queue, a);
}

static void a_job_cancelled_while_it_is_finished_stays_whole(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char id[JOB_ID_SIZE];
    struct task task;

    job_bench_submit(store, queue, job_bench_scene(1, 1), id);
    assert_claim(queue, &task, id, 0);
    assert_done(queue, &task, true);
    queue_cancel(queue, id);
    assert_true(atomic_load(task.cancelled));
    assert_int_equal(bcd_scene_chunks(task.scene), 1);
    assert_string_equal(task.id, id);
    queue_forget(queue, task.id);
    assert_nothing_left(queue, id);
}

/* DELETE came when the queue knew already that this job comes next. */
static void a_job_cancelled_in_the_store_never_starts(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE], c[JOB_ID_SIZE];
    struct task task[2];

    job_bench_submit(store, queue, job_bench_scene(1, 3), c);
    job_bench_submit(store, queue, job_bench_scene(2, 1), a);
    job_bench_submit(store, queue, job_bench_scene(1, 2), b);
    assert_claim(queue, &task[0], c, 0);
    cancel(store, queue, a);
    assert_claim(queue, &task[1], b, 0);
    assert_true(queue_progress(queue, a) < 0);
    assert_int_equal(bench_state(store, a), JOB_CANCELLED);
    for (int i = 0; i < 2; i++)
        assert_done(queue, &task[i], true);
    queue_forget(queue, b);
    queue_forget(queue, c);
    assert_nothing_left(queue, a);
}

static void the_same_job_is_taken_once(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char id[JOB_ID_SIZE];
    struct task task;

    job_bench_submit(store, queue, job_bench_scene(1, 1), id);
    queue_take(queue, OWNER_LOCAL);
    assert_claim(queue, &task, id, 0);
    assert_done(queue, &task, true);
    queue_forget(queue, id);
    assert_nothing_left(queue, id);
}

/* ------------------------------------------------------------------------ aside */

/* A job of one chunk that a worker has run and put off. */
static void put_off(struct store *store, struct queue *queue, const char *owner, int seed,
                    char id[JOB_ID_SIZE])
{
    struct ticket ticket = {0};
    struct task task;

    snprintf(ticket.owner, sizeof ticket.owner, "%s", owner);
    job_bench_submit_as(store, queue, job_bench_scene(1, seed), &ticket, id);
    assert_claim(queue, &task, id, 0);
    assert_done(queue, &task, true);
    queue_put_off(queue, &task);
    assert_null(task.entry);
    assert_float_equal(queue_progress(queue, id), 1.0, 0.0);
}

static void assert_finish(struct queue *queue, size_t threads, struct task *task, const char *id)
{
    assert_true(queue_claim_finish(queue, threads, task));
    assert_string_equal(task->id, id);
    assert_int_equal(task->chunk, QUEUE_FINISH);
}

static void *finish_one(void *context)
{
    struct task task;

    return queue_claim_finish(context, 2, &task) ? context : NULL;
}

/* One at a time beside chunks, as many as there are threads without them; workers go on. */
static void what_is_put_off_is_finished_aside(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE], c[JOB_ID_SIZE], d[JOB_ID_SIZE];
    struct task task[3], chunk;
    pthread_t waiting;
    void *result = NULL;

    put_off(store, queue, "eve", 1, a);
    put_off(store, queue, "eve", 2, b);
    put_off(store, queue, "eve", 3, c);
    assert_finish(queue, 2, &task[0], a);
    assert_finish(queue, 2, &task[1], b);
    job_bench_submit(store, queue, job_bench_scene(1, 4), d);
    assert_claim(queue, &chunk, d, 0);
    queue_forget(queue, a);
    assert_int_equal(pthread_create(&waiting, NULL, finish_one, queue), 0);
    job_bench_nap(50);
    assert_true(queue_progress(queue, c) >= 0); /* it waits: one and a chunk are all */
    cancel(store, queue, b);
    assert_true(atomic_load(task[1].cancelled));
    queue_forget(queue, b); /* there is none beside the chunk any more */
    pthread_join(waiting, &result);
    assert_non_null(result);
    queue_forget(queue, c);
    assert_done(queue, &chunk, true);
    queue_forget(queue, d);
    assert_nothing_left(queue, c);
}

/* Nor is it begun when it was cancelled, or the queue stops. */
static void what_is_put_off_can_be_cancelled(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE];
    struct task task;

    put_off(store, queue, "eve", 1, a);
    put_off(store, queue, "eve", 2, b);
    cancel(store, queue, a);
    assert_true(queue_progress(queue, a) < 0);
    assert_finish(queue, 1, &task, b);
    cancel(store, queue, b);
    queue_forget(queue, b);
    queue_stop(queue);
    assert_false(queue_claim_finish(queue, 1, &task));
    queue_free(queue);
}

/* Of whom many wait no further jobs are begun; others go on. */
static void no_more_are_begun_than_can_be_finished(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char id[LIMIT_FINISHES_WAITING][JOB_ID_SIZE], more[JOB_ID_SIZE], his[JOB_ID_SIZE];
    struct ticket eve = {.owner = "eve"}, adam = {.owner = "adam"};
    struct task task;

    for (int i = 0; i < LIMIT_FINISHES_WAITING; i++)
        put_off(store, queue, "eve", i + 1, id[i]);
    job_bench_submit_as(store, queue, job_bench_scene(1, 100), &eve, more);
    job_bench_submit_as(store, queue, job_bench_scene(1, 101), &adam, his);
    assert_claim(queue, &task, his, 0);
    assert_done(queue, &task, true);
    queue_forget(queue, his);
    assert_int_equal(bench_state(store, more), JOB_QUEUED);
    assert_finish(queue, 1, &task, id[0]); /* one of hers is in motion: there is room */
    queue_forget(queue, id[0]);
    assert_claim(queue, &task, more, 0);
    queue_stop(queue);
    queue_release(queue, &task);
    queue_free(queue);
}

/* --------------------------------------------------------------------- recovery */

static void recovery_goes_on_where_the_store_is(void **state)
{
    struct bench *bench = *state;
    char fresh[JOB_ID_SIZE], half[JOB_ID_SIZE], whole[JOB_ID_SIZE], gone[JOB_ID_SIZE];
    struct job_record before, after;
    struct queue *queue;
    struct task task[5];

    job_bench_submit(bench->store, NULL, job_bench_scene(3, 1), half);
    job_bench_submit(bench->store, NULL, job_bench_scene(1, 2), gone);
    job_bench_submit(bench->store, NULL, job_bench_scene(2, 3), whole);
    job_bench_submit(bench->store, NULL, job_bench_scene(1, 4), fresh);
    assert_int_equal(store_jobs_start(bench->store, half), STORE_OK);
    assert_int_equal(store_results_put_chunk(bench->store, half, 1, "t", 1), STORE_OK);
    assert_int_equal(store_jobs_cancel(bench->store, gone), STORE_OK);
    assert_int_equal(store_jobs_start(bench->store, whole), STORE_OK);
    assert_int_equal(store_results_put_chunk(bench->store, whole, 0, "t", 1), STORE_OK);
    assert_int_equal(store_results_put_chunk(bench->store, whole, 1, "t", 1), STORE_OK);
    assert_int_equal(store_jobs_get(bench->store, half, &before), STORE_OK);

    bench_reopen(bench);
    queue = make_queue(bench->store);
    assert_int_equal(queue_recover(queue), STORE_OK);
    assert_true(queue_progress(queue, gone) < 0);
    assert_true(queue_progress(queue, half) < 0); /* nobody has taken it up yet */
    assert_claim(queue, &task[0], half, 0);
    assert_float_equal(queue_progress(queue, half), 1.0 / 3.0, 1e-15);
    assert_claim(queue, &task[1], half, 2);
    assert_claim(queue, &task[2], whole, QUEUE_FINISH);
    assert_claim(queue, &task[3], fresh, 0);
    /* A job that ran goes on running; it does not start anew. */
    assert_int_equal(store_jobs_get(bench->store, half, &after), STORE_OK);
    assert_int_equal(after.state, JOB_RUNNING);
    assert_int_equal(after.started_ms, before.started_ms);
    job_record_fini(&before);
    job_record_fini(&after);
    queue_forget(queue, whole);
    assert_done(queue, &task[0], false);
    assert_done(queue, &task[1], true);
    queue_forget(queue, half);
    queue_release(queue, &task[3]);
    cancel(bench->store, queue, fresh);
    assert_nothing_left(queue, whole);
}

/* Those that nobody has taken up yet, as cancelled as any; others of their owner go on. */
static void a_recovered_job_is_cancelled_before_its_turn(void **state)
{
    struct bench *bench = *state;
    char first[JOB_ID_SIZE], second[JOB_ID_SIZE], third[JOB_ID_SIZE];
    struct queue *queue;
    struct task task;

    job_bench_submit(bench->store, NULL, job_bench_scene(1, 1), first);
    job_bench_submit(bench->store, NULL, job_bench_scene(1, 2), second);
    job_bench_submit(bench->store, NULL, job_bench_scene(1, 3), third);
    assert_int_equal(store_jobs_start(bench->store, first), STORE_OK);
    assert_int_equal(store_jobs_start(bench->store, second), STORE_OK);
    bench_reopen(bench);
    queue = make_queue(bench->store);
    assert_int_equal(queue_recover(queue), STORE_OK);
    cancel(bench->store, queue, first);
    assert_int_equal(store_jobs_cancel(bench->store, second), STORE_OK); /* no word of it */
    assert_claim(queue, &task, third, 0);
    assert_int_equal(bench_state(bench->store, first), JOB_CANCELLED);
    assert_int_equal(bench_state(bench->store, second), JOB_CANCELLED);
    assert_done(queue, &task, true);
    queue_forget(queue, third);
    assert_nothing_left(queue, second);
}

/* Puts a row into the store that recovery must refuse to run. */
static void submit_odd(struct store *store, int tag, const char *text, char id[JOB_ID_SIZE])
{
    struct job_new job = bench_job(tag, text);
    struct job_record record;
    bool existed;

    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
    snprintf(id, JOB_ID_SIZE, "%s", record.id);
    job_record_fini(&record);
}

static void assert_failed(struct store *store, const char *id, const char *why)
{
    struct job_record record;

    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    assert_int_equal(record.state, JOB_FAILED);
    if (!strstr(record.error, why))
        fail_msg("\"%s\" does not say \"%s\"", record.error, why);
    job_record_fini(&record);
}

static void recovery_fails_what_it_cannot_run(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char unknown[JOB_ID_SIZE], changed[JOB_ID_SIZE], sound[JOB_ID_SIZE], ran[JOB_ID_SIZE];
    struct queue *queue;
    struct task task;

    submit_odd(store, 3, "{\"model\":\"hard_balls\",\"particles\":3}", ran);
    assert_int_equal(store_jobs_start(store, ran), STORE_OK);
    submit_odd(store, 1, "{\"model\":\"soft_balls\",\"particles\":3}", unknown);
    submit_odd(store, 2,
               "{\"particles\":3,\"length\":10,\"time\":1,\"observables\":{\"energy\":{}},"
               "\"time_step\":0.01}",
               changed);
    job_bench_submit(store, NULL, job_bench_scene(1, 1), sound);
    queue = make_queue(store);
    assert_int_equal(queue_recover(queue), STORE_OK);
    assert_int_equal(bench_state(store, unknown), JOB_QUEUED); /* its turn has not come */
    assert_int_equal(bench_state(store, ran), JOB_RUNNING);    /* nor has that of this one */
    assert_claim(queue, &task, sound, 0);
    assert_failed(store, ran, "/model");
    assert_failed(store, unknown, "/model");
    assert_failed(store, changed, "results differ");
    assert_done(queue, &task, true);
    queue_forget(queue, sound);
    assert_nothing_left(queue, changed);
}

/* ---------------------------------------------------------------------- threads */

static void *claim_one(void *context)
{
    struct task task;

    return queue_claim(context, &task) ? context : NULL;
}

static void stopping_wakes_who_waits(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    pthread_t waiting[3];
    void *result = queue;

    assert_false(queue_stopping(queue));
    for (int i = 0; i < 3; i++)
        assert_int_equal(pthread_create(&waiting[i], NULL, claim_one, queue), 0);
    job_bench_nap(20);
    queue_stop(queue);
    for (int i = 0; i < 3; i++) {
        pthread_join(waiting[i], &result);
        assert_null(result);
    }
    assert_true(queue_stopping(queue));
    queue_free(queue);
}

static void *disk_comes_back(void *context)
{
    job_bench_nap(300);
    job_bench_disk(false);
    return context;
}

static void a_full_disk_delays_the_start(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct queue *queue = make_queue(store);
    char id[JOB_ID_SIZE];
    struct task task;
    pthread_t mender;

    job_bench_submit(store, queue, job_bench_scene(1, 1), id);
    job_bench_disk(true);
    assert_int_equal(pthread_create(&mender, NULL, disk_comes_back, NULL), 0);
    assert_claim(queue, &task, id, 0);
    pthread_join(mender, NULL);
    assert_int_equal(bench_state(store, id), JOB_RUNNING);
    assert_done(queue, &task, true);
    queue_forget(queue, id);
    assert_nothing_left(queue, id);
}

enum { CROWD = 4, CROWD_JOBS = 24, CROWD_CHUNKS = 5 };

struct crowd {
    struct queue *queue;
    atomic_int finished;
};

/* A worker that lets go of every third chunk, and finishes jobs without doing any work. */
static void *crowd_main(void *context)
{
    struct crowd *crowd = context;
    struct task task;

    for (int i = 0; queue_claim(crowd->queue, &task); i++) {
        bool last = false;

        atomic_store(task.ticks_total, 10);
        atomic_store(task.ticks_done, i % 10);
        if (atomic_load(task.cancelled) || i % 3 == 0) {
            queue_release(crowd->queue, &task);
            continue;
        }
        queue_done(crowd->queue, &task, &last);
        if (last) {
            assert_int_equal(bcd_scene_chunks(task.scene), CROWD_CHUNKS);
            atomic_fetch_add(&crowd->finished, 1);
            queue_forget(crowd->queue, task.id);
        }
    }
    return NULL;
}

/* Half of the jobs are cancelled at some moment; every other one is finished exactly once. */
static void a_crowd_finishes_every_job_once(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct crowd crowd = {.queue = make_queue(store)};
    char id[CROWD_JOBS][JOB_ID_SIZE];
    pthread_t threads[CROWD];
    int left = CROWD_JOBS;

    for (int i = 0; i < CROWD; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, crowd_main, &crowd), 0);
    for (int i = 0; i < CROWD_JOBS; i++) {
        job_bench_submit(store, crowd.queue, job_bench_scene(CROWD_CHUNKS, i + 1), id[i]);
        if (i % 2 && store_jobs_cancel(store, id[i - i % 4]) == STORE_OK)
            queue_cancel(crowd.queue, id[i - i % 4]);
    }
    for (int waited = 0; left && waited < 60000; waited += 5) {
        left = 0;
        for (int i = 0; i < CROWD_JOBS; i++)
            left +=
                bench_state(store, id[i]) == JOB_QUEUED || queue_progress(crowd.queue, id[i]) >= 0;
        job_bench_nap(5);
    }
    assert_int_equal(left, 0);
    queue_stop(crowd.queue);
    for (int i = 0; i < CROWD; i++)
        pthread_join(threads[i], NULL);
    assert_in_range(atomic_load(&crowd.finished), CROWD_JOBS * 3 / 4, CROWD_JOBS);
    queue_free(crowd.queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(chunks_of_the_oldest_job_come_first),
        BENCH_TEST(progress_counts_ticks),
        BENCH_TEST(a_cancelled_job_is_handed_out_no_more),
        BENCH_TEST(a_job_cancelled_while_it_is_finished_stays_whole),
        BENCH_TEST(a_job_cancelled_in_the_store_never_starts),
        BENCH_TEST(the_same_job_is_taken_once),
        BENCH_TEST(recovery_goes_on_where_the_store_is),
        BENCH_TEST(what_is_put_off_is_finished_aside),
        BENCH_TEST(what_is_put_off_can_be_cancelled),
        BENCH_TEST(no_more_are_begun_than_can_be_finished),
        BENCH_TEST(a_recovered_job_is_cancelled_before_its_turn),
        BENCH_TEST(recovery_fails_what_it_cannot_run),
        BENCH_TEST(stopping_wakes_who_waits),
        BENCH_TEST(a_full_disk_delays_the_start),
        BENCH_TEST(a_crowd_finishes_every_job_once),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
