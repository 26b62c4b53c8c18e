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
#include <getopt.h>
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
enum { CORE_SECONDS_MAX = 20, PATIENCE_MS = 300000 };

struct options {
    const char *json, *only, *method;
    bool help;
};

struct count {
    size_t of[STABILITY_VERDICTS], all, failed;
};

static int parse_options(const struct cli_command *self, int argc, char **argv,
                         struct options *options);
static struct stability_result try_apart(const struct stability_extreme *extreme,
                                         const char *method);
static void add_result(struct text *json, const struct stability_extreme *extreme,
                       const char *method, const struct stability_result *result);
static void print_row(const struct stability_extreme *extreme, const char *method,
                      const struct stability_result *result);
static int write_take(const char *path, char *content);

static void try_all(const struct options *options, struct text *json, struct count *count)
{
    const struct stability_extreme *extreme;
    const char *method;
    printf("%-34s %-17s %-12s %11s %9s %9s %9s\n", "extreme", "method", "verdict", "off", "+-",
           "h", "time");
    for (size_t i = 0; (extreme = stability_extreme(i)) != NULL; i++) {
        if (options->only && !strstr(extreme->name, options->only))
            continue;
        for (size_t m = 1; (method = report_run_method(m)) != NULL; m++) {
            if (options->method && strcmp(options->method, method) != 0)
                continue;
            struct stability_result result = try_apart(extreme, method);
            print_row(extreme, method, &result);
            text_add(json, count->all ? ",\n" : "\n");
            add_result(json, extreme, method, &result);
            count->of[result.verdict]++;
            count->failed += stability_failed(result.verdict);
            count->all++;
        }
    }
}

int cli_report_stability(const struct cli_command *self, int argc, char **argv)
{
    struct options options;
    struct text json = {0};
    struct count count = {0};
    int status = parse_options(self, argc, argv, &options);
    if (status != CLI_OK)
        return status;
    if (options.help)
        return cli_help(self);
    char *machine = report_machine_json();
    text_add(&json, "{\"machine\":%s,\"version\":\"%s\",\"result_version\":%d,\"entries\":[",
             machine ? machine : "null", BCD_VERSION, BCD_RESULT_VERSION);
    free(machine);
    try_all(&options, &json, &count);
    text_add(&json, "\n],\"tried\":%zu,\"failed\":%zu}\n", count.all, count.failed);
    char *text = text_take(&json);
    if (options.json && count.all > 0)
        status = write_take(options.json, text);
    else
        free(text);
    if (count.all == 0)
        return cli_wrong(self, "there is no such extreme or method");
    for (int v = 0; v < STABILITY_VERDICTS; v++)
        if (count.of[v] > 0)
            printf("%zu %s, ", count.of[v], stability_verdict_name(v));
    printf("%zu in all: %zu silent failures\n", count.all, count.failed);
    return count.failed > 0 ? CLI_FAILED : status;
}

static int parse_options(const struct cli_command *self, int argc, char **argv,
                         struct options *options)
{
    static const struct option names[] = {
        {"json", required_argument, NULL, 'j'},   {"only", required_argument, NULL, 'n'},
        {"method", required_argument, NULL, 'm'}, {"help", no_argument, NULL, 'h'},
        {0},
    };
    int c;
    *options = (struct options){0};
    opterr = 0;
    while ((c = getopt_long(argc, argv, ":h", names, NULL)) != -1) {
        if (c == 'h') {
            options->help = true;
            return CLI_OK;
        }
        if (c == 'j')
            options->json = optarg;
        else if (c == 'n')
            options->only = optarg;
        else if (c == 'm')
            options->method = optarg;
        else
            return cli_wrong_option(self, c, argv[optind - 1]);
    }
    if (optind != argc)
        return cli_wrong(self, "%s is no option", argv[optind]);
    return CLI_OK;
}

/* ------------------------------------------------------- a process for each */

static struct stability_result no_result(enum stability_verdict verdict, const char *words)
{
    struct stability_result result = {.verdict = verdict, .off = NAN, .stderror = NAN,
                                      .time_step = NAN, .time = NAN};
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

static void add_member(struct text *json, const char *name, double value)
{
    text_add(json, ",\"%s\":", name);
    text_add_number(json, value);
}

static void add_result(struct text *json, const struct stability_extreme *extreme,
                       const char *method, const struct stability_result *result)
{
    text_add(json, "{\"extreme\":");
    text_add_json_string(json, extreme->name);
    text_add(json, ",\"method\":\"%s\",\"verdict\":", method);
    text_add_json_string(json, stability_verdict_name(result->verdict));
    add_member(json, "off", result->off);
    add_member(json, "stderr", result->stderror);
    add_member(json, "bound", extreme->bound);
    add_member(json, "time_step", result->time_step);
    add_member(json, "time", result->time);
    add_member(json, "core_seconds", result->core_seconds);
    text_add(json, ",\"reason\":");
    if (result->words[0])
        text_add_json_string(json, result->words);
    else
        text_add(json, "null");
    text_add(json, ",\"job\":{%s}}", extreme->members);
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

/* Writes and frees the text; NULL = out of memory. */
static int write_take(const char *path, char *content)
{
    FILE *file = content ? fopen(path, "w") : NULL;
    bool good = file && fputs(content, file) >= 0;
    if (file && fclose(file) != 0)
        good = false;
    if (!good)
        fprintf(stderr, "bcd: %s cannot be written: %s\n", path, strerror(errno));
    free(content);
    return good ? CLI_OK : CLI_FAILED;
}
