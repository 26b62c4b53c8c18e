/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_stability.c - bcd report stability; see report_stability.h. Each verdict is found by a
 * process of its own: one that crashes or hangs is a verdict too, and the others are still found.
 */
#include "cli_report.h"
#include "report_stability.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* A single step that never ends is ended by the child's limit of processor time; patience is for
 * one that waits for ever. */
enum { CORE_SECONDS_MAX = 15, PATIENCE_MS = 300000 };

struct options {
    const char *json, *only, *method;
};

struct count {
    size_t of[STABILITY_VERDICTS], all, failed;
};

static struct stability_result try_apart(const struct stability_extreme *extreme,
                                         const char *method);
static FILE *begin_json(const char *path);
static void write_result(FILE *json, const struct stability_entry *entry, size_t before);
static bool end_json(FILE *json, const struct count *count, bool whole);
static void print_row(const struct stability_entry *entry);

/* Ctrl-C and its like wait until a verdict is found: files are left whole. */
static bool interrupted(void)
{
    sigset_t waiting;
    sigpending(&waiting);
    return sigismember(&waiting, SIGINT) || sigismember(&waiting, SIGTERM) ||
           sigismember(&waiting, SIGHUP);
}

static void hold_signals(int how)
{
    sigset_t ending;
    sigemptyset(&ending);
    sigaddset(&ending, SIGINT);
    sigaddset(&ending, SIGTERM);
    sigaddset(&ending, SIGHUP);
    sigprocmask(how, &ending, NULL);
}

/* False = interrupted. */
static bool try_all(const struct options *options, FILE *json, struct count *count)
{
    struct stability_entry entry;
    printf("%-34s %-17s %-12s %11s %9s %9s %9s\n", "extreme", "method", "verdict", "off", "+-", "h",
           "time");
    for (size_t i = 0; stability_plan(options->only, options->method, i, &entry); i++) {
        entry.result = try_apart(entry.extreme, entry.method);
        if (interrupted())
            return false;
        print_row(&entry);
        if (json)
            write_result(json, &entry, count->all);
        count->of[entry.result.verdict]++;
        count->failed += stability_failed(entry.result.verdict);
        count->all++;
    }
    return true;
}

int cli_report_stability(const struct cli_line *line)
{
    const struct options options = {.json = cli_value(line, "json"),
                                    .only = cli_value(line, "only"),
                                    .method = cli_value(line, "method")};
    struct stability_entry first;
    struct count count = {0};
    FILE *json = NULL;
    int status = CLI_OK;
    if (!stability_plan(options.only, options.method, 0, &first))
        return cli_wrong(line->command, "there is no such extreme or method");
    if (options.json && !(json = begin_json(options.json)))
        return CLI_FAILED;
    hold_signals(SIG_BLOCK);
    bool whole = try_all(&options, json, &count);
    for (int v = 0; v < STABILITY_VERDICTS; v++)
        if (count.of[v] > 0)
            printf("%zu %s, ", count.of[v], stability_verdict_name(v));
    printf("%zu in all: %zu silent failures%s\n", count.all, count.failed,
           whole ? "" : "; interrupted");
    fflush(stdout);
    if (json && !end_json(json, &count, whole)) {
        fprintf(stderr, "bcd: %s cannot be written: %s\n", options.json, strerror(errno));
        status = CLI_FAILED;
    }
    hold_signals(SIG_UNBLOCK); /* ends here if one is waiting */
    return count.failed > 0 ? CLI_FAILED : status;
}

/* ------------------------------------------------------- a process for each */

static struct stability_result no_result(enum stability_verdict verdict, const char *words)
{
    struct stability_result result = {.verdict = verdict,
                                      .off = NAN,
                                      .stderror = NAN,
                                      .time_step_error = NAN,
                                      .time_step = NAN,
                                      .time = NAN};
    snprintf(result.words, sizeof result.words, "%s", words);
    return result;
}

/* What the child writes, if it does so in time; then it is gone. */
static struct stability_result await(pid_t child, int from)
{
    struct stability_result result;
    struct pollfd ready = {.fd = from, .events = POLLIN};
    int polled, status = 0;
    do
        polled = poll(&ready, 1, PATIENCE_MS);
    while (polled < 0 && errno == EINTR);
    bool whole = polled > 0 && read(from, &result, sizeof result) == (ssize_t)sizeof result;
    if (polled <= 0)
        kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    if (polled <= 0)
        return no_result(STABILITY_LATE, "waits for ever");
    if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
        return no_result(STABILITY_LATE, "does not end");
    if (WIFSIGNALED(status))
        return no_result(STABILITY_BROKEN, strsignal(WTERMSIG(status)));
    return whole ? result : no_result(STABILITY_BROKEN, "ended without a word");
}

static struct stability_result try_apart(const struct stability_extreme *extreme,
                                         const char *method)
{
    int ends[2];
    fflush(stdout); /* or the child would have it too */
    if (pipe(ends) != 0)
        return no_result(STABILITY_BROKEN, "no pipe can be had");
    pid_t child = fork();
    if (child == 0) {
        const struct rlimit limit = {CORE_SECONDS_MAX, CORE_SECONDS_MAX + 1};
        setrlimit(RLIMIT_CPU, &limit);
        hold_signals(SIG_UNBLOCK);
        struct stability_result result = stability_try(extreme, method, NULL);
        bool told = write(ends[1], &result, sizeof result) == (ssize_t)sizeof result;
        _exit(told ? CLI_OK : CLI_FAILED);
    }
    close(ends[1]);
    struct stability_result result =
        child > 0 ? await(child, ends[0]) : no_result(STABILITY_BROKEN, "no process can be had");
    close(ends[0]);
    return result;
}

/* ------------------------------------------------------------------ output */

/* Takes the text; without memory for it the file cannot be JSON, and is not taken for it. */
static void put(FILE *json, char *text)
{
    fputs(text ? text : "", json);
    free(text);
}

static FILE *begin_json(const char *path)
{
    FILE *json = fopen(path, "w");
    if (!json)
        fprintf(stderr, "bcd: %s cannot be written: %s\n", path, strerror(errno));
    else
        put(json, stability_print_begin());
    return json;
}

static bool end_json(FILE *json, const struct count *count, bool whole)
{
    put(json, stability_print_end(count->all, count->failed, !whole));
    bool good = !ferror(json);
    return fclose(json) == 0 && good;
}

static void write_result(FILE *json, const struct stability_entry *entry, size_t before)
{
    fputs(before ? "," : "", json);
    put(json, stability_print_entries(entry, 1));
    fflush(json);
}

static void print_cell(double value, const char *format, int width)
{
    if (isnan(value))
        printf(" %*s", width, "-");
    else
        printf(format, width, value);
}

static void print_row(const struct stability_entry *entry)
{
    const struct stability_result *result = &entry->result;
    printf("%-34s %-17s %-12s", entry->extreme->name, entry->method,
           stability_verdict_name(result->verdict));
    print_cell(result->off, " %+*.2e", 11);
    print_cell(result->stderror, " %*.1e", 9);
    print_cell(result->time_step, " %*.1e", 9);
    print_cell(result->time, " %*.1e", 9);
    printf("%s%s\n", result->words[0] ? "  " : "", result->words);
}
