/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store_group.c - transactions that come at the same time: one commit for all, each with the
 * end that is its own. */
#include "store_bench.h"

#include "store_audit.h"
#include "store_internal.h"
#include "store_watch.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { MEMBERS = 5, CROWD = 8, ROUNDS = 40 };

/* A thread that starts a job, or tries to. */
struct member {
    pthread_t thread;
    struct store *store;
    char id[JOB_ID_SIZE];
    enum store_status status;
};

static int count_commit(void *count)
{
    ++*(int *)count;
    return 0;
}

static int refuse_commit(void *count)
{
    ++*(int *)count;
    return 1;
}

static void *start_job(void *context)
{
    struct member *member = context;
    member->status = store_jobs_start(member->store, member->id);
    return NULL;
}

/* All of them wait for a transaction that is in progress, and go on when it ends. */
static void start_together(struct store *store, struct member *members)
{
    sqlite3 *db;
    assert_int_equal(STORE_BEGIN(store, &db), STORE_OK);
    for (int i = 0; i < MEMBERS; i++) {
        members[i].store = store;
        assert_int_equal(pthread_create(&members[i].thread, NULL, start_job, &members[i]), 0);
    }
    while (atomic_load(&store->joining) < MEMBERS)
        usleep(1000);
    assert_int_equal(store_end(store, STORE_CONFLICT), STORE_CONFLICT);
    for (int i = 0; i < MEMBERS; i++)
        pthread_join(members[i].thread, NULL);
}

static void insert_all(struct store *store, struct member *members)
{
    for (int i = 0; i < MEMBERS; i++)
        bench_insert(store, i + 1, "{}", members[i].id);
}

static void those_at_once_are_one_commit(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct member members[MEMBERS];
    int commits = 0;
    insert_all(store, members);
    sqlite3_commit_hook(store->writer, count_commit, &commits);
    start_together(store, members);
    assert_int_equal(commits, 1);
    for (int i = 0; i < MEMBERS; i++) {
        assert_int_equal(members[i].status, STORE_OK);
        assert_int_equal(bench_state(store, members[i].id), JOB_RUNNING);
    }
    assert_int_equal(store_jobs_fail(store, members[0].id, "alone"), STORE_OK);
    assert_int_equal(commits, 2);
}

/* Whichever of them it is that fails. */
static void one_that_fails_is_taken_back_alone(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct member members[MEMBERS];
    int commits = 0;
    insert_all(store, members);
    snprintf(members[2].id, JOB_ID_SIZE, "jnone");
    assert_int_equal(store_jobs_start(store, members[4].id), STORE_OK);
    sqlite3_commit_hook(store->writer, count_commit, &commits);
    start_together(store, members);
    assert_int_equal(commits, 1);
    for (int i = 0; i < MEMBERS; i++)
        assert_int_equal(members[i].status, i == 2   ? STORE_NOT_FOUND
                                            : i == 4 ? STORE_CONFLICT
                                                     : STORE_OK);
    bench_reopen(*state);
    store = ((struct bench *)*state)->store;
    assert_int_equal(bench_state(store, members[0].id), JOB_RUNNING);
    assert_int_equal(bench_state(store, members[3].id), JOB_RUNNING);
}

struct told {
    int moves;
};
static void count_moves(void *context, const struct job_move *moves, size_t count, bool more)
{
    struct told *told = context;
    (void)moves;
    assert_false(more);
    told->moves += (int)count;
}

static void a_commit_that_fails_has_failed_for_all(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct member members[MEMBERS];
    struct told told = {0};
    int commits = 0;
    insert_all(store, members);
    assert_int_equal(store_watch(store, count_moves, &told), STORE_OK);
    sqlite3_commit_hook(store->writer, refuse_commit, &commits);
    start_together(store, members);
    assert_int_equal(commits, 1);
    sqlite3_commit_hook(store->writer, NULL, NULL);
    for (int i = 0; i < MEMBERS; i++) {
        assert_int_equal(members[i].status, STORE_BROKEN);
        assert_int_equal(bench_state(store, members[i].id), JOB_QUEUED);
    }
    assert_int_equal(told.moves, 0);
    assert_int_equal(store_jobs_start(store, members[0].id), STORE_OK);
    assert_int_equal(told.moves, 1);
    assert_int_equal(store_watch(store, NULL, NULL), STORE_OK);
}

/* Inserts jobs and starts them; now and then something that is committed alone. */
static void *crowd(void *context)
{
    static const struct identity nobody = {.owner = "nobody", .role = ROLE_ADMIN};
    struct member *member = context;
    int mine = atoi(member->id);
    member->status = STORE_OK;
    for (int i = 0; i < ROUNDS && member->status == STORE_OK; i++) {
        struct job_new job = bench_job(0, "{}");
        struct job_record record;
        bool existed;
        job.hash[0] = (unsigned char)mine;
        job.hash[1] = (unsigned char)i;
        job.hash[2] = 1;
        member->status = store_jobs_insert(member->store, &job, &record, &existed);
        if (member->status)
            break;
        member->status = store_jobs_start(member->store, record.id);
        job_record_fini(&record);
        if (i % 4 == 0)
            store_audit_write(member->store, &(struct audit_new){&nobody, "a.b", "c", ""});
    }
    return NULL;
}

static void many_of_both_kinds_leave_nothing_out(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    int64_t jobs, audits;
    struct member members[CROWD];
    for (int i = 0; i < CROWD; i++) {
        members[i].store = store;
        snprintf(members[i].id, JOB_ID_SIZE, "%d", i);
        assert_int_equal(pthread_create(&members[i].thread, NULL, crowd, &members[i]), 0);
    }
    for (int i = 0; i < CROWD; i++) {
        pthread_join(members[i].thread, NULL);
        assert_int_equal(members[i].status, STORE_OK);
    }
    bench_reopen(*state);
    store = ((struct bench *)*state)->store;
    jobs = bench_number(store, "SELECT count(*) FROM jobs WHERE state = 'running'");
    audits = bench_number(store, "SELECT count(*) FROM audit");
    assert_int_equal(jobs, CROWD * ROUNDS);
    assert_int_equal(audits, CROWD * ROUNDS / 4);
    assert_int_equal(bench_number(store, "SELECT jobs FROM job_counts WHERE state = 'running'"),
                     jobs);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(those_at_once_are_one_commit),
        BENCH_TEST(one_that_fails_is_taken_back_alone),
        BENCH_TEST(a_commit_that_fails_has_failed_for_all),
        BENCH_TEST(many_of_both_kinds_leave_nothing_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
