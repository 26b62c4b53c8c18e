/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_submit.h - --label, --tag and --priority, which jobs and sweeps share. */
#ifndef CLI_SUBMIT_H
#define CLI_SUBMIT_H

#include "cli.h"
#include "request_json.h"

struct cli_ticket {
    struct request_ticket request; /* points into this struct: not to be copied */
    const char *tags[CLI_GIVEN_MAX];
    int64_t priority;
};

/* CLI_OK, or CLI_USAGE with words on stderr. */
int cli_ticket_read(const struct cli_line *line, struct cli_ticket *ticket);

#endif
