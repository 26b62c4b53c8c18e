/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_rows.h - one point of a sweep and its table as a row of JSON or lines of CSV. None of them
 * knows an observable by name. `table` is NULL for points without a result.
 */
#ifndef SWEEP_ROWS_H
#define SWEEP_ROWS_H

#include "bcd.h"
#include "store_sweeps.h"
#include "sweep_json.h"
#include "text.h"

/* {"job":..,"state":..,POINTER:value,..,COLUMN:[..],..} */
void sweep_rows_add_json(struct text *text, const struct sweep *sweep,
                         const struct sweep_point *point, const struct bcd_table *table);

/* The columns of a CSV, those of the first table: job, the axes, then the table's. A table in which
 * one is absent leaves it empty; those it has beyond are left out. */
struct sweep_columns {
    char name[BCD_COLUMNS_MAX][sizeof(((struct bcd_column *)0)->name)];
    size_t count;
};
void sweep_rows_add_head(struct text *text, const struct sweep *sweep,
                         struct sweep_columns *columns, const struct bcd_table *table);

/* One line for each row of the table. */
void sweep_rows_add_csv(struct text *text, const struct sweep *sweep,
                        const struct sweep_columns *columns, const struct sweep_point *point,
                        const struct bcd_table *table);

/* The column of that name that has values; NULL = none. */
const struct bcd_column *sweep_rows_column(const struct bcd_table *table, const char *name);

#endif
