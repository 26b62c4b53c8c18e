/* SPDX-License-Identifier: GPL-3.0-or-later
 * What Slurm's programs say, and how long they may take to say it; what an operator may write.
 * Waits: for who hangs. */
#include "slurm_command.h"
#include "slurm_file.h"
#include "slurm_pilots.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

/* ------------------------------------------------------------------ commands */

static char *run(const char *script, const char *in, int64_t most_ms, int *status)
{
    const char *arguments[] = {"/bin/sh", "-c", script, NULL};
    const struct slurm_command command = {.arguments = arguments, .in = in, .most_ms = most_ms};
    return slurm_command_run(&command, status);
}

static void a_command_reads_and_writes(void **state)
{
    int status;
    (void)state;
    char *said = run("tr a-z A-Z", "pilots", 20000, &status);
    assert_string_equal(said, "PILOTS");
    assert_int_equal(status, 0);
    free(said);
    said = run("true", "", 20000, &status);
    assert_string_equal(said, "");
    free(said);
}

static void a_command_that_fails_says_nothing(void **state)
{
    const char *arguments[] = {"/nowhere/squeue", NULL};
    const struct slurm_command command = {.arguments = arguments, .in = "", .most_ms = 1000};
    int status;
    (void)state;
    assert_null(run("echo half; exit 3", "", 20000, &status));
    assert_int_equal(status, 3);
    assert_null(run("kill -9 $$", "", 20000, &status));
    assert_int_equal(status, -1);
    assert_null(slurm_command_run(&command, &status));
    assert_int_not_equal(status, 0);
}

static void a_command_that_hangs_is_ended(void **state)
{
    static const char *const scripts[] = {"sleep 1000", "echo half; sleep 1000 & wait",
                                          "exec >&-; sleep 1000", "trap '' TERM; sleep 1000"};
    (void)state;
    for (size_t i = 0; i < sizeof(scripts) / sizeof(scripts[0]); i++) {
        time_t before = time(NULL);
        int status = 0;
        assert_null(run(scripts[i], "", 300, &status));
        assert_int_equal(status, -1);
        assert_true(time(NULL) - before < 100);
    }
}

static void a_command_ends_when_the_daemon_does(void **state)
{
    const char *arguments[] = {"/bin/sleep", "1000", NULL};
    atomic_bool stopping = true;
    const struct slurm_command command = {
        .arguments = arguments, .in = "", .most_ms = 1000000, .stopping = &stopping};
    int status;
    (void)state;
    assert_null(slurm_command_run(&command, &status));
    assert_int_equal(status, -1);
}

/* -------------------------------------------------------------------- pilots */

static void see(struct slurm_pilots *pilots, const char *said, struct pilots_seen *seen,
                struct pilots_ended *ended)
{
    char *copy = strdup(said);
    *ended = (struct pilots_ended){0};
    slurm_pilots_queue(pilots, copy, seen, ended);
    free(copy);
}

static void what_squeue_says(void **state)
{
    struct slurm_pilots *pilots = slurm_pilots_create();
    struct pilots_seen seen;
    struct pilots_ended ended;
    (void)state;
    assert_true(slurm_pilots_submitted(pilots, "12;cluster", 6));
    assert_false(slurm_pilots_submitted(pilots, "sbatch: error", 6));
    see(pilots,
        "12_0 RUNNING None\n12_1 PENDING Resources\n12_2 PENDING BeginTime\n"
        "12_3 PENDING launch failed requeued held\n12_4 FAILED NonZeroExitCode\n"
        "12_5 COMPLETING None\n7_0 RUNNING None\n7_1 FAILED None\n\nnonsense\n",
        &seen, &ended);
    assert_int_equal(seen.running, 3); /* also one that is about to end, and another daemon's */
    assert_int_equal(seen.waiting, 1);
    assert_int_equal(seen.late.count, 1);
    assert_string_equal(seen.late.id[0], "12_2");
    assert_int_equal(seen.held.count, 1);
    assert_string_equal(seen.held.id[0], "12_3");
    assert_int_equal(ended.badly, 1); /* the other is none of ours */
    assert_string_equal(ended.worst, "12_4");
    assert_string_equal(ended.state, "FAILED");
    see(pilots, "12_4 FAILED NonZeroExitCode\n", &seen, &ended);
    assert_int_equal(ended.badly, 0); /* told once */
    slurm_pilots_free(pilots);
}

