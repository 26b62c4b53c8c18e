/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_submit.c - bcd submit, cancel and estimate: jobs to a server; see cli.h. */
#include "cli_server.h"
#include "cli_submit.h"
#include "cli_watch.h"
#include "cli_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int submit_all(const struct cli_line *line, struct client *client, char **ids);
static int submit_one(const struct cli_line *line, struct client *client, const char *path,
                      char **id);
static void remark(const struct answer *record);

int cli_ticket_read(const struct cli_line *line, struct cli_ticket *ticket)
{
    const char *priority = cli_value(line, "priority"), *tag;
    *ticket = (struct cli_ticket){.request = {.label = cli_value(line, "label")}};
    for (size_t i = 0; (tag = cli_value_at(line, "tag", i)); i++)
        ticket->tags[ticket->request.tags_count++] = tag;
    ticket->request.tags = ticket->tags;
    if (!priority)
        return CLI_OK;
    ticket->request.priority = &ticket->priority;
    if (cli_parse_integer(priority, INT32_MIN, INT32_MAX, &ticket->priority))
        return CLI_OK;
    return cli_wrong(line->command, "--priority is a whole number, not \"%s\"", priority);
}

static int submit(const struct cli_line *line)
{
    struct client *client = NULL;
    char **ids = calloc(line->operands, sizeof *ids);
    if (!ids)
        return cli_print_take(NULL);
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = submit_all(line, client, ids);
    client_free(client);
    for (size_t i = 0; i < line->operands; i++)
        free(ids[i]);
    free(ids);
    return status;
}

/* All files are tried, so that one call tells of every fault; but not when nobody listens. */
static int submit_all(const struct cli_line *line, struct client *client, char **ids)
{
    int worst = CLI_OK;
    for (size_t i = 0; i < line->operands; i++) {
        int status = submit_one(line, client, line->operand[i], &ids[i]);
        if (status > CLI_FAILED)
            return status;
        worst = status > worst ? status : worst;
    }
    if (worst == CLI_OK && cli_given(line, "wait"))
        return cli_watch(line, client, ids, line->operands);
    return worst;
}

static int submit_one(const struct cli_line *line, struct client *client, const char *path,
                      char **id)
{
    struct cli_ticket ticket;
    struct client_answer raw = {0};
    char key[CLIENT_KEY_SIZE];
    size_t size = 0;
    int status = cli_ticket_read(line, &ticket);
    if (status != CLI_OK)
        return status;
    char *file = cli_read_file(path, &size);
    if (!file)
        return CLI_FAILED;
    char *body = request_json_submit(file, size, &ticket.request);
    free(file);
    if (!body)
        return cli_print_take(NULL);
    client_key(key);
    const struct client_request request = {.method = "POST",
                                           .path = cli_given(line, "force") ? "/v1/jobs?force=true"
                                                                            : "/v1/jobs",
                                           .body = body,
                                           .body_size = strlen(body),
                                           .key = key};
    status = cli_server_ask(line, client, path, &request, &raw);
    free(body);
    if (status != CLI_OK)
        return status;
    struct answer *record = answer_json_load(raw.body, raw.size);
    const char *given = answer_json_text(record, "id");
    *id = given ? strdup(given) : NULL;
    if (!*id) {
        fprintf(stderr, "bcd submit: %s does not answer as bcdd does\n", client_url(client));
        status = CLI_UNREACHABLE;
    } else if (cli_given(line, "json") && !cli_given(line, "wait")) {
        status = cli_print_bytes(raw.body, raw.size);
    } else if (!cli_given(line, "json")) {
        printf("%s\n", *id);
        fflush(stdout);
        if (isatty(STDERR_FILENO) && !cli_given(line, "quiet"))
            remark(record);
    }
    answer_json_free(record);
    client_answer_fini(&raw);
    return status;
}

/* What became of it, in a line for people. */
static void remark(const struct answer *record)
{
    const char *state = answer_json_text(record, "state");
    const char *method = answer_json_text(record, "derived.method");
    double steps = answer_json_number(record, "derived.steps", -1);
    struct text text = {0};
    if (answer_json_true(record, "deduplicated"))
        text_add(&text, "the same job stands already, %s; --force runs it anew",
                 state ? state : "");
    else
        text_add(&text, "accepted");
    if (method && steps >= 0) {
        text_add(&text, ": %s, ", method);
        cli_add_number(&text, steps);
        text_add(&text, " steps");
    }
    char *words = text_take(&text);
    if (words)
        cli_put_clean(stderr, words);
    fputc('\n', stderr);
    free(words);
}

