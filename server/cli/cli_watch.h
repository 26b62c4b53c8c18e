/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_watch.h - follows jobs and sweeps to their end; for bcd watch and for --wait. */
#ifndef CLI_WATCH_H
#define CLI_WATCH_H

#include "cli_server.h"

/* Progress on stderr if that is a terminal, else plain lines on stdout; records on stdout as their
 * states change with --json. CLI_OK when all have ended as "done", CLI_FAILED when one has not,
 * else why they could not be followed to the end. */
int cli_watch(const struct cli_line *line, struct client *client, char *const *ids, size_t count);

#endif
