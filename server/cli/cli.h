/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli.h - the program `bcd`: the service's jobs on the command line. A subcommand is one function
 * and one row of the table in cli.c. These functions print; nothing below them does.
 */
#ifndef CLI_H
#define CLI_H

#include "bcd.h"

/* What the program ends with; after a signal it is 128 + its number (Ctrl-C: 130). */
enum { CLI_OK = 0, CLI_FAILED = 1, CLI_USAGE = 2, CLI_SIGNAL = 128 };

struct cli_command {
    const char *name;
    const char *usage; /* what follows the name: "JOB.json [--quiet]" */
    const char *doc;   /* the first line alone is shown in the list of subcommands */
    /* argv[0] is the subcommand's name. Returns the exit status. */
    int (*function)(const struct cli_command *self, int argc, char **argv);
};

int cli_run(const struct cli_command *self, int argc, char **argv);
int cli_check(const struct cli_command *self, int argc, char **argv);
int cli_bench(const struct cli_command *self, int argc, char **argv);
int cli_theory(const struct cli_command *self, int argc, char **argv);
int cli_report(const struct cli_command *self, int argc, char **argv);

/* Usage and documentation of one subcommand on stdout. */
int cli_help(const struct cli_command *self);

/* A wrong command line: words (printf-style) and usage on stderr; returns CLI_USAGE. */
int cli_wrong(const struct cli_command *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* What getopt_long returned for a word that is no option, or one without its value (c == ':'). */
int cli_wrong_option(const struct cli_command *self, int c, const char *word);

/* The value of --workers; CLI_OK, or CLI_USAGE with words on stderr. */
int cli_parse_workers(const struct cli_command *self, const char *text, int64_t *workers);

/* Whole number within min..max; false = it is none. */
bool cli_parse_integer(const char *text, int64_t min, int64_t max, int64_t *value);

/* Reads and completes the job in a file ("-" = stdin); its faults go to stderr, one a line. CLI_OK
 * and a scene that the caller frees, or CLI_FAILED. */
int cli_load_job(const char *path, struct bcd_scene **scene);

/* Prints the text on stdout and frees it; NULL = out of memory. CLI_FAILED, with words on stderr,
 * when it could not be written in full. */
int cli_print_take(char *text);

#endif
