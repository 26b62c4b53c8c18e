/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_schema.c - bcd schema: the descriptions that the service gives of itself; see cli.h. */
#include "cli.h"
#include "schema_json.h"

#include <string.h>

static int schema(const struct cli_line *line)
{
    if (strcmp(line->operand[0], "job") == 0)
        return cli_print_take(schema_json_job());
    return cli_wrong(line->command, "there is no schema \"%s\"", line->operand[0]);
}

const struct cli_command cli_schema_command = {
    .name = "schema",
    .operands = "job",
    .least = 1,
    .most = 1,
    .doc = "prints the JSON Schema of a job",
    .text = "What GET /v1/schema/job answers and schema/job.schema.json holds.",
    .function = schema,
};
