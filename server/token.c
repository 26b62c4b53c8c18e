/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "token.h"
#include "limits.h"
#include "store_tokens.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { DAY_MS = 86400000, USAGE = 2 };

const char token_usage[] =
    "usage: bcdd token create --data DIR --owner NAME --role ROLE [--name TEXT] [--expires DAYS]\n"
    "       bcdd token list --data DIR\n"
    "       bcdd token revoke --data DIR ID\n"
    "Who may use the server. Roles: reader, submitter, operator, admin; each may do what those\n"
    "before it may. A worker may run chunks (bcd worker), and nothing else. The token is shown\n"
    "once. While a daemon uses DIR, ask it: POST, GET and DELETE /v1/tokens, or bcd token.\n";

/* The command line. Borrowed from argv. */
struct options {
    const char *command, *data, *owner, *role, *name, *expires, *id;
};

static int create(struct store *store, const struct options *options);
static int list(struct store *store);
static int revoke_token(struct store *store, const char *id);

/* Root of the machine, or whoever may write to the directory: they need no token. */
static const struct identity operator_here = {.owner = OWNER_LOCAL, .role = ROLE_ADMIN};

static int wrong(const char *what, const char *value)
{
    fprintf(stderr, "bcdd: %s%s%s%s\n%s", what, value ? " \"" : "", value ? value : "",
            value ? "\"" : "", token_usage);
    return USAGE;
}

/* 0, or the exit code after saying what is wrong. */
static int parse(int argc, char *const *argv, struct options *options)
{
    const struct {
        const char *name;
        const char **value;
    } rows[] = {{"--data", &options->data},
                {"--owner", &options->owner},
                {"--role", &options->role},
                {"--name", &options->name},
                {"--expires", &options->expires}};
    options->command = argc > 2 ? argv[2] : "";
    for (int i = 3; i < argc; i++) {
        size_t row = 0, length = strcspn(argv[i], "=");
        while (row < sizeof(rows) / sizeof(rows[0]) &&
               (strlen(rows[row].name) != length || strncmp(rows[row].name, argv[i], length) != 0))
            row++;
        if (row == sizeof(rows) / sizeof(rows[0])) {
            if (argv[i][0] == '-' || options->id)
                return wrong("no such option:", argv[i]);
            options->id = argv[i];
        } else if (argv[i][length] == '=') {
            *rows[row].value = argv[i] + length + 1;
        } else if (i + 1 < argc) {
            *rows[row].value = argv[++i];
        } else {
            return wrong("this needs a value:", argv[i]);
        }
    }
    return 0;
}

/* The same for what the command needs. */
static int check(const struct options *options)
{
    bool creates = strcmp(options->command, "create") == 0;
    bool revokes = strcmp(options->command, "revoke") == 0;
    bool lists = strcmp(options->command, "list") == 0;
    enum role role;
    if (!creates && !revokes && !lists)
        return wrong("token create, list or revoke, not", options->command);
    if (!options->data || !options->data[0])
        return wrong("--data DIR is needed", NULL);
    if (creates && (!options->owner || !owner_sound(options->owner)))
        return wrong("--owner takes 1 to 32 of a-z 0-9 _ -, not", options->owner);
    if (creates && (!options->role || !role_parse(options->role, &role)))
        return wrong("--role takes worker, reader, submitter, operator or admin, not",
                     options->role);
    if (options->name && strlen(options->name) > LIMIT_TOKEN_NAME_CHARACTERS_MAX)
        return wrong("--name is too long:", options->name);
    if (options->expires && (strspn(options->expires, "0123456789") != strlen(options->expires) ||
                             strlen(options->expires) > 6 || atoi(options->expires) < 1 ||
                             atoi(options->expires) > LIMIT_TOKEN_DAYS_MAX))
        return wrong("--expires takes days, 1 to 3650, not", options->expires);
    if (revokes != (options->id != NULL))
        return revokes ? wrong("which token? bcdd token list tells", NULL)
                       : wrong("this takes no", options->id);
    return 0;
}

