/* SPDX-License-Identifier: GPL-3.0-or-later
 * table_csv.h - one table as CSV (RFC 4180, but lines end in LF alone, for awk and grep): a header
 * line with the column names, then the rows; numbers as round-trip doubles, nothing for NaN, absent
 * columns left out. See table_json.h. */
#ifndef TABLE_CSV_H
#define TABLE_CSV_H

#include "bcd.h"

char *table_csv_print(const struct bcd_table *table);

#endif
