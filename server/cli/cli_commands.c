/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_commands.c - the list of commands; see cli.h. */
#include "cli.h"

#include <string.h>

/* In the order of the documentation. */
static const struct cli_command *const commands[] = {
    &cli_run_command,    &cli_check_command,    &cli_theory_command,     &cli_report_command,
    &cli_bench_command,  &cli_schema_command,   &cli_submit_command,     &cli_sweep_command,
    &cli_watch_command,  &cli_list_command,     &cli_get_command,        &cli_export_command,
    &cli_cancel_command, &cli_estimate_command, &cli_token_command,      &cli_backup_command,
    &cli_whoami_command, &cli_owners_command,   &cli_quota_command,      &cli_audit_command,
    &cli_sql_command,    &cli_worker_command,   &cli_completion_command,
};

const struct cli_command *cli_command_at(size_t i)
{
    return i < sizeof commands / sizeof *commands ? commands[i] : NULL;
}

const struct cli_command *cli_command_find(const char *name)
{
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return NULL;
}

const struct cli_command *cli_part_find(const struct cli_command *command, const char *name)
{
    for (size_t i = 0; command->parts && command->parts[i]; i++)
        if (strcmp(cli_word(command->parts[i]), name) == 0)
            return command->parts[i];
    return NULL;
}

const char *cli_word(const struct cli_command *command)
{
    const char *blank = strchr(command->name, ' ');
    return blank ? blank + 1 : command->name;
}
