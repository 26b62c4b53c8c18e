/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * download.h - an answer of any length to a file or to stdout, in constant memory. A file is there
 * whole or not at all: it gets its name when the last byte is on disk.
 */
#ifndef DOWNLOAD_H
#define DOWNLOAD_H

#include "cli_server.h"

/* file: NULL = stdout. `about` names what is fetched in complaints. CLI_OK, or the exit status with
 * words on stderr; a broken answer leaves no file. */
int download(const struct cli_line *line, struct client *client, const char *path,
             const char *about, const char *file);

#endif
