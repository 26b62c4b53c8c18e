/* SPDX-License-Identifier: GPL-3.0-or-later
 * table.h - making tables (bcd.h): used by the observables. */
#ifndef TABLE_H
#define TABLE_H

#include "bcd.h"
#include "part.h"

/* Names and axes of a table; rows of all its columns. */
void table_describe(struct bcd_table *table, const char *name, size_t rows);
void table_axes(struct bcd_table *table, const char *x_label, const char *y_label);

/* Adds a column of table->rows numbers to be filled in; NULL = no memory. */
double *table_add(struct bcd_table *table, const char *name, enum bcd_role role);

/* Adds the x column of a profile: centres of table->rows bins over [0, range]. */
enum bcd_status table_add_centres(struct bcd_table *table, const char *name, double range);

/* Adds a column that is absent, and why. */
void table_add_absent(struct bcd_table *table, const char *name, enum bcd_role role,
                      const char *reason);

/* Empties the first column of a role that was added before; nothing where there is none. */
void table_make_absent(struct bcd_table *table, enum bcd_role role, const char *reason);

void table_note_text(struct bcd_table *table, const char *name, const char *text);
void table_note_number(struct bcd_table *table, const char *name, double number);

/* Adds the columns `name` (mean) and "stderr" (one standard error; NaN where fewer than two samples
 * allow none) from the first table->rows moments. */
enum bcd_status table_add_moments(struct bcd_table *table, const char *name,
                                  const struct moments *moments);

#endif
