/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_list.c - bcd list: jobs or sweeps as a table or as lines of JSON, page by page; see cli.h. */
#include "cli_server.h"
#include "list_table.h"

#include <stdlib.h>
#include <string.h>

enum { PAGE_MAX = 1000, ROWS_DEFAULT = 30, ROWS_MAX = 1000000000 };

struct listing {
    const struct cli_line *line;
    struct client *client;
    const char *what; /* "jobs" or "sweeps" */
    int64_t left;     /* rows still wanted */
    struct list_table table;
};

static char *first_path(const struct listing *listing, int64_t rows);
static int print_pages(struct listing *listing);

static int list(const struct cli_line *line)
{
    const char *limit = cli_value(line, "limit");
    struct listing listing = {.line = line, .left = ROWS_DEFAULT};
    if (limit && !cli_parse_integer(limit, 1, ROWS_MAX, &listing.left))
        return cli_wrong(line->command, "--limit is a whole number from 1, not \"%s\"", limit);
    if (cli_given(line, "all"))
        listing.left = INT64_MAX;
    for (size_t i = 0; i < line->operands; i++)
        if (!strpbrk(line->operand[i], "=<>") || strchr("=<>", line->operand[i][0]))
            return cli_wrong(line->command,
                             "a filter is like diameter=0.5, diameter=0.3..0.5 or "
                             "\"diameter>=0.3\"; not \"%s\"",
                             line->operand[i]);
    listing.what = cli_given(line, "sweeps") ? "sweeps" : "jobs";
    list_table_init(&listing.table, cli_value(line, "columns"), listing.what);
    int status = cli_server_open(line, &listing.client);
    if (status == CLI_OK)
        status = print_pages(&listing);
    list_table_fini(&listing.table);
    client_free(listing.client);
    return status;
}

/* "diameter>=0.3" is the parameter "diameter>" with the value "0.3". */
static void add_filter(struct text *path, const char *filter)
{
    size_t size = strcspn(filter, "=");
    if (filter[size] == '\0') /* "diameter>0.3": no equals sign */
        size = strcspn(filter, "<>") + 1;
    char *name = strndup(filter, size);
    if (name)
        client_add_query(path, name, filter + size + (filter[size] == '='));
    else
        path->failed = true;
    free(name);
}

/* Of the first page; those that follow add a cursor. */
static char *first_path(const struct listing *listing, int64_t rows)
{
    static const char *const passed[] = {"state", "sort", "tag", "owner", "sweep", "label"};
    const struct cli_line *line = listing->line;
    struct text path = {0};
    char limit[24];
    text_add(&path, "/v1/%s", listing->what);
    for (size_t i = 0; i < line->operands; i++)
        add_filter(&path, line->operand[i]);
    for (size_t i = 0; i < sizeof passed / sizeof *passed; i++)
        if (cli_given(line, passed[i]))
            client_add_query(&path, passed[i], cli_value(line, passed[i]));
    snprintf(limit, sizeof limit, "%lld", (long long)rows);
    client_add_query(&path, "limit", limit);
    return text_take(&path);
}

static int print_lines(const struct answer *rows, size_t count)
{
    struct text text = {0};
    const char *key;
    for (size_t i = 0; i < count; i++) {
        answer_json_add(&text, answer_json_item(rows, i, &key));
        text_add(&text, "\n");
    }
    return cli_print_take(text_take(&text));
}

static int print_ids(const struct answer *rows, size_t count)
{
    struct text text = {0};
    const char *key;
    for (size_t i = 0; i < count; i++) {
        const char *id = answer_json_text(answer_json_item(rows, i, &key), "id");
        text_add(&text, "%s\n", id ? id : "");
    }
    return cli_print_take(text_take(&text));
}

static int print_page(struct listing *listing, const struct answer *page, bool first)
{
    const struct answer *rows = answer_json_at(page, listing->what);
    size_t count = answer_json_count(rows);
    if ((int64_t)count > listing->left)
        count = (size_t)listing->left;
    listing->left -= (int64_t)count;
    if (cli_given(listing->line, "json"))
        return print_lines(rows, count);
    if (cli_given(listing->line, "ids"))
        return print_ids(rows, count);
    if (first)
        list_table_choose(&listing->table, rows, count);
    return list_table_print(&listing->table, rows, count, first);
}

static int print_pages(struct listing *listing)
{
    char *cursor = NULL;
    int status = CLI_OK;
    bool more = true;
    for (bool first = true; more && status == CLI_OK && listing->left > 0; first = false) {
        struct answer *page = NULL;
        struct text path = {0};
        char *begin = first_path(listing, listing->left < PAGE_MAX ? listing->left : PAGE_MAX);
        text_add(&path, "%s", begin ? begin : "");
        path.failed |= !begin;
        free(begin);
        if (cursor)
            client_add_query(&path, "cursor", cursor);
        char *whole = text_take(&path);
        const struct client_request request = {.method = "GET", .path = whole};
        status = whole ? cli_server_read(listing->line, listing->client, NULL, &request, &page)
                       : cli_print_take(NULL);
        if (status == CLI_OK)
            status = print_page(listing, page, first);
        const char *next = answer_json_text(page, "next");
        free(cursor);
        cursor = next ? strdup(next) : NULL;
        more = cursor && answer_json_count(answer_json_at(page, listing->what)) > 0;
        answer_json_free(page);
        free(whole);
    }
    if (status == CLI_OK && more && !cli_given(listing->line, "json") &&
        !cli_given(listing->line, "limit"))
        fprintf(stderr, "there are more: --limit N or --all shows them\n");
    free(cursor);
    return status;
}

static const struct cli_option options[] = {
    {.name = "state",
     .value = "STATE",
     .doc = "only those in this state",
     .choices = "queued running done failed cancelled"},
    {.name = "owner", .value = "OWNER", .doc = "only this owner's"},
    {.name = "tag", .value = "T", .doc = "only those with this tag"},
    {.name = "label", .value = "TEXT", .doc = "only those with this label"},
    {.name = "sweep", .value = "ID", .doc = "only the jobs of this sweep"},
    {.name = "sweeps", .doc = "lists sweeps instead of jobs"},
    {.name = "sort",
     .value = "PATH",
     .doc = "by this parameter or result, upwards; -PATH downwards (default: newest first)"},
    {.name = "columns",
     .value = "PATHS",
     .doc = "these columns instead of the parameters that differ, with commas between: "
            "diameter,derived.time_step,label"},
    {.name = "ids", .doc = "ids only, one a line: bcd cancel $(bcd list --ids --state queued)"},
    {.name = "limit", .value = "N", .doc = "at most so many (default: 30)", .either = 1},
    {.name = "all", .doc = "all there are", .either = 1},
    {0},
};

const struct cli_command cli_list_command = {
    .name = "list",
    .operands = "[NAME=VALUE]...",
    .most = SIZE_MAX,
    .doc = "lists jobs or sweeps",
    .text = "Filters go by parameters of the job and by results: diameter=0.5,\n"
            "potential.amplitude=2..6, \"diameter>=0.3\", results.energy.energy=..1. Shown are\n"
            "state, progress, age, and the parameters in which the jobs of the list differ. With\n"
            "--json a line of JSON for each.",
    .options = options,
    .server = true,
    .function = list,
};
