/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_owners.c - bcd owners and quota: who uses a server how much, and may; see cli.h. */
#include "cli_server.h"
#include "cli_table.h"
#include "identity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define QUOTA_MAX 1e15

static const struct cli_column columns[] = {
    {"OWNER", "owner", CELL_TEXT, 16},
    {"QUEUED", "quotas.queued_points.used", CELL_NUMBER, 9},
    {"OF", "quotas.queued_points.limit", CELL_NUMBER, 11},
    {"CORE S TODAY", "quotas.core_seconds_per_day.used", CELL_NUMBER, 14},
    {"OF", "quotas.core_seconds_per_day.limit", CELL_NUMBER, 11},
    {"STORED", "quotas.stored_bytes.used", CELL_BYTES, 10},
    {"OF", "quotas.stored_bytes.limit", CELL_BYTES, 0},
    {0},
};

/* Those of the command line, and what they are called in a body. */
static const struct {
    const char *option, *member;
    bool whole;
} quotas[] = {{"queued-points", "queued_points", true},
              {"core-seconds-per-day", "core_seconds_per_day", false},
              {"stored-bytes", "stored_bytes", true}};
enum { QUOTAS = sizeof quotas / sizeof *quotas };

/* All owners as the server tells them. */
static int read_owners(const struct cli_line *line, struct client *client, struct answer **answer)
{
    const struct client_request request = {.method = "GET", .path = "/v1/owners"};
    return cli_server_read(line, client, NULL, &request, answer);
}

static int print_json(const struct answer *answer)
{
    struct text text = {0};
    answer_json_add(&text, answer);
    text_add(&text, "\n");
    return cli_print_take(text_take(&text));
}

static int owners(const struct cli_line *line)
{
    struct client *client = NULL;
    struct answer *answer = NULL;
    const char *key;
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = read_owners(line, client, &answer);
    const struct answer *rows = answer_json_at(answer, "owners");
    bool table = status == CLI_OK && !cli_given(line, "json");
    if (table)
        cli_table_heads(columns);
    else if (status == CLI_OK)
        status = print_json(answer);
    for (size_t i = 0; table && i < answer_json_count(rows); i++)
        cli_table_row(columns, answer_json_item(rows, i, &key));
    answer_json_free(answer);
    client_free(client);
    return status;
}

/* A number, or "default". */
static bool sound(const char *value, bool whole)
{
    char *end;
    double number = strtod(value, &end);
    if (strcmp(value, "default") == 0)
        return true;
    return end != value && !*end && number >= 0 && number <= QUOTA_MAX &&
           value[strspn(value, "0123456789.eE+-")] == '\0' && (!whole || number == rint(number));
}

/* What PUT says is all there is to be said: what was given before and is not named now goes along.
 * before: this owner's record, NULL = there is none. malloc'ed. */
static char *make_body(const struct cli_line *line, const struct answer *before)
{
    struct text text = {0};
    text_add(&text, "{");
    for (size_t i = 0; i < QUOTAS; i++) {
        const char *value = cli_value(line, quotas[i].option);
        char path[64];
        snprintf(path, sizeof path, "quotas.%s.default", quotas[i].member);
        bool given = before && !answer_json_true(before, path);
        snprintf(path, sizeof path, "quotas.%s.limit", quotas[i].member);
        text_add(&text, "%s\"%s\":", i ? "," : "", quotas[i].member);
        if (value && strcmp(value, "default") != 0)
            text_add_number(&text, strtod(value, NULL));
        else if (!value && given)
            text_add_number(&text, answer_json_number(before, path, 0));
        else
            text_add(&text, "null");
    }
    text_add(&text, "}");
    return text_take(&text);
}

static int put(const struct cli_line *line, struct client *client, const struct answer *before,
               struct answer **answer)
{
    const char *owner = line->operand[0];
    struct text text = {0};
    text_add(&text, "/v1/owners/%s", owner);
    char *path = text_take(&text), *body = make_body(line, before);
    int status = CLI_FAILED;
    if (path && body) {
        const struct client_request request = {
            .method = "PUT", .path = path, .body = body, .body_size = strlen(body)};
        status = cli_server_read(line, client, owner, &request, answer);
    } else {
        status = cli_print_take(NULL);
    }
    free(path);
    free(body);
    return status;
}

static int quota(const struct cli_line *line)
{
    const char *owner = line->operand[0], *key;
    struct client *client = NULL;
    struct answer *all = NULL, *changed = NULL;
    const struct answer *found = NULL;
    bool changes = false;
    if (!owner_sound(owner))
        return cli_wrong(line->command, "an owner has 1 to %d of a-z 0-9 _ -; not \"%s\"",
                         OWNER_SIZE - 1, owner);
    for (size_t i = 0; i < QUOTAS; i++) {
        const char *value = cli_value(line, quotas[i].option);
        changes = changes || value;
        if (value && !sound(value, quotas[i].whole))
            return cli_wrong(line->command, "--%s is a %snumber up to %g, or default; not \"%s\"",
                             quotas[i].option, quotas[i].whole ? "whole " : "", QUOTA_MAX, value);
    }
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = read_owners(line, client, &all);
    const struct answer *rows = answer_json_at(all, "owners");
    for (size_t i = 0; !found && i < answer_json_count(rows); i++) {
        const struct answer *row = answer_json_item(rows, i, &key);
        const char *name = answer_json_text(row, "owner");
        found = name && strcmp(name, owner) == 0 ? row : NULL;
    }
    if (status == CLI_OK && changes)
        status = put(line, client, found, &changed);
    found = changed ? changed : found;
    if (status == CLI_OK && !found) {
        fprintf(stderr, "bcd quota: nobody knows %s yet, who has the server's quotas\n", owner);
        status = CLI_FAILED;
    } else if (status == CLI_OK && cli_given(line, "json")) {
        status = print_json(found);
    } else if (status == CLI_OK) {
        cli_table_heads(columns);
        cli_table_row(columns, found);
    }
    answer_json_free(all);
    answer_json_free(changed);
    client_free(client);
    return status;
}

/* ----------------------------------------------------------------------- rows */

const struct cli_command cli_owners_command = {
    .name = "owners",
    .operands = "",
    .doc = "lists who has jobs or quotas on a server, what they have and may have",
    .text = "For its administrators.",
    .server = true,
    .function = owners,
};

static const struct cli_option quota_options[] = {
    {.name = "queued-points",
     .value = "N",
     .doc = "jobs that may be queued at a time, points of sweeps too"},
    {.name = "core-seconds-per-day",
     .value = "S",
     .doc = "core seconds used today (UTC) and needed by all that waits"},
    {.name = "stored-bytes", .value = "B", .doc = "bytes on the server's disk: 1e10"},
    {0},
};

const struct cli_command cli_quota_command = {
    .name = "quota",
    .operands = "OWNER",
    .least = 1,
    .most = 1,
    .doc = "shows what an owner may have, or changes it",
    .text = "For administrators. What is not named stays as it is; \"default\" is what the server\n"
            "gives to everybody.",
    .options = quota_options,
    .server = true,
    .function = quota,
};
