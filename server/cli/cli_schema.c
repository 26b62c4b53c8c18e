/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_schema.c - bcd schema: the descriptions that the service gives of itself; see cli.h. */
#include "cli.h"
#include "openapi.h"
#include "schema_json.h"

#include <string.h>

static int schema(const struct cli_line *line)
{
    if (strcmp(line->operand[0], "job") == 0)
        return cli_print_take(schema_json_job());
    if (strcmp(line->operand[0], "openapi") == 0)
        return cli_print_take(openapi_print());
    return cli_wrong(line->command, "there is no schema \"%s\"", line->operand[0]);
}

const struct cli_command cli_schema_command = {
    .name = "schema",
    .operands = "job|openapi",
    .least = 1,
    .most = 1,
    .doc = "prints the JSON Schema of a job, or the description of the API",
    .text = "What GET /v1/schema/job and GET /openapi.json answer, and schema/ holds.",
    .function = schema,
};