int token_main(int argc, char *const *argv)
{
    struct options options = {0};
    struct store *store = NULL;
    char reason[512] = "the log says why", path[4096];
    int result = 1;
    if (argc > 2 && (strcmp(argv[2], "--help") == 0 || strcmp(argv[2], "-h") == 0)) {
        fputs(token_usage, stdout);
        return 0;
    }
    int fault = parse(argc, argv, &options);
    if (fault || (fault = check(&options)))
        return fault;
    bool creates = strcmp(options.command, "create") == 0;
    snprintf(path, sizeof(path), "%s/bcd.sqlite", options.data);
    if (!creates && access(path, F_OK) != 0) {
        fprintf(stderr, "bcdd: %s: there is no such file\n", path);
        return 1;
    }
    enum store_status status = store_open(&store, options.data, reason, sizeof(reason));
    if (status == STORE_CONFLICT)
        fprintf(stderr, "bcdd: %s. While it runs, ask it: POST /v1/tokens\n", reason);
    else if (status != STORE_OK)
        fprintf(stderr, "bcdd: %s\n", reason);
    else
        result = creates      ? create(store, &options)
                 : options.id ? revoke_token(store, options.id)
                              : list(store);
    store_close(store);
    return result;
}

static int64_t now_ms(void)
{
    return (int64_t)time(NULL) * 1000;
}

/* The token alone on stdout, for scripts. */
static int create(struct store *store, const struct options *options)
{
    struct token_record token = {.name = options->name ? strdup(options->name) : NULL};
    char secret[SECRET_SIZE];
    enum store_status status = STORE_BROKEN;
    snprintf(token.owner, sizeof(token.owner), "%s", options->owner);
    if (options->expires)
        token.expires_ms = now_ms() + (int64_t)atoi(options->expires) * DAY_MS;
    if (role_parse(options->role, &token.role) && secret_make(secret) &&
        secret_hash(secret, token.hash))
        status = store_tokens_add(store, &token, &operator_here);
    free(token.name);
    if (status == STORE_OK) {
        fprintf(stderr, "token %s of %s, role %s; it will not be shown again:\n", token.id,
                token.owner, role_name(token.role));
        puts(secret);
    } else if (status == STORE_CONFLICT) {
        fprintf(stderr,
                "bcdd: the first token must be an admin's, for else nobody could make the next; "
                "and there may be %d at a time\n",
                LIMIT_TOKENS_MAX);
    } else {
        fprintf(stderr, "bcdd: the token was not made, the log says why\n");
    }
    secret_wipe(secret, sizeof(secret));
    return status == STORE_OK ? 0 : 1;
}

static void print_date(int64_t ms)
{
    time_t seconds = (time_t)(ms / 1000);
    struct tm utc;
    char date[32] = "-";
    if (ms > 0 && gmtime_r(&seconds, &utc))
        strftime(date, sizeof(date), "%Y-%m-%d", &utc);
    printf("  %-10s", date);
}

static int list(struct store *store)
{
    struct token_record *tokens = NULL;
    size_t count = 0;
    if (store_tokens_list(store, &tokens, &count) != STORE_OK) {
        fprintf(stderr, "bcdd: the tokens cannot be read, the log says why\n");
        return 1;
    }
    printf("%-17s  %-16s  %-9s  %-10s  %-10s  %-10s  name\n", "id", "owner", "role", "created",
           "expires", "revoked");
    for (size_t i = 0; i < count; i++) {
        printf("%-17s  %-16s  %-9s", tokens[i].id, tokens[i].owner, role_name(tokens[i].role));
        print_date(tokens[i].created_ms);
        print_date(tokens[i].expires_ms);
        print_date(tokens[i].revoked_ms);
        printf("  %s\n", tokens[i].name ? tokens[i].name : "");
    }
    token_records_free(tokens, count);
    return 0;
}

static int revoke_token(struct store *store, const char *id)
{
    enum store_status status = store_tokens_revoke(store, id, true, &operator_here);
    if (status == STORE_OK)
        printf("token %s is revoked\n", id);
    else
        fprintf(stderr, "bcdd: %s: %s\n", id,
                status == STORE_NOT_FOUND  ? "there is no such token"
                : status == STORE_CONFLICT ? "it was revoked before"
                                           : "it was not revoked, the log says why");
    return status == STORE_OK ? 0 : 1;
}
