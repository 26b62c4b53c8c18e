/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_sweep.c - bcd sweep: many jobs that differ in a few parameters; see cli.h. */
#include "cli_server.h"
#include "cli_submit.h"
#include "cli_watch.h"
#include "cli_words.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What is sent, and where. */
struct order {
    char *path, *body; /* malloc'ed; body may be NULL */
    bool keyed;        /* may be sent again under its key */
};

static int prepare(const struct cli_line *line, struct order *order);
static int send_order(const struct cli_line *line, const struct order *order);
static int answered(const struct cli_line *line, struct client *client,
                    const struct client_answer *raw);

static int sweep(const struct cli_line *line)
{
    struct order order = {0};
    int status = prepare(line, &order);
    if (status == CLI_OK)
        status = send_order(line, &order);
    free(order.path);
    free(order.body);
    return status;
}

/* The axes of the command line and, unless `path` is NULL, the job in that file. */
static int build(const struct cli_line *line, const char *path, char **body)
{
    const char *axes[CLI_GIVEN_MAX], *zips[CLI_GIVEN_MAX], *value;
    char reason[512];
    struct cli_ticket ticket;
    struct request_sweep request = {.axes = axes, .zips = zips, .ticket = &ticket.request};
    size_t size = 0;
    int status = cli_ticket_read(line, &ticket);
    char *job = status == CLI_OK && path ? cli_read_file(path, &size) : NULL;
    if (status != CLI_OK || (path && !job))
        return status != CLI_OK ? status : CLI_FAILED;
    for (size_t i = 0; (value = cli_value_at(line, "axis", i)); i++)
        axes[request.axes_count++] = value;
    for (size_t i = 0; (value = cli_value_at(line, "zip", i)); i++)
        zips[request.zips_count++] = value;
    request.job = job;
    request.logarithmic = cli_given(line, "log");
    *body = request_json_sweep(&request, reason, sizeof reason);
    free(job);
    return *body ? CLI_OK : cli_wrong(line->command, "%s", reason);
}

/* A file that is a sweep already, but for its label, tags and priority. */
static int load(const struct cli_line *line, const char *path, char **body)
{
    struct cli_ticket ticket;
    size_t size = 0;
    int status = cli_ticket_read(line, &ticket);
    char *file = status == CLI_OK ? cli_read_file(path, &size) : NULL;
    if (!file)
        return status != CLI_OK ? status : CLI_FAILED;
    *body = request_json_submit(file, size, &ticket.request);
    free(file);
    return *body ? CLI_OK : cli_print_take(NULL);
}

static int prepare(const struct cli_line *line, struct order *order)
{
    const char *extend = cli_value(line, "extend"), *again = cli_value(line, "retry");
    const char *file = line->operands ? line->operand[0] : NULL, *id = extend ? extend : again;
    bool axes = cli_given(line, "axis");
    if (id && file)
        return cli_wrong(line->command, "--%s takes no file", extend ? "extend" : "retry");
    if (!id && !file)
        return cli_wrong(line->command, "SWEEP.json, or JOB.json and --axis, is needed");
    if (extend && !axes)
        return cli_wrong(line->command, "--extend needs --axis with the new values");
    if (!axes && cli_given(line, "zip"))
        return cli_wrong(line->command, "--zip needs --axis");
    if (again && axes)
        return cli_wrong(line->command, "--retry takes no --axis");
    if (id && id[0] != 's')
        return cli_wrong(line->command, "\"%s\" is no id of a sweep: they begin with s", id);
    order->keyed = !id;
    order->path =
        id ? cli_server_path(line, id, extend ? "/extend" : "/retry") : strdup("/v1/sweeps");
    if (!order->path)
        return CLI_USAGE;
    return again ? CLI_OK : axes ? build(line, file, &order->body) : load(line, file, &order->body);
}

static int send_order(const struct cli_line *line, const struct order *order)
{
    struct client *client = NULL;
    struct client_answer raw = {0};
    char key[CLIENT_KEY_SIZE];
    int status = cli_server_open(line, &client);
    client_key(key);
    const struct client_request request = {.method = "POST",
                                           .path = order->path,
                                           .body = order->body,
                                           .body_size = order->body ? strlen(order->body) : 0,
                                           .key = order->keyed ? key : NULL,
                                           .once = !order->keyed};
    if (status == CLI_OK)
        status =
            cli_server_ask(line, client, line->operands ? line->operand[0] : NULL, &request, &raw);
    if (status == CLI_OK)
        status = answered(line, client, &raw);
    client_answer_fini(&raw);
    client_free(client);
    return status;
}

static int answered(const struct cli_line *line, struct client *client,
                    const struct client_answer *raw)
{
    struct answer *record = answer_json_load(raw->body, raw->size);
    const char *given = answer_json_text(record, "id");
    char *id = given ? strdup(given) : NULL;
    bool json = cli_given(line, "json"), wait = cli_given(line, "wait");
    int status = CLI_OK;
    if (!id) {
        fprintf(stderr, "bcd sweep: %s does not answer as bcdd does\n", client_url(client));
        status = CLI_UNREACHABLE;
    } else if (json && !wait) {
        status = cli_print_bytes(raw->body, raw->size);
    } else if (!json) {
        printf("%s\n", id);
        fflush(stdout);
        if (isatty(STDERR_FILENO) && !cli_given(line, "quiet"))
            fprintf(stderr, "%.0f jobs\n", answer_json_number(record, "jobs", 0));
    }
    answer_json_free(record);
    if (status == CLI_OK && wait)
        status = cli_watch(line, client, &id, 1);
    free(id);
    return status;
}

static const struct cli_option options[] = {
    {.name = "axis",
     .value = "POINTER=VALUES",
     .doc = "a parameter that varies: /diameter=0.1,0.5 (values), /seed=1..10 (whole numbers), "
            "/potential/amplitude=0..6:7 (7 points), 0.1..10:7:log (in equal ratios)",
     .many = true},
    {.name = "zip",
     .value = "POINTERS",
     .doc = "axes that vary together, with commas between: /diameter,/length",
     .many = true},
    {.name = "log", .doc = "all ranges in equal ratios"},
    {.name = "extend",
     .value = "ID",
     .doc = "adds the values of --axis to a sweep that stands",
     .either = 1},
    {.name = "retry", .value = "ID", .doc = "tries the failed jobs of a sweep again", .either = 1},
    {.name = "wait", .letter = 'w', .doc = "follows it to its end; the exit status tells how"},
    {.name = "tag", .value = "T", .doc = "a word to find it by", .many = true},
    {.name = "label", .value = "TEXT", .doc = "what people call it"},
    {.name = "priority",
     .value = "N",
     .doc = "among your own jobs: -100 to 100, larger is earlier (default: 0)"},
    {.name = "quiet", .letter = 'q', .doc = "the id only"},
    {0},
};

const struct cli_command cli_sweep_command = {
    .name = "sweep",
    .operands = "[SWEEP.json | JOB.json]",
    .most = 1,
    .doc = "sends a job in many variants to a server, as one sweep",
    .text = "Either the file is a sweep, {\"base\": JOB, \"axes\": {...}}; or it is a job and the\n"
            "axes are told by --axis. All combinations are run, but for axes that --zip ties\n"
            "together. - reads stdin. Printed is the id, for watch, get and export.",
    .options = options,
    .server = true,
    .function = sweep,
};
