/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_attempts.c - what became of each time that a job was in motion, and what that does to it. */
#include "store_bench.h"

#include "crash.h"
#include "limits.h"
#include "store_attempts.h"
#include "store_internal.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* Sanitizers take the fatal signals. */
#ifdef __has_feature
#define SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#else
#define SANITIZED 0
#endif

/* "done", "lost lost stopped": how the job's attempts ended, oldest first, "-" = in motion. */
static void assert_attempts(struct store *store, const char *id, const char *expected)
{
    struct attempt *attempts = NULL;
    char words[512] = "";
    size_t count = 0;

    assert_int_equal(store_attempts_list(store, id, 1000, &attempts, &count), STORE_OK);
    for (size_t i = count; i-- > 0;) {
        size_t used = strlen(words);

        assert_int_equal(attempts[i].number, count - i);
        assert_true(attempts[i].started_ms > 0);
        assert_true((attempts[i].ended_ms == 0) == (attempts[i].ended[0] == '\0'));
        snprintf(words + used, sizeof words - used, "%s%s", used ? " " : "",
                 attempts[i].ended[0] ? attempts[i].ended : "-");
    }
    attempts_free(attempts, count);
    assert_string_equal(words, expected);
}

static void assert_tallies(struct store *store, const char *id, int64_t lost, int64_t failed)
{
    struct job_record record;

    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    assert_int_equal(record.attempts_lost, lost);
    assert_int_equal(record.attempts_failed, failed);
    job_record_fini(&record);
}

static void assert_barren(struct store *store, const char *id, int64_t lost, int64_t crashed)
{
    struct attempts_barren barren;

    assert_int_equal(store_attempts_barren(store, id, &barren), STORE_OK);
    assert_int_equal(barren.lost, lost);
    assert_int_equal(barren.crashed, crashed);
}

static void recover(struct store *store, const char *crashed)
{
    struct attempt_crash crash = {.reason = "SIGSEGV in chunk 1"};

    const struct attempts_end end = {.crashes = &crash, .count = crashed != NULL};

    snprintf(crash.job, sizeof crash.job, "%s", crashed ? crashed : "");
    assert_int_equal(store_attempts_recover(store, &end), STORE_OK);
}

static void begin(struct store *store, int tag, char id[JOB_ID_SIZE])
{
    bench_insert(store, tag, "{}", id);
    assert_attempts(store, id, "");
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_attempts(store, id, "-");
}

static void attempts_end_as_jobs_do(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];

    begin(store, 1, id);
    assert_int_equal(store_results_finish(store, id, NULL, 0), STORE_OK);
    assert_attempts(store, id, "done");
    begin(store, 2, id);
    assert_int_equal(store_jobs_fail(store, id, "why"), STORE_OK);
    assert_attempts(store, id, "failed");
    assert_tallies(store, id, 0, 1);
    begin(store, 3, id);
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    assert_attempts(store, id, "cancelled");
    assert_tallies(store, id, 0, 0);
    bench_insert(store, 4, "{}", id);
    assert_int_equal(store_jobs_cancel(store, id), STORE_OK);
    assert_attempts(store, id, "");
    struct attempt *attempts = NULL;
    size_t count;
    assert_int_equal(store_attempts_list(store, "jnone", 9, &attempts, &count), STORE_NOT_FOUND);
}

static void starts_tell_lost_from_stopped(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE];

    begin(store, 1, id);
    bench_insert(store, 2, "{}", other);
    recover(store, NULL);
    assert_attempts(store, id, "lost -");
    assert_attempts(store, other, "");
    assert_int_equal(store_attempts_stop(store), STORE_OK);
    recover(store, NULL);
    assert_attempts(store, id, "lost stopped -");
    assert_tallies(store, id, 1, 0);
    assert_int_equal(bench_state(store, id), JOB_RUNNING);
}

static void assert_used(struct store *store, const char *id, double expected)
{
    double seconds = -1;

    assert_int_equal(store_attempts_used(store, id, &seconds), STORE_OK);
    assert_float_equal(seconds, expected, 1e-12);
}

