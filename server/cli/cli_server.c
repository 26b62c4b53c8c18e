/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_server.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { TOKEN_SIZE = 512, SILENCE_MAX_S = 86400 };

const struct cli_option cli_server_options[] = {
    {.name = "url",
     .value = "URL",
     .doc = "the server (default: BCD_URL of the environment, or " CLI_SERVER_URL ")"},
    {.name = "token-file",
     .value = "FILE",
     .doc = "the first line of this file is the token; nobody else may read it (default: BCD_TOKEN "
            "of the environment)"},
    {.name = "timeout",
     .value = "SECONDS",
     .doc = "gives up a server that is silent for so long (default: 60)"},
    {.name = "json", .doc = "what the server says, for scripts"},
    {0},
};

static int read_token(const struct cli_line *line, const char *path, char token[TOKEN_SIZE]);
static void print_problem(const struct answer *problem);

int cli_server_open(const struct cli_line *line, struct client **client)
{
    char token[TOKEN_SIZE] = "", reason[256];
    const char *url = cli_value(line, "url"), *file = cli_value(line, "token-file");
    const char *timeout = cli_value(line, "timeout"), *environment = getenv("BCD_TOKEN");
    struct client_options options = {.url = url ? url : getenv("BCD_URL")};
    *client = NULL;
    if (!options.url || !options.url[0])
        options.url = CLI_SERVER_URL;
    if (timeout && !cli_parse_integer(timeout, 1, SILENCE_MAX_S, &options.silence_s))
        return cli_wrong(line->command, "--timeout is 1 to %d seconds, not \"%s\"", SILENCE_MAX_S,
                         timeout);
    if (file && read_token(line, file, token) != CLI_OK)
        return CLI_USAGE;
    options.token = file ? token : environment && environment[0] ? environment : NULL;
    *client = client_create(&options, reason, sizeof reason);
    explicit_bzero(token, sizeof token);
    if (*client)
        return CLI_OK;
    fprintf(stderr, "bcd %s: %s\n", line->command->name, reason);
    return CLI_USAGE;
}

/* Nobody but its owner may read it, as with the keys of ssh. */
static int read_token(const struct cli_line *line, const char *path, char token[TOKEN_SIZE])
{
    struct stat status;
    const char *wrong = NULL;
    FILE *file = fopen(path, "re");
    if (!file || fstat(fileno(file), &status) != 0)
        wrong = strerror(errno);
    else if (!S_ISREG(status.st_mode))
        wrong = "it is no plain file";
    else if (status.st_mode & (S_IRWXG | S_IRWXO))
        wrong = "others than its owner may read it; chmod 600 mends that";
    else if (!fgets(token, TOKEN_SIZE, file))
        wrong = "it is empty";
    if (file)
        fclose(file);
    token[strcspn(token, "\r\n")] = '\0';
    if (!wrong && !token[0])
        wrong = "its first line is empty";
    if (!wrong)
        return CLI_OK;
    fprintf(stderr, "bcd %s: the token file %s is not used: %s\n", line->command->name, path,
            wrong);
    return CLI_USAGE;
}

int cli_server_ask(const struct cli_line *line, struct client *client, const char *about,
                   const struct client_request *request, struct client_answer *answer)
{
    enum client_status status = client_ask(client, request, answer);
    if (status == CLIENT_OK && answer->status / 100 == 2 && (answer->body || request->take))
        return CLI_OK;
    int result = cli_server_fault(line, client, about, status, answer);
    client_answer_fini(answer);
    return result;
}

int cli_server_read(const struct cli_line *line, struct client *client, const char *about,
                    const struct client_request *request, struct answer **answer)
{
    struct client_answer raw;
    int status = cli_server_ask(line, client, about, request, &raw);
    if (status != CLI_OK)
        return status;
    *answer = answer_json_load(raw.body, raw.size);
    client_answer_fini(&raw);
    if (*answer)
        return CLI_OK;
    fprintf(stderr, "bcd %s: %s does not answer as bcdd does\n", line->command->name,
            client_url(client));
    return CLI_UNREACHABLE;
}

int cli_server_fault(const struct cli_line *line, const struct client *client, const char *about,
                     enum client_status status, const struct client_answer *answer)
{
    const char *name = line->command->name, *url = client_url(client);
    if (status == CLIENT_SIGNAL)
        return CLI_SIGNAL + client_signal(client);
    if (status == CLIENT_UNREACHABLE) {
        fprintf(stderr, "bcd %s: no answer from %s: ", name, url);
        cli_put_clean(stderr, client_words(client));
        fputc('\n', stderr);
        return CLI_UNREACHABLE;
    }
    if (status == CLIENT_LOST) {
        fprintf(stderr, "bcd %s: the answer of %s broke off: ", name, url);
        cli_put_clean(stderr, client_words(client));
        fputc('\n', stderr);
        return CLI_UNREACHABLE;
    }
    if (status != CLIENT_OK)
        return CLI_FAILED; /* whoever stopped it has said why */
    struct answer *problem = answer->body ? answer_json_load(answer->body, answer->size) : NULL;
    const char *title = answer_json_text(problem, "title");
    fprintf(stderr, "bcd %s: ", name);
    if (about)
        fprintf(stderr, "%s: ", about);
    cli_put_clean(stderr, title ? title : "the server refuses");
    fprintf(stderr, " (%d)\n", answer->status);
    print_problem(problem);
    answer_json_free(problem);
    if (answer->status != 401 && answer->status != 403)
        return CLI_FAILED;
    if (answer->status == 401)
        fprintf(stderr, "  a token comes from BCD_TOKEN or --token-file FILE\n");
    return CLI_FORBIDDEN;
}

/* Each fault with its place; the detail alone when there are none. */
static void print_problem(const struct answer *problem)
{
    const struct answer *errors = answer_json_at(problem, "errors");
    const char *detail = answer_json_text(problem, "detail"), *key;
    size_t count = answer_json_count(errors);
    for (size_t i = 0; i < count; i++) {
        const struct answer *error = answer_json_item(errors, i, &key);
        const char *pointer = answer_json_text(error, "pointer");
        const char *where = pointer ? pointer : answer_json_text(error, "parameter");
        const char *words = answer_json_text(error, "detail");
        fputs("  ", stderr);
        cli_put_clean(stderr, where && where[0] ? where : "the job");
        fputs(": ", stderr);
        cli_put_clean(stderr, words ? words : "");
        fputc('\n', stderr);
    }
    if (count > 0 || !detail)
        return;
    fputs("  ", stderr);
    cli_put_clean(stderr, detail);
    fputc('\n', stderr);
}

char *cli_server_path(const struct cli_line *line, const char *id, const char *rest)
{
    struct text path = {0};
    const char *kind = id[0] == 'j' ? "jobs" : id[0] == 's' ? "sweeps" : NULL;
    if (!kind || id[strspn(id, "abcdefghijklmnopqrstuvwxyz0123456789-")] != '\0') {
        fprintf(stderr, "bcd %s: \"", line->command->name);
        cli_put_clean(stderr, id);
        fprintf(stderr, "\" is no id: jobs begin with j, sweeps with s\n");
        return NULL;
    }
    text_add(&path, "/v1/%s/%s%s", kind, id, rest);
    return text_take(&path);
}
