/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd, the command line: main and the list of commands.
 */
#include "cli.h"
#include "record_json.h"

#include <gsl/gsl_errno.h>

#include <string.h>

/* In the order of the documentation. */
static const struct cli_command *const commands[] = {
    &cli_run_command,      &cli_check_command,
    &cli_theory_command,   &cli_schema_command,
    &cli_report_command,   &cli_bench_command,
    &cli_submit_command,   &cli_watch_command,
    &cli_list_command,     &cli_get_command,
    &cli_export_command,   &cli_cancel_command,
    &cli_estimate_command, NULL,
};

static const struct cli_command *find(const char *name)
{
    for (size_t i = 0; commands[i]; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return NULL;
}

static const struct cli_command *find_part(const struct cli_command *command, const char *name)
{
    for (size_t i = 0; command->parts[i]; i++)
        if (strcmp(strchr(command->parts[i]->name, ' ') + 1, name) == 0)
            return command->parts[i];
    return NULL;
}

static void usage(FILE *out)
{
    fputs("usage: bcd COMMAND ...\n\n", out);
    for (size_t i = 0; commands[i]; i++)
        fprintf(out, "  %-10s %s\n", commands[i]->name, commands[i]->doc);
    fputs("\nbcd help COMMAND tells more; bcd --version tells the version.\n", out);
}

static int help(int argc, char **argv)
{
    const struct cli_command *command = argc > 2 ? find(argv[2]) : NULL;
    if (command && command->parts && argc > 3)
        command = find_part(command, argv[3]);
    if (command)
        return cli_help(command);
    if (argc > 2) {
        fprintf(stderr, "bcd: there is no command \"%s%s%s\"\n", argv[2], argc > 3 ? " " : "",
                argc > 3 ? argv[3] : "");
        usage(stderr);
        return CLI_USAGE;
    }
    usage(stdout);
    return CLI_OK;
}

static bool asks_help(const char *word)
{
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0;
}

static int run(const struct cli_command *command, int argc, char **argv)
{
    struct cli_line line;
    bool wants_help = false;
    if (command->parts) {
        const char *name = argc > 1 ? argv[1] : "";
        const struct cli_command *part = find_part(command, name);
        if (part)
            return run(part, argc - 1, argv + 1);
        if (asks_help(name))
            return cli_help(command);
        return *name ? cli_wrong(command, "there is no %s \"%s\"", command->name, name)
                     : cli_wrong(command, "which %s?", command->name);
    }
    int status = cli_line_read(command, argc, argv, &line, &wants_help);
    if (wants_help)
        return cli_help(command);
    return status == CLI_OK ? command->function(&line) : status;
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    const struct cli_command *command = find(name);
    gsl_set_error_handler_off(); /* its own would abort the process */
    record_json_seed();
    if (command)
        return run(command, argc - 1, argv + 1);
    if (strcmp(name, "--version") == 0) {
        puts("bcd " BCD_VERSION);
        return CLI_OK;
    }
    if (asks_help(name) || strcmp(name, "help") == 0)
        return help(argc, argv);
    if (*name)
        fprintf(stderr, "bcd: there is no command \"%s\"\n", name);
    usage(stderr);
    return CLI_USAGE;
}
