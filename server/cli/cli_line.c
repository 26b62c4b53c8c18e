/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_line.c - reads a command line by the rows of its command; see cli.h. */
#include "cli.h"
#include "cli_server.h"

#include <assert.h>
#include <getopt.h>
#include <string.h>

enum { OPTIONS_MAX = 32, HELP = 'h' };

static int check(const struct cli_line *line);
static int check_choices(const struct cli_line *line);
static const struct cli_option *find_row(const struct cli_command *command, const char *name);

const struct cli_option *cli_option_at(const struct cli_command *command, size_t i)
{
    const struct cli_option *const lists[] = {command->options,
                                              command->server ? cli_server_options : NULL};
    for (size_t l = 0; l < sizeof lists / sizeof *lists; l++)
        for (const struct cli_option *row = lists[l]; row && row->name; row++)
            if (i-- == 0)
                return row;
    return NULL;
}

int cli_line_read(const struct cli_command *command, int argc, char **argv, struct cli_line *line,
                  bool *help)
{
    struct option names[OPTIONS_MAX + 2] = {{"help", no_argument, NULL, HELP}};
    char letters[2 * OPTIONS_MAX + 3] = ":h", *letter = letters + 2;
    const struct cli_option *row;
    int c;
    for (int i = 0; (row = cli_option_at(command, (size_t)i)); i++) {
        assert(i < OPTIONS_MAX);
        names[i + 1] =
            (struct option){row->name, row->value ? required_argument : no_argument, NULL, 256 + i};
        if (row->letter) {
            *letter++ = row->letter;
            *letter = ':';
            letter += row->value != NULL;
        }
    }
    *letter = '\0';
    *line = (struct cli_line){.command = command};
    opterr = 0;
    optind = 1;
    while ((c = getopt_long(argc, argv, letters, names, NULL)) != -1) {
        *help = c == HELP;
        if (*help)
            return CLI_OK;
        row = NULL;
        for (size_t i = 0; c != '?' && c != ':' && (row = cli_option_at(command, i)); i++)
            if (c == 256 + (int)i || c == row->letter)
                break;
        if (!row)
            return c == ':' ? cli_wrong(command, "%s needs a value", argv[optind - 1])
                            : cli_wrong(command, "%s is no option", argv[optind - 1]);
        if (line->given == CLI_GIVEN_MAX)
            return cli_wrong(command, "more than %d options", CLI_GIVEN_MAX);
        line->option[line->given].row = row;
        line->option[line->given++].value = row->value ? optarg : "";
    }
    line->operands = (size_t)(argc - optind);
    line->operand = argv + optind;
    return check(line);
}

const char *cli_value_at(const struct cli_line *line, const char *name, size_t i)
{
    const struct cli_option *row = find_row(line->command, name);
    assert(row);
    for (size_t g = 0; g < line->given; g++)
        if (line->option[g].row == row && i-- == 0)
            return line->option[g].value;
    return NULL;
}

const char *cli_value(const struct cli_line *line, const char *name)
{
    const char *value = NULL, *next;
    for (size_t i = 0; (next = cli_value_at(line, name, i)); i++)
        value = next;
    return value;
}

bool cli_given(const struct cli_line *line, const char *name)
{
    return cli_value_at(line, name, 0) != NULL;
}

static const struct cli_option *find_row(const struct cli_command *command, const char *name)
{
    const struct cli_option *row;
    for (size_t i = 0; (row = cli_option_at(command, i)); i++)
        if (strcmp(row->name, name) == 0)
            return row;
    return NULL;
}

/* What the rows say about the whole. */
static int check(const struct cli_line *line)
{
    const struct cli_command *command = line->command;
    const bool none = command->operands[0] == '\0';
    for (size_t i = 0; i < line->given; i++)
        for (size_t j = 0; j < i; j++) {
            const struct cli_option *a = line->option[j].row, *b = line->option[i].row;
            if (a != b && a->either && a->either == b->either)
                return cli_wrong(command, "--%s and --%s exclude one another", a->name, b->name);
            if (a == b && !a->many && a->value)
                return cli_wrong(command, "--%s is given twice", a->name);
        }
    if (line->operands < command->least)
        return cli_wrong(command, "%s is needed", command->operands);
    if (line->operands > command->most)
        return none ? cli_wrong(command, "%s is no option", line->operand[0])
                    : cli_wrong(command, "%s is one word too many", line->operand[command->most]);
    return check_choices(line);
}

static int check_choices(const struct cli_line *line)
{
    for (size_t i = 0; i < line->given; i++) {
        const struct cli_option *row = line->option[i].row;
        const char *value = line->option[i].value, *choice = row->choices;
        size_t length = strlen(value);
        if (!choice)
            continue;
        for (size_t size; *choice; choice += size + (choice[size] == ' ')) {
            size = strcspn(choice, " ");
            if (size == length && memcmp(choice, value, size) == 0)
                break;
        }
        if (!*choice)
            return cli_wrong(line->command, "--%s is one of: %s; not \"%s\"", row->name,
                             row->choices, value);
    }
    return CLI_OK;
}
