/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_table.h - a few columns of fixed width, for lists that are alike: tokens, owners, the audit
 * log. What does not fit pushes the rest of its row aside.
 */
#ifndef CLI_TABLE_H
#define CLI_TABLE_H

#include "answer_json.h"

enum cell { CELL_TEXT, CELL_TIME, CELL_NUMBER, CELL_BYTES };
struct cli_column {
    const char *head, *path; /* path within a row; head NULL ends the list */
    enum cell cell;
    int width; /* 0: of the last */
};

void cli_table_heads(const struct cli_column *columns);
/* "-" where there is nothing; a time is cut to minutes. */
void cli_table_row(const struct cli_column *columns, const struct answer *row);

#endif
