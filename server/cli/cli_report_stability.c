/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_stability.c - bcd report stability; see report_stability.h. Each verdict is found by a
 * process of its own: one that crashes or hangs is a verdict too, and the others are still found.
 */
#include "cli_report.h"
#include "report_machine.h"
#include "report_run.h"
#include "report_stability.h"
#include "text.h"

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
static bool asks_for_any(const struct options *options);
static FILE *begin_json(const char *path);
static void write_result(FILE *json, const struct stability_extreme *extreme, const char *method,
                         const struct stability_result *result, const struct count *count);
static bool end_json(FILE *json, const struct count *count, bool whole);
static void print_row(const struct stability_extreme *extreme, const char *method,
                      const struct stability_result *result);

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
    const struct stability_extreme *extreme;
    const char *method;
    printf("%-34s %-17s %-12s %11s %9s %9s %9s\n", "extreme", "method", "verdict", "off", "+-", "h",
           "time");
    for (size_t i = 0; (extreme = stability_extreme(i)) != NULL; i++) {
        if (options->only && !strstr(extreme->name, options->only))
            continue;
        for (size_t m = 1; (method = report_run_method(m)) != NULL; m++) {
            if (options->method && strcmp(options->method, method) != 0)
                continue;
            struct stability_result result = try_apart(extreme, method);
            if (interrupted())
                return false;
            print_row(extreme, method, &result);
            if (json)
                write_result(json, extreme, method, &result, count);
            count->of[result.verdict]++;
            count->failed += stability_failed(result.verdict);
            count->all++;
        }
    }
    return true;
}

int cli_report_stability(const struct cli_line *line)
{
    const struct options options = {.json = cli_value(line, "json"),
                                    .only = cli_value(line, "only"),
                                    .method = cli_value(line, "method")};
    struct count count = {0};
    FILE *json = NULL;
    int status = CLI_OK;
    if (!asks_for_any(&options))
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

static bool asks_for_any(const struct options *options)
{
    const struct stability_extreme *extreme;
    const char *method = NULL;
    for (size_t m = 1; options->method && (method = report_run_method(m)) != NULL; m++)
        if (strcmp(options->method, method) == 0)
            break;
    if (options->method && !method)
        return false;
    for (size_t i = 0; (extreme = stability_extreme(i)) != NULL; i++)
        if (!options->only || strstr(extreme->name, options->only))
            return true;
    return false;
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
        struct stability_result result = stability_try(extreme, method);
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

static FILE *begin_json(const char *path)
{
    FILE *json = fopen(path, "w");
    char *machine = report_machine_json();
    if (json)
        fprintf(json, "{\"machine\":%s,\"version\":\"%s\",\"result_version\":%d,\"entries\":[",
                machine ? machine : "null", BCD_VERSION, BCD_RESULT_VERSION);
    else
        fprintf(stderr, "bcd: %s cannot be written: %s\n", path, strerror(errno));
    free(machine);
    return json;
}

static bool end_json(FILE *json, const struct count *count, bool whole)
{
    fprintf(json, "\n],\"tried\":%zu,\"failed\":%zu,\"interrupted\":%s}\n", count->all,
            count->failed, whole ? "false" : "true");
    bool good = !ferror(json);
    return fclose(json) == 0 && good;
}

/* count: of those before it. */
static void write_result(FILE *json, const struct stability_extreme *extreme, const char *method,
                         const struct stability_result *result, const struct count *count)
{
    struct text text = {0};
    text_add(&text, "%s\n{\"extreme\":", count->all ? "," : "");
    text_add_json_string(&text, extreme->name);
    text_add(&text, ",\"method\":\"%s\",\"verdict\":", method);
    text_add_json_string(&text, stability_verdict_name(result->verdict));
    report_add_member(&text, "off", result->off);
    report_add_member(&text, "stderr", result->stderror);
    report_add_member(&text, "time_step_error", result->time_step_error);
    report_add_member(&text, "bound", extreme->bound);
    report_add_member(&text, "time_step", result->time_step);
    report_add_member(&text, "time", result->time);
    report_add_member(&text, "core_seconds", result->core_seconds);
    text_add(&text, ",\"reason\":");
    if (result->words[0])
        text_add_json_string(&text, result->words);
    else
        text_add(&text, "null");
    text_add(&text, ",\"job\":{%s}}", extreme->members);
    char *entry = text_take(&text);
    fputs(entry ? entry : "", json);
    fflush(json);
    free(entry);
}

static void print_cell(double value, const char *format, int width)
{
    if (isnan(value))
        printf(" %*s", width, "-");
    else
        printf(format, width, value);
}

static void print_row(const struct stability_extreme *extreme, const char *method,
                      const struct stability_result *result)
{
    printf("%-34s %-17s %-12s", extreme->name, method, stability_verdict_name(result->verdict));
    print_cell(result->off, " %+*.2e", 11);
    print_cell(result->stderror, " %*.1e", 9);
    print_cell(result->time_step, " %*.1e", 9);
    print_cell(result->time, " %*.1e", 9);
    printf("%s%s\n", result->words[0] ? "  " : "", result->words);
}
