/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_token.c - bcd token and whoami: who may ask a server what; see cli.h. */
#include "cli_server.h"
#include "cli_table.h"
#include "cli_words.h"
#include "request_json.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { DAYS_MAX = 3660 };

static int print_token(const struct cli_line *line, const struct answer *answer);
static int write_token(const char *file, const char *token);

/* "90s", "12h", "30d"; seconds without a unit. */
static bool parse_span(const char *text, int64_t *seconds)
{
    static const struct {
        const char *unit;
        int64_t seconds;
    } units[] = {{"", 1}, {"s", 1}, {"min", 60}, {"h", 3600}, {"d", 86400}};
    char *end;
    errno = 0;
    long long count = strtoll(text, &end, 10);
    for (size_t i = 0; end != text && errno == 0 && i < sizeof units / sizeof *units; i++)
        if (strcmp(end, units[i].unit) == 0 && count >= 1 &&
            count <= DAYS_MAX * INT64_C(86400) / units[i].seconds) {
            *seconds = count * units[i].seconds;
            return true;
        }
    return false;
}

static int create(const struct cli_line *line)
{
    const char *expires = cli_value(line, "expires");
    struct client *client = NULL;
    struct answer *answer = NULL;
    const char *role = cli_value(line, "role");
    int64_t seconds;
    if (expires && !parse_span(expires, &seconds))
        return cli_wrong(line->command, "--expires is like 12h or 30d, at most %d days; not \"%s\"",
                         DAYS_MAX, expires);
    const struct request_member members[] = {
        {.name = "owner", .text = line->operand[0]},
        {.name = "role", .text = role ? role : "submitter"},
        {.name = "name", .text = cli_value(line, "name")},
        {.name = "expires_in", .number = expires ? &seconds : NULL}};
    char *body = request_json_members(members, sizeof members / sizeof *members);
    if (!body)
        return cli_print_take(NULL);
    int status = cli_server_open(line, &client);
    const struct client_request request = {.method = "POST",
                                           .path = "/v1/tokens",
                                           .body = body,
                                           .body_size = strlen(body),
                                           .once = true};
    if (status == CLI_OK)
        status = cli_server_read(line, client, line->operand[0], &request, &answer);
    if (status == CLI_OK)
        status = print_token(line, answer);
    answer_json_free(answer);
    client_free(client);
    free(body);
    return status;
}

/* The one time that it is shown: alone on stdout, or into a file that nobody else can read. */
static int print_token(const struct cli_line *line, const struct answer *answer)
{
    const char *token = answer_json_text(answer, "token"), *id = answer_json_text(answer, "id");
    const char *file = cli_value(line, "output");
    struct text text = {0};
    if (!token) {
        fprintf(stderr, "bcd %s: the server gave no token\n", line->command->name);
        return CLI_UNREACHABLE;
    }
    if (file)
        return write_token(file, token);
    if (cli_given(line, "json"))
        answer_json_add(&text, answer);
    else
        text_add(&text, "%s", token);
    text_add(&text, "\n");
    if (isatty(STDERR_FILENO) && !cli_given(line, "json"))
        fprintf(stderr, "token %s; it is not shown again:\n", id ? id : "");
    return cli_print_take(text_take(&text));
}

