/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_report.h - the reports of `bcd report NAME`: one function each, one row in cli_report.c. */
#ifndef CLI_REPORT_H
#define CLI_REPORT_H

#include "cli.h"

int cli_report_figures(const struct cli_line *line);
int cli_report_work_precision(const struct cli_line *line);
int cli_report_stability(const struct cli_line *line);

#endif
