/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sql_print.h - rows of any columns on stdout as they come: a table for people, CSV, JSON.
 */
#ifndef SQL_PRINT_H
#define SQL_PRINT_H

#include "store_sql.h"
#include "text.h"

enum sql_form { SQL_PRINT_TABLE, SQL_PRINT_CSV, SQL_PRINT_JSON };

/* Tables are laid out a few hundred rows at a time. */
enum { SQL_PRINT_ROWS = 500 };
struct sql_print {
    enum sql_form form;
    size_t columns, rows; /* rows: all so far */
    char **name;
    char **cell;  /* of a table: rows that wait, one after the other */
    bool *number; /* which of them stand to the right */
    size_t waiting, *width;
    bool failed; /* stdout takes no more, or no memory */
};
void sql_print_init(struct sql_print *print, enum sql_form form);
/* What is left is written. False = not all of it could be. */
bool sql_print_fini(struct sql_print *print);

/* For struct sql_reader; context is a struct sql_print. */
void sql_print_names(void *context, size_t columns, const char *const *name);
bool sql_print_row(void *context, size_t columns, const struct sql_value *value);

#endif
