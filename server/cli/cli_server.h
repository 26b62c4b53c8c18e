/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_server.h - what the commands that talk to a server share: which one and as whom, its refusals
 * in words, exit statuses.
 */
#ifndef CLI_SERVER_H
#define CLI_SERVER_H

#include "answer_json.h"
#include "cli.h"
#include "client.h"

#define CLI_SERVER_URL "http://127.0.0.1:8080"

/* The options that all of them have; ends with {0}. */
extern const struct cli_option cli_server_options[];

/* By --url or BCD_URL, --token-file or BCD_TOKEN. CLI_OK, or the exit status with words on
 * stderr. */
int cli_server_open(const struct cli_line *line, struct client **client);

/* Asks, and expects a 2xx: CLI_OK and an answer to fini; else the exit status, and words on stderr
 * about what became of `about` ("job.json", or NULL). */
int cli_server_ask(const struct cli_line *line, struct client *client, const char *about,
                   const struct client_request *request, struct client_answer *answer);

/* The same, read. The caller frees the tree. */
int cli_server_read(const struct cli_line *line, struct client *client, const char *about,
                    const struct client_request *request, struct answer **answer);

/* What an answer or the lack of it means: words on stderr, and the exit status. */
int cli_server_fault(const struct cli_line *line, const struct client *client, const char *about,
                     enum client_status status, const struct client_answer *answer);

/* "/v1/jobs/ID" or "/v1/sweeps/ID" by the first letter, with `rest` behind; NULL = no id, with
 * words on stderr, or no memory. malloc'ed. */
char *cli_server_path(const struct cli_line *line, const char *id, const char *rest);

#endif