/* Each use goes to the latest attempt, ended or not. */
static void attempts_have_their_cost(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct attempt_use uses[3] = {{.seconds = 1.5}, {.seconds = 0.25}, {"jnone", 7}};
    struct attempt *attempts = NULL;
    size_t count;

    begin(store, 1, uses[0].job);
    begin(store, 2, uses[1].job);
    assert_used(store, uses[0].job, 0);
    assert_int_equal(store_attempts_use(store, uses, 3), STORE_OK);
    recover(store, NULL);
    assert_int_equal(store_attempts_use(store, uses, 1), STORE_OK);
    uses[0].seconds = 2;
    assert_int_equal(store_jobs_cancel(store, uses[0].job), STORE_OK);
    assert_int_equal(store_attempts_use(store, uses, 1), STORE_OK);
    assert_used(store, uses[0].job, 5);
    assert_used(store, uses[1].job, 0.25);
    assert_used(store, "jnone", 0);
    assert_int_equal(store_attempts_list(store, uses[0].job, 9, &attempts, &count), STORE_OK);
    assert_int_equal(count, 2);
    assert_float_equal(attempts[0].core_seconds, 3.5, 0);
    assert_float_equal(attempts[1].core_seconds, 1.5, 0);
    attempts_free(attempts, count);
}

/* As often as one likes: only crashes of its own end a job. */
static void lost_attempts_end_no_job(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];

    begin(store, 1, id);
    for (int i = 0; i < 100; i++)
        recover(store, NULL);
    assert_tallies(store, id, 100, 0);
    assert_barren(store, id, 100, 0);
    assert_int_equal(bench_state(store, id), JOB_RUNNING);
    /* What was saved is told from nothing, by chunks and checkpoints alike. */
    assert_int_equal(store_results_checkpoint(store, id, 1, "abc", 3), STORE_OK);
    recover(store, NULL);
    assert_barren(store, id, 0, 0);
    recover(store, NULL);
    assert_barren(store, id, 1, 0);
    assert_int_equal(store_results_checkpoint(store, id, 1, "abd", 3), STORE_OK);
    recover(store, NULL);
    assert_barren(store, id, 0, 0);
    assert_int_equal(store_results_put_chunk(store, id, 1, "abc", 3), STORE_OK);
    recover(store, NULL);
    assert_barren(store, id, 0, 0);
}

static void three_crashes_end_a_job_and_no_other(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE], beside[JOB_ID_SIZE];
    struct job_record record;

    begin(store, 1, id);
    begin(store, 2, beside);
    recover(store, id);
    recover(store, NULL);
    recover(store, id);
    assert_attempts(store, id, "crashed lost crashed -");
    assert_barren(store, id, 1, 2);
    assert_int_equal(bench_state(store, id), JOB_RUNNING);
    recover(store, "jnobody");
    recover(store, id);
    assert_attempts(store, id, "crashed lost crashed lost crashed");
    assert_tallies(store, id, 2, LIMIT_CRASHES_MAX);
    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    assert_int_equal(record.state, JOB_FAILED);
    assert_string_equal(record.error,
                        "it crashed the server 3 times, the last time by SIGSEGV in chunk 1");
    job_record_fini(&record);
    assert_attempts(store, beside, "lost lost lost lost lost -");
    assert_int_equal(bench_state(store, beside), JOB_RUNNING);
    recover(store, id); /* once more, too late */
    assert_attempts(store, id, "crashed lost crashed lost crashed");
}

/* Its scene may be what crashes the worker that wants to start it. */
static void a_job_that_never_began_can_crash_too(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];

    bench_insert(store, 1, "{}", id);
    for (int i = 0; i < LIMIT_CRASHES_MAX; i++) {
        assert_int_equal(bench_state(store, id), JOB_QUEUED);
        recover(store, id);
    }
    assert_int_equal(bench_state(store, id), JOB_FAILED);
    assert_attempts(store, id, "crashed crashed crashed");
}

/* ---------------------------------------------------------------------- notes */

/* What a process that notes things leaves behind when it meets a signal. */
#if !SANITIZED
static void die(const char *path, const char *job, int number)
{
    pid_t child = fork();
    int ended = 0;

    assert_true(child >= 0);
    if (child == 0) {
        sigset_t all;

        for (int i = 1; i < NSIG; i++)
            signal(i, SIG_DFL); /* the test frame has handlers of its own */
        sigfillset(&all);
        sigprocmask(SIG_SETMASK, &all, NULL); /* as workers do */
        crash_watch();
        crash_enter(path);
        crash_note("jbefore", 7);
        crash_note(job, 3);
        raise(number);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &ended, 0), child);
    assert_true(WIFSIGNALED(ended));
    assert_int_equal(WTERMSIG(ended), number);
}
#endif

