/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_backup.c - bcd backup: everything that a server keeps, as one file; see cli.h. */
#include "cli_server.h"
#include "download.h"

static int backup(const struct cli_line *line)
{
    struct client *client = NULL;
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = download(line, client, "/v1/backup", NULL, line->operand[0]);
    client_free(client);
    return status;
}

const struct cli_command cli_backup_command = {
    .name = "backup",
    .operands = "FILE",
    .least = 1,
    .most = 1,
    .doc = "fetches a copy of all that a server keeps, while it works",
    .text = "For administrators. The file is a database that was checked, and can be put in the\n"
            "place of DIR/bcd.sqlite. It is there whole or not at all.",
    .server = true,
    .function = backup,
};
