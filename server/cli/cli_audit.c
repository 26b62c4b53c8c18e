/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_audit.c - bcd audit: who did what on a server, newest first; see cli.h. */
#include "cli_server.h"
#include "cli_table.h"
#include "store_audit.h"

#include <stdlib.h>
#include <string.h>

enum { PAGE_MAX = 1000, ROWS_DEFAULT = 30, ROWS_MAX = 1000000000 };

static const struct cli_column columns[] = {
    {"TIME", "time", CELL_TIME, 18},     {"OWNER", "owner", CELL_TEXT, 14},
    {"ACTION", "action", CELL_TEXT, 15}, {"OBJECT", "object", CELL_TEXT, 19},
    {"DETAIL", "detail", CELL_TEXT, 0},  {0},
};

/* malloc'ed; NULL = out of memory. */
static char *make_path(const struct cli_line *line, int64_t rows, const char *cursor)
{
    static const char *const passed[] = {"owner", "action", "object"};
    struct text path = {0};
    char limit[24];
    text_add(&path, "/v1/audit");
    for (size_t i = 0; i < sizeof passed / sizeof *passed; i++)
        if (cli_given(line, passed[i]))
            client_add_query(&path, passed[i], cli_value(line, passed[i]));
    snprintf(limit, sizeof limit, "%lld", (long long)(rows < PAGE_MAX ? rows : PAGE_MAX));
    client_add_query(&path, "limit", limit);
    if (cursor)
        client_add_query(&path, "cursor", cursor);
    return text_take(&path);
}

/* A line of JSON for each with --json. */
static int print_page(const struct cli_line *line, const struct answer *entries)
{
    struct text text = {0};
    const char *key;
    for (size_t i = 0; i < answer_json_count(entries); i++) {
        const struct answer *entry = answer_json_item(entries, i, &key);
        if (!cli_given(line, "json")) {
            cli_table_row(columns, entry);
            continue;
        }
        answer_json_add(&text, entry);
        text_add(&text, "\n");
    }
    return cli_given(line, "json") && text.size > 0 ? cli_print_take(text_take(&text)) : CLI_OK;
}

static int print_pages(const struct cli_line *line, struct client *client, int64_t left)
{
    char *cursor = NULL;
    int status = CLI_OK;
    bool more = true;
    if (!cli_given(line, "json"))
        cli_table_heads(columns);
    while (more && status == CLI_OK && left > 0) {
        struct answer *page = NULL;
        char *path = make_path(line, left, cursor);
        const struct client_request request = {.method = "GET", .path = path};
        status = path ? cli_server_read(line, client, NULL, &request, &page) : cli_print_take(NULL);
        const struct answer *entries = answer_json_at(page, "entries");
        if (status == CLI_OK)
            status = print_page(line, entries);
        left -= (int64_t)answer_json_count(entries);
        const char *next = answer_json_text(page, "next");
        free(cursor);
        cursor = next ? strdup(next) : NULL;
        more = cursor && answer_json_count(entries) > 0;
        answer_json_free(page);
        free(path);
    }
    if (status == CLI_OK && more && !cli_given(line, "json") && !cli_given(line, "limit"))
        fprintf(stderr, "there are more: --limit N or --all shows them\n");
    free(cursor);
    return status;
}

static int audit(const struct cli_line *line)
{
    const char *limit = cli_value(line, "limit");
    struct client *client = NULL;
    int64_t left = ROWS_DEFAULT;
    if (limit && !cli_parse_integer(limit, 1, ROWS_MAX, &left))
        return cli_wrong(line->command, "--limit is a whole number from 1, not \"%s\"", limit);
    if (cli_given(line, "all"))
        left = INT64_MAX;
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = print_pages(line, client, left);
    client_free(client);
    return status;
}

static const struct cli_option options[] = {
    {.name = "owner", .value = "OWNER", .doc = "only what this owner did"},
    {.name = "action",
     .value = "ACTION",
     .doc = "only this: job.cancel, token.create, ...",
     .choices = STORE_AUDIT_ACTIONS},
    {.name = "object", .value = "ID", .doc = "only what was done to this job, sweep or token"},
    {.name = "limit", .value = "N", .doc = "at most so many (default: 30)", .either = 1},
    {.name = "all", .doc = "all there are", .either = 1},
    {0},
};

const struct cli_command cli_audit_command = {
    .name = "audit",
    .operands = "",
    .doc = "tells who did what on a server, newest first",
    .text = "For its administrators. With --json a line of JSON for each.",
    .options = options,
    .server = true,
    .function = audit,
};
