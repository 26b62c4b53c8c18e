/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd, the command line: main.
 */
#include "cli.h"
#include "heap_json.h"

#include <gsl/gsl_errno.h>

#include <string.h>

static void list_commands(FILE *out, const char *title, bool server)
{
    const struct cli_command *command;
    fprintf(out, "\n%s\n", title);
    for (size_t i = 0; (command = cli_command_at(i)); i++)
        if (server == (command->server || (command->parts && command->parts[0]->server)))
            fprintf(out, "  %-10s  %s\n", command->name, command->doc);
}

static void usage(FILE *out)
{
    fputs("usage: bcd COMMAND ...\n", out);
    list_commands(out, "On this machine:", false);
    list_commands(out, "On a server (--url URL, or BCD_URL of the environment):", true);
    fputs("\nbcd help COMMAND tells more; bcd --version tells the version. Exit status: 0 done,\n"
          "1 failed or refused, 2 wrong command line, 3 no server, 4 no right to it, 130 Ctrl-C.\n",
          out);
}

static int help(int argc, char **argv)
{
    const struct cli_command *command = argc > 2 ? cli_command_find(argv[2]) : NULL;
    if (command && argc > 3)
        command = cli_part_find(command, argv[3]);
    if (command)
        return cli_help(command);
    if (argc == 3 && strcmp(argv[2], "--man") == 0)
        return cli_print_take(cli_manual());
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
        const struct cli_command *part = cli_part_find(command, name);
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
    const struct cli_command *command = cli_command_find(name);
    gsl_set_error_handler_off(); /* its own would abort the process */
    heap_json_init();
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
