/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_report_work_precision.c - bcd report work-precision; see report_work_precision.h. */
#include "cli_report.h"
#include "report_work_precision.h"
#include "text.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct options {
    const char *out, *json;
    bool quiet;
    struct work_precision_options measure;
};

static int read_options(const struct cli_line *line, struct options *options);
static int measure(struct work_precision *report, const struct options *options);
static int write_all(const struct work_precision *report, const struct options *options);

int cli_report_work_precision(const struct cli_line *line)
{
    struct options options;
    int status = read_options(line, &options);
    if (status != CLI_OK)
        return status;
    if (!work_precision_known(&options.measure))
        return cli_wrong(line->command, "there is no such scene or method");
    if (options.out && mkdir(options.out, 0777) != 0 && errno != EEXIST) {
        fprintf(stderr, "bcd: directory %s cannot be made: %s\n", options.out, strerror(errno));
        return CLI_FAILED;
    }
    struct work_precision *report = calloc(1, sizeof *report);
    if (!report)
        return cli_print_take(NULL);
    status = measure(report, &options);
    if (status == CLI_OK)
        status = write_all(report, &options);
    if (status == CLI_OK)
        status = cli_print_take(work_precision_print_table(report));
    free(report);
    return status;
}

/* ----------------------------------------------------------------- options */

static bool parse_budget(const char *text, double *seconds)
{
    char *end;
    *seconds = strtod(text, &end);
    return end != text && *end == '\0' && *seconds >= 1e-3 && *seconds <= 1e4;
}

static int read_options(const struct cli_line *line, struct options *options)
{
    const char *budget = cli_value(line, "budget");
    *options = (struct options){.out = cli_value(line, "out"),
                                .json = cli_value(line, "json"),
                                .quiet = cli_given(line, "quiet"),
                                .measure = WORK_PRECISION_DEFAULT};
    if (cli_given(line, "short"))
        options->measure = WORK_PRECISION_SHORT;
    if (cli_given(line, "full"))
        options->measure = WORK_PRECISION_FULL;
    options->measure.scene = cli_value(line, "scene");
    options->measure.method = cli_value(line, "method");
    if (budget && !parse_budget(budget, &options->measure.core_seconds))
        return cli_wrong(line->command, "--budget is seconds from 0.001 to 10000, not %s", budget);
    return CLI_OK;
}

/* --------------------------------------------------------------- measuring */

static void show_progress(void *context, double share)
{
    (void)context;
    fprintf(stderr, "\rbcd report work-precision: %3.0f %%\033[K", 100 * share);
    fflush(stderr);
}

static int measure(struct work_precision *report, const struct options *options)
{
    struct work_precision_options how = options->measure;
    char reason[WORK_PRECISION_REASON];
    bool show = !options->quiet && isatty(STDERR_FILENO);
    how.progress = show ? show_progress : NULL;
    bool good = work_precision_measure(report, &how, reason);
    if (show)
        fputs("\r\033[K", stderr);
    if (!good)
        fprintf(stderr, "bcd: %s\n", reason);
    return good ? CLI_OK : CLI_FAILED;
}

/* ------------------------------------------------------------------- files */

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

static int write_in(const char *directory, const char *name, char *content)
{
    struct text path = {0};
    text_add(&path, "%s/%s", directory, name);
    char *where = text_take(&path);
    int status = CLI_FAILED;
    if (where)
        status = write_take(where, content);
    else
        free(content);
    free(where);
    return status;
}

static int write_all(const struct work_precision *report, const struct options *options)
{
    int status = CLI_OK;
    if (options->json)
        status = write_take(options->json, work_precision_print_json(report));
    if (status == CLI_OK && options->out)
        status = write_in(options->out, "work-precision.json", work_precision_print_json(report));
    if (status == CLI_OK && options->out)
        status = write_in(options->out, "work-precision.csv", work_precision_print_csv(report));
    if (status == CLI_OK && options->out)
        status = write_in(options->out, "work-precision.svg", work_precision_print_svg(report));
    return status;
}