static const struct cli_option submit_options[] = {
    {.name = "wait", .letter = 'w', .doc = "follows them to their end; the exit status tells how"},
    {.name = "tag", .value = "T", .doc = "a word to find them by", .many = true},
    {.name = "label", .value = "TEXT", .doc = "what people call them"},
    {.name = "priority",
     .value = "N",
     .doc = "among your own jobs: -100 to 100, larger is earlier (default: 0)"},
    {.name = "force", .doc = "runs the same job anew, although its results stand"},
    {.name = "quiet", .letter = 'q', .doc = "ids only"},
    {0},
};

const struct cli_command cli_submit_command = {
    .name = "submit",
    .operands = "JOB.json...",
    .least = 1,
    .most = SIZE_MAX,
    .doc = "sends jobs to a server and prints their ids",
    .text = "- instead of a file reads the job from stdin. A job that stands already is not run\n"
            "again: its id is printed. A connection that is lost is tried again; no job is ever\n"
            "submitted twice.",
    .options = submit_options,
    .server = true,
    .function = submit,
};

/* -------------------------------------------------------------------- cancel */

static int cancel(const struct cli_line *line)
{
    struct client *client = NULL;
    int worst = cli_server_open(line, &client);
    for (size_t i = 0; client && i < line->operands && worst <= CLI_FAILED; i++) {
        struct client_answer answer = {0};
        char *path = cli_server_path(line, line->operand[i], "");
        const struct client_request request = {.method = "DELETE", .path = path};
        int status =
            path ? cli_server_ask(line, client, line->operand[i], &request, &answer) : CLI_USAGE;
        if (status == CLI_OK && cli_given(line, "json"))
            status = cli_print_bytes(answer.body, answer.size);
        else if (status == CLI_OK)
            printf("%s cancelled\n", line->operand[i]);
        client_answer_fini(&answer);
        free(path);
        worst = status > worst ? status : worst;
    }
    client_free(client);
    return worst;
}

const struct cli_command cli_cancel_command = {
    .name = "cancel",
    .operands = "ID...",
    .least = 1,
    .most = SIZE_MAX,
    .doc = "cancels jobs and sweeps that have not ended",
    .text = "Of a sweep only jobs that nobody else wants.",
    .server = true,
    .function = cancel,
};

/* ------------------------------------------------------------------ estimate */

static void print_quantity(void *context, const char *path, const struct answer *value);

static int estimate(const struct cli_line *line)
{
    struct client *client = NULL;
    struct client_answer raw = {0};
    size_t size = 0;
    char *file = cli_read_file(line->operand[0], &size);
    if (!file)
        return CLI_FAILED;
    int status = cli_server_open(line, &client);
    const struct client_request request = {
        .method = "POST", .path = "/v1/estimate", .body = file, .body_size = size};
    if (status == CLI_OK)
        status = cli_server_ask(line, client, line->operand[0], &request, &raw);
    if (status == CLI_OK && cli_given(line, "json")) {
        status = cli_print_bytes(raw.body, raw.size);
    } else if (status == CLI_OK) {
        struct answer *tree = answer_json_load(raw.body, raw.size);
        answer_json_leaves(tree, NULL, print_quantity);
        answer_json_free(tree);
    }
    client_answer_fini(&raw);
    client_free(client);
    free(file);
    return status;
}

static bool ends_with(const char *text, const char *end)
{
    size_t length = strlen(text), size = strlen(end);
    return length >= size && strcmp(text + length - size, end) == 0;
}

/* Its unit is in the name: "memory_bytes", "core_seconds", "finished_at". */
static void print_quantity(void *context, const char *path, const struct answer *value)
{
    double number = answer_json_number(value, "", NAN);
    int64_t time = cli_parse_time(answer_json_text(value, ""));
    struct text text = {0};
    (void)context;
    if (isnan(number))
        answer_json_add(&text, value);
    else if (ends_with(path, "_bytes"))
        cli_add_bytes(&text, number);
    else if (ends_with(path, "_seconds"))
        cli_add_duration(&text, number, true);
    else
        cli_add_number(&text, number);
    if (time > cli_now_ms()) {
        text_add(&text, " (in ");
        cli_add_duration(&text, (double)(time - cli_now_ms()) / 1000, true);
        text_add(&text, ")");
    }
    char *words = text_take(&text), *name = strdup(path);
    for (char *c = name; c && *c; c++)
        *c = *c == '_' || *c == '.' ? ' ' : *c;
    printf("%-24s ", name ? name : "");
    cli_put_clean(stdout, words ? words : "");
    putchar('\n');
    free(words);
    free(name);
}

const struct cli_command cli_estimate_command = {
    .name = "estimate",
    .operands = "JOB.json",
    .least = 1,
    .most = 1,
    .doc = "asks a server what a job would cost there",
    .server = true,
    .function = estimate,
};