static void signals_leave_notes(void **state)
{
    struct bench *bench = *state;
    char path[TEMP_DIR_SIZE + 16];
    struct attempt_crash *crashes;
    size_t count = 9;
    FILE *file;

    snprintf(path, sizeof path, "%s/bcd.crashed", bench->dir);
    crashes = crash_read(path, &count);
    assert_int_equal(count, 0);
    free(crashes);
#if !SANITIZED
    die(path, "jabc", SIGBUS);
    die(path, NULL, SIGSEGV);
    die(path, "jkilled", SIGKILL);
    die(path, "jlonger-than-that", SIGABRT);
#else
    file = fopen(path, "w");
    fputs("jabc 3 7\njlonger-than-that 3 6\n", file);
    fclose(file);
#endif
    file = fopen(path, "a");
    fputs("no note\n\njwhole -1 11\njhalf 1", file);
    fclose(file);
    crashes = crash_read(path, &count);
    assert_int_equal(count, 3);
    assert_string_equal(crashes[0].job, "jabc");
    assert_string_equal(crashes[0].reason, "SIGBUS in chunk 3");
    assert_string_equal(crashes[1].job, "jlonger-than-that");
    assert_string_equal(crashes[1].reason, "SIGABRT in chunk 3");
    assert_string_equal(crashes[2].job, "jwhole");
    assert_string_equal(crashes[2].reason, "SIGSEGV");
    free(crashes);
    assert_int_not_equal(access(path, F_OK), 0);
}

/* Memory that never suffices ends a job; that others starve beside it, or that it gets anywhere,
 * does not. */
static void want_of_memory_ends_a_job_in_the_end(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    const struct attempts_end starved = {.starved = true};
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE];
    struct job_record record;

    begin(store, 1, id);
    begin(store, 2, other);
    for (int i = 1; i < LIMIT_STARVED_MAX; i++)
        assert_int_equal(store_attempts_recover(store, &starved), STORE_OK);
    recover(store, NULL); /* a kill -9 in between */
    for (int i = 1; i < LIMIT_STARVED_MAX; i++)
        assert_int_equal(store_attempts_recover(store, &starved), STORE_OK);
    assert_int_equal(bench_state(store, id), JOB_RUNNING);
    assert_int_equal(store_results_checkpoint(store, other, 1, "abc", 3), STORE_OK);
    assert_int_equal(store_attempts_recover(store, &starved), STORE_OK);
    assert_int_equal(bench_state(store, id), JOB_FAILED);
    assert_int_equal(bench_state(store, other), JOB_RUNNING);
    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    assert_non_null(strstr(record.error, "out of memory"));
    assert_int_equal(record.attempts_lost, 2 * LIMIT_STARVED_MAX);
    job_record_fini(&record);
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");

    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void the_kernel_tells_of_want_of_memory(void **state)
{
    const struct bench *bench = *state;
    char vmstat[TEMP_DIR_SIZE + 16], path[TEMP_DIR_SIZE + 16];

    snprintf(vmstat, sizeof vmstat, "%s/vmstat", bench->dir);
    snprintf(path, sizeof path, "%s/bcd.starved", bench->dir);
    assert_false(crash_starved(vmstat, path)); /* nothing is told */
    write_text(vmstat, "nr_free_pages 5\noom_kill 3\nother 7\n");
    assert_false(crash_starved(vmstat, path)); /* asked for the first time */
    assert_false(crash_starved(vmstat, path));
    write_text(vmstat, "nr_free_pages 5\noom_kill 4\nother 7\n");
    assert_true(crash_starved(vmstat, path));
    assert_false(crash_starved(vmstat, path));
    write_text(vmstat, "oom_kill 0\n"); /* a reboot */
    assert_false(crash_starved(vmstat, path));
    write_text(path, "what\n");
    assert_false(crash_starved(vmstat, path));
    write_text(vmstat, "nothing of it\n");
    assert_false(crash_starved(vmstat, path));
    assert_int_equal(unlink(path), 0); /* this machine may have killed since it was started */
    assert_false(crash_starved(CRASH_VMSTAT, path));
    assert_int_equal(access(path, R_OK), 0); /* this kernel tells */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(attempts_end_as_jobs_do),
        BENCH_TEST(starts_tell_lost_from_stopped),
        BENCH_TEST(attempts_have_their_cost),
        BENCH_TEST(lost_attempts_end_no_job),
        BENCH_TEST(three_crashes_end_a_job_and_no_other),
        BENCH_TEST(a_job_that_never_began_can_crash_too),
        BENCH_TEST(want_of_memory_ends_a_job_in_the_end),
        BENCH_TEST(the_kernel_tells_of_want_of_memory),
        BENCH_TEST(signals_leave_notes),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