static void what_sacct_says(void **state)
{
    struct slurm_pilots *pilots = slurm_pilots_create();
    struct pilots_seen seen;
    struct pilots_ended ended;
    char jobs[64], said[] = "12_0|COMPLETED\n12_1|RUNNING\n13|OUT_OF_MEMORY\n14_0|FAILED\n";
    (void)state;
    assert_false(slurm_pilots_missing(pilots, jobs, sizeof(jobs)));
    assert_true(slurm_pilots_submitted(pilots, "12", 2));
    assert_true(slurm_pilots_submitted(pilots, "13", 1));
    see(pilots, "12_1 RUNNING None\n", &seen, &ended);
    assert_true(slurm_pilots_missing(pilots, jobs, sizeof(jobs)));
    assert_string_equal(jobs, "12,13");
    slurm_pilots_accounted(pilots, said, &ended);
    assert_int_equal(ended.well, 1);
    assert_int_equal(ended.badly, 1);
    assert_string_equal(ended.worst, "13");
    assert_string_equal(ended.state, "OUT_OF_MEMORY");
    assert_false(slurm_pilots_missing(pilots, jobs, sizeof(jobs)));

    see(pilots, "", &seen, &ended);
    assert_true(slurm_pilots_missing(pilots, jobs, sizeof(jobs)));
    slurm_pilots_forget(pilots);
    assert_false(slurm_pilots_missing(pilots, jobs, sizeof(jobs)));
    slurm_pilots_free(pilots);
}

/* More arrays than are remembered do no harm, nor does what Slurm says of tasks there are not. */
static void many_arrays(void **state)
{
    struct slurm_pilots *pilots = slurm_pilots_create();
    struct pilots_seen seen;
    struct pilots_ended ended;
    char said[32], jobs[4096];
    (void)state;
    for (int i = 1; i <= 100; i++) {
        snprintf(said, sizeof(said), "%d", i);
        assert_true(slurm_pilots_submitted(pilots, said, 3));
    }
    see(pilots, "100_7 FAILED None\n100_-1 FAILED None\n1_0 FAILED None\n100_2 FAILED None\n",
        &seen, &ended);
    assert_int_equal(ended.badly, 1);
    assert_true(slurm_pilots_missing(pilots, jobs, sizeof(jobs)));
    assert_non_null(strstr(jobs, ",100"));
    assert_true(slurm_pilots_missing(pilots, jobs, 40));
    assert_true(strlen(jobs) < 40);
    slurm_pilots_free(pilots);
}

/* ---------------------------------------------------------------------- file */

static bool read_text(const char *text, struct slurm_file *file, char *reason, size_t size)
{
    char path[] = "/tmp/test_slurm.XXXXXX";
    int fd = mkstemp(path);
    assert_int_equal(write(fd, text, strlen(text)), strlen(text));
    close(fd);
    bool good = slurm_file_read(path, file, reason, size);
    unlink(path);
    return good;
}

static void the_file(void **state)
{
    static const char *const wrong[] = {
        "pilots = 0",      "pilots = 10001",  "pilots = many",         "pilots = 1 2",
        "pilots",          "partition = a;b", "account = $(x)",        "queue = all",
        "time = 1 2",      "timeout = 0",     "modules = gcc; reboot", "name = a\"b",
        "token_file = `x`"};
    struct slurm_file file;
    char reason[512];
    (void)state;
    assert_true(read_text("# words\n\n  pilots = 7 \r\nmodules = gcc/12 gsl\ntime=04:00:00\n",
                          &file, reason, sizeof(reason)));
    assert_int_equal(file.pilots, 7);
    assert_int_equal(file.timeout_s, 20);
    assert_string_equal(file.modules, "gcc/12 gsl");
    assert_string_equal(file.time, "04:00:00");
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        char text[128];
        snprintf(text, sizeof(text), "idle = 5\n%s\n", wrong[i]);
        assert_false(read_text(text, &file, reason, sizeof(reason)));
        assert_non_null(strstr(reason, "line 2"));
    }
    assert_false(slurm_file_read("/nowhere/slurm.conf", &file, reason, sizeof(reason)));
    assert_true(slurm_file_read("deploy/slurm.conf.example", &file, reason, sizeof(reason)));
    assert_string_equal(file.partition, "normal");
    assert_false(slurm_file_harmless("/a b"));
    assert_false(slurm_file_harmless(""));
    assert_true(slurm_file_harmless("/home/bcd/share"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_command_reads_and_writes),
        cmocka_unit_test(a_command_that_fails_says_nothing),
        cmocka_unit_test(a_command_that_hangs_is_ended),
        cmocka_unit_test(a_command_ends_when_the_daemon_does),
        cmocka_unit_test(what_squeue_says),
        cmocka_unit_test(what_sacct_says),
        cmocka_unit_test(many_arrays),
        cmocka_unit_test(the_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
