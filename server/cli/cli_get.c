/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_get.c - bcd get and export: records and results of jobs and sweeps; see cli.h. */
#include "cli_server.h"
#include "cli_words.h"
#include "download.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LINES_MAX = 100, LIST_WIDTH = 90, CSV_COLUMNS_MAX = 64 };

static int print_record(const struct cli_line *line, struct client *client, const char *path);
static int print_table(const struct cli_line *line, struct client *client, const char *path);
static const char *form_of(const struct cli_line *line, const char *const *forms,
                           const char *otherwise);

/* Letters, digits and _: nothing that could change the path. */
static bool observable_sound(const struct cli_line *line, const char *name)
{
    if (*name && name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789_")] == '\0')
        return true;
    cli_wrong(line->command, "\"%s\" is no observable; they are like msd, density", name);
    return false;
}

static int get(const struct cli_line *line)
{
    static const char *const forms[] = {"csv", "svg", "ndjson", "npz", "json", NULL};
    const char *id = line->operand[0], *file = cli_value(line, "output");
    const char *observable = line->operands > 1 ? line->operand[1] : NULL;
    const char *form = form_of(line, forms, file ? "csv" : "");
    struct client *client = NULL;
    struct text rest = {0};
    if (observable && !observable_sound(line, observable))
        return CLI_USAGE;
    if (!observable && *form && strcmp(form, "json") != 0 && !file)
        return cli_wrong(line->command, "--%s needs an observable", form);
    if (observable)
        text_add(&rest, "/results/%s%s%s", observable,
                 strcmp(form, "json") == 0 ? ""
                 : *form                   ? "."
                                           : ".csv",
                 strcmp(form, "json") == 0 ? "" : form);
    char *behind = text_take(&rest);
    char *path = behind ? cli_server_path(line, id, behind) : NULL;
    int status = path ? cli_server_open(line, &client) : CLI_USAGE;
    if (status == CLI_OK && !observable && !file && !cli_given(line, "json"))
        status = print_record(line, client, path);
    else if (status == CLI_OK && observable && !*form)
        status = print_table(line, client, path);
    else if (status == CLI_OK)
        status = download(line, client, path, observable ? observable : id, file);
    client_free(client);
    free(behind);
    free(path);
    return status;
}

static int export(const struct cli_line *line)
{
    static const char *const forms[] = {"csv", "ndjson", "npz", "json", NULL};
    const char *file = cli_value(line, "output"), *form = form_of(line, forms, "csv");
    bool json = strcmp(form, "json") == 0;
    struct client *client = NULL;
    struct text rest = {0};
    if (!observable_sound(line, line->operand[1]))
        return CLI_USAGE;
    if (!file && strcmp(form, "npz") == 0 && isatty(STDOUT_FILENO))
        return cli_wrong(line->command, "npz is not for a terminal: -o FILE");
    text_add(&rest, "/results/%s%s%s", line->operand[1], json ? "" : ".", json ? "" : form);
    char *behind = text_take(&rest);
    char *path = behind ? cli_server_path(line, line->operand[0], behind) : NULL;
    int status = path ? cli_server_open(line, &client) : CLI_USAGE;
    if (status == CLI_OK)
        status = download(line, client, path, line->operand[0], file);
    client_free(client);
    free(behind);
    free(path);
    return status;
}

/* As asked for, or as the file's name ends. */
static const char *form_of(const struct cli_line *line, const char *const *forms,
                           const char *otherwise)
{
    const char *file = cli_value(line, "output"), *dot = file ? strrchr(file, '.') : NULL;
    for (size_t i = 0; forms[i]; i++)
        if (cli_given(line, forms[i]))
            return forms[i];
    for (size_t i = 0; dot && forms[i]; i++)
        if (strcmp(dot + 1, forms[i]) == 0)
            return forms[i];
    return otherwise;
}

/* -------------------------------------------------------------------- records */

struct lines {
    size_t count;
};

/* A long list keeps its beginning, in place. */
static void cut_list(char *words, size_t count)
{
    char end[48];
    int size = snprintf(end, sizeof end, "... (%zu values)", count);
    if (strlen(words) <= LIST_WIDTH)
        return;
    for (size_t i = LIST_WIDTH - (size_t)size; i > 0; i--)
        if (words[i] == ',') {
            memcpy(words + i + 1, end, (size_t)size + 1);
            return;
        }
}

static void print_line(void *context, const char *path, const struct answer *value)
{
    struct lines *lines = context;
    double number = answer_json_number(value, "", NAN);
    struct text text = {0};
    if (strncmp(path, "links.", 6) == 0 || lines->count++ >= LINES_MAX)
        return;
    if (isnan(number))
        answer_json_add(&text, value);
    else
        text_add_number(&text, number);
    int64_t time = cli_parse_time(answer_json_text(value, ""));
    if (time > 0) {
        text_add(&text, " (");
        cli_add_duration(&text, (double)(cli_now_ms() - time) / 1000, true);
        text_add(&text, " ago)");
    }
    char *words = text_take(&text);
    if (words && answer_json_count(value) > 0)
        cut_list(words, answer_json_count(value));
    cli_put_clean(stdout, path);
    for (size_t width = strlen(path); width < 30; width++)
        putchar(' ');
    putchar(' ');
    cli_put_clean(stdout, words ? words : "");
    putchar('\n');
    free(words);
}

/* A line for each thing that it says. */
static int print_record(const struct cli_line *line, struct client *client, const char *path)
{
    const struct client_request request = {.method = "GET", .path = path};
    struct answer *record = NULL;
    struct lines lines = {0};
    int status = cli_server_read(line, client, line->operand[0], &request, &record);
    if (status == CLI_OK)
        answer_json_leaves(record, &lines, print_line);
    if (lines.count > LINES_MAX)
        printf("and %zu more; --json shows all\n", lines.count - LINES_MAX);
    answer_json_free(record);
    return status;
}

/* --------------------------------------------------------------------- tables */

/* The next field of CSV, malloc'ed, without its quotes; *rest moves behind it and its comma. */
static char *take_field(const char **rest)
{
    const char *c = *rest;
    struct text field = {0};
    bool quoted = *c == '"';
    for (c += quoted; *c && (quoted || !strchr(",\r\n", *c)); c++) {
        if (quoted && *c == '"' && *++c != '"')
            quoted = false;
        if (!quoted && strchr(",\r\n", *c))
            break;
        text_add_bytes(&field, c, *c != '\0');
    }
    *rest = c + (*c == ',');
    return text_take(&field);
}

static char *show_field(const char **rest)
{
    char *field = take_field(rest), *end = NULL;
    struct text text = {0};
    if (!field)
        return NULL;
    double number = strtod(field, &end);
    if (end == field || *end)
        return field;
    text_add(&text, "%.6g", number);
    free(field);
    return text_take(&text);
}

/* Right-aligned columns, twice over the text: widths, then lines. */
static void print_columns(const char *csv)
{
    size_t width[CSV_COLUMNS_MAX] = {0};
    for (int pass = 0; pass < 2; pass++) {
        for (const char *next = csv; *next;) {
            for (size_t c = 0; *next && *next != '\n' && *next != '\r'; c++) {
                char *field = show_field(&next);
                size_t taken = field ? cli_text_width(field) : 0, k = c % CSV_COLUMNS_MAX;
                if (pass == 0) {
                    width[k] = taken > width[k] ? taken : width[k];
                } else {
                    printf("%*s", (int)(width[k] - taken) + (c ? 2 : 0), "");
                    cli_put_clean(stdout, field ? field : "");
                }
                free(field);
            }
            next += strspn(next, "\r\n");
            if (pass == 1)
                putchar('\n');
        }
    }
}

static int print_table(const struct cli_line *line, struct client *client, const char *path)
{
    const struct client_request request = {.method = "GET", .path = path};
    struct client_answer answer = {0};
    int status = cli_server_ask(line, client, line->operand[1], &request, &answer);
    if (status == CLI_OK)
        print_columns(answer.body);
    client_answer_fini(&answer);
    return status;
}

/* ----------------------------------------------------------------------- rows */

static const struct cli_option get_options[] = {
    {.name = "csv", .doc = "as CSV, every digit", .either = 1},
    {.name = "svg", .doc = "as a picture", .either = 1},
    {.name = "ndjson", .doc = "a line of JSON for each job of a sweep", .either = 1},
    {.name = "npz", .doc = "arrays for numpy.load, of a sweep", .either = 1},
    {.name = "output",
     .letter = 'o',
     .value = "FILE",
     .doc = "writes there; its ending tells the form: .csv, .svg, .json"},
    {0},
};

const struct cli_command cli_get_command = {
    .name = "get",
    .operands = "ID [OBSERVABLE]",
    .least = 1,
    .most = 2,
    .doc = "shows a job, a sweep, or one of their results",
    .text = "Without an observable what is known of it; with one its table. bcd get ID msd.",
    .options = get_options,
    .server = true,
    .function = get,
};

static const struct cli_option export_options[] = {
    {.name = "csv", .doc = "one table in long form (the default)", .either = 1},
    {.name = "ndjson", .doc = "a line of JSON for each job", .either = 1},
    {.name = "npz", .doc = "arrays for numpy.load", .either = 1},
    {.name = "output",
     .letter = 'o',
     .value = "FILE",
     .doc = "writes there instead of stdout; its ending tells the form: .csv, .ndjson, .npz, "
            ".json. The file is there whole or not at all"},
    {0},
};

const struct cli_command cli_export_command = {
    .name = "export",
    .operands = "SWEEP OBSERVABLE",
    .least = 2,
    .most = 2,
    .doc = "fetches an observable of all jobs of a sweep",
    .text = "It is written as it comes, whatever its length. A connection that breaks off is an\n"
            "error, and leaves no file behind.",
    .options = export_options,
    .server = true,
    .function = export,
};
