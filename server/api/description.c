/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "description.h"
#include "openapi.h"
#include "schema_json.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* FNV-1a: tells versions of a text apart. */
static void fix_take(struct fixed_text *fixed, char *text)
{
    uint64_t sum = 0xcbf29ce484222325u;
    for (const char *c = text; c && *c; c++)
        sum = (sum ^ (unsigned char)*c) * 0x100000001b3u;
    fixed->text = text;
    snprintf(fixed->etag, sizeof(fixed->etag), "%016" PRIx64, sum);
}

bool description_init(struct description *description)
{
    fix_take(&description->openapi, openapi_print());
    fix_take(&description->job_schema, schema_json_job());
    return description->openapi.text && description->job_schema.text;
}

void description_fini(struct description *description)
{
    free(description->openapi.text);
    free(description->job_schema.text);
    *description = (struct description){0};
}
