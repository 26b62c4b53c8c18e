/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * description.h - what the service says of itself, in texts that stay as they are while it runs:
 * printed once (tens of milliseconds), sent as often as anybody asks.
 */
#ifndef DESCRIPTION_H
#define DESCRIPTION_H

#include "reply.h"

struct fixed_text {
    char *text;
    char etag[ETAG_SIZE]; /* of these bytes */
};
struct description {
    struct fixed_text openapi, job_schema;
};

/* False = out of memory; to be ended either way. */
bool description_init(struct description *description);
void description_fini(struct description *description);

#endif
