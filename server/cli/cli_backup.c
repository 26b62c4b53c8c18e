/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_backup.c - bcd backup: everything that a server keeps, as one file; see cli.h. */
#include "cli_server.h"
#include "download.h"
#include "store_backup.h"
#include "text.h"

#include <inttypes.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>

static atomic_int stopping;

static void stop(int number)
{
    atomic_store(&stopping, number);
}

/* From the directory itself, whether a daemon works there or not. */
static int backup_here(const struct cli_line *line)
{
    struct backup_plan plan = {.to = line->operand[0], .stop = &stopping};
    struct sigaction action = {.sa_handler = stop};
    struct text text = {0};
    struct backup made;
    char reason[512] = "out of memory", *from = NULL;
    enum store_status status = STORE_BROKEN;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    signal(SIGXFSZ, SIG_IGN); /* a limit on file sizes is a full disk */
    if (asprintf(&from, "%s/bcd.sqlite", cli_value(line, "data")) >= 0) {
        plan.from = from;
        status = store_backup_file(&plan, &made, reason, sizeof reason);
        free(from);
    }
    if (status != STORE_OK) {
        fprintf(stderr, "bcd: no backup: %s\n", reason);
        int number = atomic_load(&stopping);
        return number ? CLI_SIGNAL + number : CLI_FAILED;
    }
    text_add(&text, "{\"file\":");
    text_add_json_string(&text, plan.to);
    text_add(&text, ",\"bytes\":%" PRId64 ",\"schema\":%" PRId64 ",\"jobs\":%" PRId64, made.bytes,
             made.schema, made.jobs);
    text_add(&text, ",\"results\":%" PRId64 ",\"taken_ms\":%" PRId64 ",\"sha256\":\"%s\"}\n",
             made.results, made.taken_ms, made.sha256);
    return cli_print_take(text_take(&text));
}

static int backup(const struct cli_line *line)
{
    if (cli_given(line, "data"))
        return backup_here(line);
    struct client *client = NULL;
    struct stat there;
    if (stat(line->operand[0], &there) == 0 && S_ISREG(there.st_mode)) {
        fprintf(stderr, "bcd: no backup: %s is there already\n", line->operand[0]);
        return CLI_FAILED;
    }
    umask(S_IRWXG | S_IRWXO); /* what is in it is nobody else's */
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = download(line, client, "/v1/backup", NULL, line->operand[0]);
    client_free(client);
    return status;
}

static const struct cli_option options[] = {
    {.name = "data", .value = "DIR", .doc = "from this directory instead of a server"},
    {0},
};

const struct cli_command cli_backup_command = {
    .name = "backup",
    .operands = "FILE",
    .least = 1,
    .most = 1,
    .doc = "fetches a copy of all that a server keeps, while it works",
    .text = "For administrators. The file is a database that was checked, and can be put in the\n"
            "place of DIR/bcd.sqlite. It is there whole or not at all. With --data no server is\n"
            "asked, but one may be running; a line of JSON then says what is in the copy.",
    .options = options,
    .server = true,
    .function = backup,
};
