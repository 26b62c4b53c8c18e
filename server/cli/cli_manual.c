/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_manual.c - the manual page bcd(1) in the man(7) macros, from the rows of the commands. */
#include "cli.h"
#include "cli_server.h"

#include <string.h>

static void add_section(struct text *text, const char *name, const char *words);
static void add_command(struct text *text, const struct cli_command *command);
static void add_option(struct text *text, const struct cli_option *row);
static void add_words(struct text *text, const char *words);

static const char environment[] = ".TP\n.B BCD_URL\nThe server, unless --url is given.\n"
                                  ".TP\n.B BCD_TOKEN\nThe token, unless --token-file is given. It "
                                  "is never an argument: those can\n"
                                  "be seen by all users of a machine.\n"
                                  ".TP\n.B NO_COLOR\nIf it is not empty, nothing is coloured.\n";

static const char exit_status[] =
    ".TP\n.B 0\nDone.\n"
    ".TP\n.B 1\nThe job is wrong, failed or was cancelled; the server refuses; a file cannot be\n"
    "read or written.\n"
    ".TP\n.B 2\nThe command line is wrong.\n"
    ".TP\n.B 3\nThere is no server, or it went away and did not come back.\n"
    ".TP\n.B 4\nA token is needed, or it does not allow this.\n"
    ".TP\n.B 128+N\nEnded by signal N: 130 by Ctrl-C.\n";

static const char examples[] =
    ".nf\n"
    "bcd run job.json --csv msd\n"
    "bcd submit --wait --tag friday job.json\n"
    "bcd sweep job.json --axis /diameter=0.1..0.9:9 --axis /seed=1..10 --wait\n"
    "bcd list state=failed \\(dq diameter>=0.5\\(dq\n"
    "bcd export s7k2 msd \\-o msd.npz\n"
    "bcd cancel $(bcd list \\-\\-ids \\-\\-state queued)\n"
    ".fi\n";

char *cli_manual(void)
{
    const struct cli_command *command;
    struct text text = {0};
    text_add(
        &text,
        ".\\\" SPDX-License-Identifier: GPL-3.0-or-later\n"
        ".\\\" made by `bcd help --man`\n"
        ".TH BCD 1 2026-11-26 \"bcd " BCD_VERSION "\" \"User Commands\"\n"
        ".SH NAME\nbcd \\- Brownian motion of hard rods, on this machine or on a server\n"
        ".SH SYNOPSIS\n.B bcd\n.I COMMAND\n.RI [ OPTIONS ]\n"
        ".SH DESCRIPTION\nA job describes rods on a line or ring, what acts on them and what is\n"
        "to be measured, as JSON.\n.B bcd\nruns it here, or has it run by\n.BR bcdd (8).\n"
        "The numbers are the same, bit for bit. Results go to stdout, words about them to\n"
        "stderr.\n");
    for (int server = 0; server < 2; server++) {
        add_section(&text, server ? "COMMANDS THAT TALK TO A SERVER" : "COMMANDS", "");
        for (size_t i = 0; (command = cli_command_at(i)); i++) {
            bool talks = command->server || (command->parts && command->parts[0]->server);
            if (talks == (bool)server)
                add_command(&text, command);
        }
    }
    add_section(&text, "OPTIONS OF ALL COMMANDS THAT TALK TO A SERVER", "");
    for (const struct cli_option *row = cli_server_options; row->name; row++)
        add_option(&text, row);
    add_section(&text, "ENVIRONMENT", environment);
    add_section(&text, "EXIT STATUS", exit_status);
    add_section(&text, "EXAMPLES", examples);
    add_section(&text, "SEE ALSO", ".BR bcdd (8),\n.BR curl (1),\n.BR jq (1)\n");
    return text_take(&text);
}

/* `words` is in the macros already. */
static void add_section(struct text *text, const char *name, const char *words)
{
    text_add(text, ".SH %s\n%s", name, words);
}

static void add_command(struct text *text, const struct cli_command *command)
{
    text_add(text, ".SS bcd %s", command->name);
    for (const char *c = command->operands[0] ? command->operands : ""; c && *c; c = NULL)
        text_add(text, " %s", c);
    text_add(text, "\n");
    add_words(text, command->doc);
    if (command->text) {
        text_add(text, ".PP\n");
        add_words(text, command->text);
    }
    for (const struct cli_option *row = command->options; row && row->name; row++)
        add_option(text, row);
    for (size_t i = 0; command->parts && command->parts[i]; i++)
        add_command(text, command->parts[i]);
}

static void add_option(struct text *text, const struct cli_option *row)
{
    text_add(text, ".TP\n.BR \\-\\-");
    for (const char *c = row->name; *c; c++)
        text_add(text, *c == '-' ? "\\-" : "%c", *c);
    if (row->letter)
        text_add(text, " \", \" \\-%c", row->letter);
    if (row->value)
        text_add(text, " \" \\fI%s\\fR\"", row->value);
    text_add(text, "\n");
    add_words(text, row->doc);
}

/* Lines that begin with a blank stay as they are; none begins with a dot or quote by chance. */
static void add_words(struct text *text, const char *words)
{
    bool verbatim = false;
    for (const char *end; *words; words = end + (*end == '\n')) {
        end = words + strcspn(words, "\n");
        bool fixed = *words == ' ';
        if (fixed != verbatim)
            text_add(text, fixed ? ".nf\n" : ".fi\n");
        verbatim = fixed;
        if (*words == '.' || *words == '\'')
            text_add(text, "\\&");
        for (; words < end; words++)
            if (*words == '\\')
                text_add(text, "\\e");
            else if (*words == '-')
                text_add(text, "\\-");
            else
                text_add_bytes(text, words, 1);
        text_add(text, "\n");
    }
    if (verbatim)
        text_add(text, ".fi\n");
}
