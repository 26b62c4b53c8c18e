/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_report.h - the reports of `bcd report NAME`: one function each, one row in cli_report.c. */
#ifndef CLI_REPORT_H
#define CLI_REPORT_H

#include "cli.h"

/* An option of a report: with a value, or a flag. */
struct cli_report_option {
    const char *name; /* NULL ends a list */
    const char **value;
    bool *flag; /* NULL = it has a value */
};
enum { CLI_REPORT_OPTIONS_MAX = 12 };

/* Reads the command line into what the options point to. CLI_OK, and --help in *help; or CLI_USAGE
 * with words on stderr. */
int cli_report_parse(const struct cli_command *self, int argc, char **argv,
                     const struct cli_report_option *options, bool *help);

/* argv[0] is the report's name. Returns the exit status. */
int cli_report_figures(const struct cli_command *self, int argc, char **argv);
int cli_report_work_precision(const struct cli_command *self, int argc, char **argv);
int cli_report_stability(const struct cli_command *self, int argc, char **argv);

#endif
