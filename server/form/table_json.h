/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * table_json.h, table_csv.h and plot_svg.h show one struct bcd_table in three forms; none of them
 * knows an observable by name. All return malloc'ed text, NULL = out of memory.
 */
#ifndef TABLE_JSON_H
#define TABLE_JSON_H

#include "bcd.h"
#include "text.h"

/* {"lag":[..],"msd":[..],...} for lists, {"current":..,"stderr":..} for scalars. NaN becomes null;
 * an absent column becomes null with "<name>_reason". Notes follow as further members. */
char *table_json_print(const struct bcd_table *table);

/* The same without its braces, appended. */
void table_json_add_members(struct text *text, const struct bcd_table *table);

/* {"msd":{...},"density":{...}}: all tables of a job. */
char *table_json_print_all(struct bcd_table *const *tables, size_t count);

#endif