static int write_token(const char *file, const char *token)
{
    int fd = open(file, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    FILE *out = fd >= 0 ? fdopen(fd, "w") : NULL;
    bool good = out && fprintf(out, "%s\n", token) > 0;
    if (out)
        good = fclose(out) == 0 && good;
    if (good)
        return CLI_OK;
    /* It exists on the server, and nowhere else: better on the terminal than lost. */
    fprintf(stderr, "bcd token create: %s cannot be written: %s; the token is printed instead\n",
            file, strerror(errno));
    printf("%s\n", token);
    return CLI_FAILED;
}

static int list(const struct cli_line *line)
{
    static const struct cli_column columns[] = {{"ID", "id", CELL_TEXT, 19},
                                                {"OWNER", "owner", CELL_TEXT, 14},
                                                {"ROLE", "role", CELL_TEXT, 11},
                                                {"CREATED", "created_at", CELL_TIME, 18},
                                                {"EXPIRES", "expires_at", CELL_TIME, 18},
                                                {"REVOKED", "revoked_at", CELL_TIME, 18},
                                                {"NAME", "name", CELL_TEXT, 0},
                                                {0}};
    const struct client_request request = {.method = "GET", .path = "/v1/tokens"};
    struct client *client = NULL;
    struct client_answer raw = {0};
    const char *key;
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = cli_server_ask(line, client, NULL, &request, &raw);
    client_free(client);
    if (status != CLI_OK)
        return status;
    struct answer *answer = answer_json_load(raw.body, raw.size);
    const struct answer *tokens = answer_json_at(answer, "tokens");
    if (cli_given(line, "json"))
        status = cli_print_bytes(raw.body, raw.size);
    else
        cli_table_heads(columns);
    for (size_t i = 0; !cli_given(line, "json") && i < answer_json_count(tokens); i++)
        cli_table_row(columns, answer_json_item(tokens, i, &key));
    answer_json_free(answer);
    client_answer_fini(&raw);
    return status;
}

static int revoke_all(const struct cli_line *line)
{
    struct client *client = NULL;
    int worst = cli_server_open(line, &client);
    for (size_t i = 0; client && i < line->operands && worst <= CLI_FAILED; i++) {
        struct client_answer answer = {0};
        struct text text = {0};
        const char *id = line->operand[i];
        bool sound = *id && id[strspn(id, "abcdefghijklmnopqrstuvwxyz0123456789-")] == '\0';
        text_add(&text, "/v1/tokens/%s", id);
        char *path = text_take(&text);
        const struct client_request request = {.method = "DELETE", .path = path};
        int status = !sound ? cli_wrong(line->command, "\"%s\" is no id of a token", id)
                     : path ? cli_server_ask(line, client, id, &request, &answer)
                            : cli_print_take(NULL);
        if (status == CLI_OK && cli_given(line, "json"))
            status = cli_print_bytes(answer.body, answer.size);
        else if (status == CLI_OK)
            printf("%s revoked\n", id);
        client_answer_fini(&answer);
        free(path);
        worst = status > worst ? status : worst;
    }
    client_free(client);
    return worst;
}

/* What may be used, and what has been. */
static void print_quotas(const struct answer *quotas)
{
    const char *key;
    for (size_t i = 0; i < answer_json_count(quotas); i++) {
        const struct answer *quota = answer_json_item(quotas, i, &key);
        double limit = answer_json_number(quota, "limit", INFINITY);
        struct text text = {0};
        for (const char *c = key; *c; c++)
            text_add_bytes(&text, *c == '_' ? " " : c, 1);
        text_add(&text, ": ");
        cli_add_number(&text, answer_json_number(quota, "used", 0));
        text_add(&text, " of ");
        if (isfinite(limit))
            cli_add_number(&text, limit);
        else
            text_add(&text, "any number");
        char *words = text_take(&text);
        cli_put_clean(stdout, words ? words : "");
        putchar('\n');
        free(words);
    }
}

static int whoami(const struct cli_line *line)
{
    const struct client_request request = {.method = "GET", .path = "/v1/me"};
    struct client *client = NULL;
    struct client_answer raw = {0};
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = cli_server_ask(line, client, NULL, &request, &raw);
    if (status == CLI_OK && cli_given(line, "json")) {
        status = cli_print_bytes(raw.body, raw.size);
    } else if (status == CLI_OK) {
        struct answer *me = answer_json_load(raw.body, raw.size);
        const char *owner = answer_json_text(me, "owner"), *role = answer_json_text(me, "role");
        printf("%s, %s, at %s\n", owner ? owner : "?", role ? role : "?", client_url(client));
        print_quotas(answer_json_at(me, "quotas"));
        answer_json_free(me);
    }
    client_answer_fini(&raw);
    client_free(client);
    return status;
}

/* ----------------------------------------------------------------------- rows */

static const struct cli_option create_options[] = {
    {.name = "role",
     .value = "ROLE",
     .doc = "what it may do: read; also submit; also cancel what is others'; everything "
            "(default: submitter)",
     .choices = "worker reader submitter operator admin"},
    {.name = "name", .value = "TEXT", .doc = "what it is for"},
    {.name = "expires", .value = "SPAN", .doc = "when it ends: 12h, 30d (default: never)"},
    {.name = "output",
     .letter = 'o',
     .value = "FILE",
     .doc = "writes it to a new file that its owner alone can read, for --token-file"},
    {0},
};

static const struct cli_command token_create = {
    .name = "token create",
    .operands = "OWNER",
    .least = 1,
    .most = 1,
    .doc = "makes a token for somebody and prints it, this once",
    .text = "From the first one on, which must be an administrator's, every request needs one.",
    .options = create_options,
    .server = true,
    .function = create,
};

static const struct cli_command token_list = {
    .name = "token list",
    .operands = "",
    .doc = "lists the tokens there are, but not what they are",
    .server = true,
    .function = list,
};

static const struct cli_command token_revoke = {
    .name = "token revoke",
    .operands = "ID...",
    .least = 1,
    .most = SIZE_MAX,
    .doc = "ends tokens",
    .server = true,
    .function = revoke_all,
};

static const struct cli_command *const tokens[] = {&token_create, &token_list, &token_revoke, NULL};

const struct cli_command cli_token_command = {
    .name = "token",
    .operands = "",
    .doc = "makes, lists and ends the tokens of a server",
    .text = "For its administrators. bcdd token does the same on the machine of the server, for\n"
            "the first one.",
    .parts = tokens,
};

const struct cli_command cli_whoami_command = {
    .name = "whoami",
    .operands = "",
    .doc = "tells who you are to a server",
    .server = true,
    .function = whoami,
};
