/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_sql_view.h - the view `jobs` for people who write SQL. For store*.c only.
 */
#ifndef STORE_SQL_VIEW_H
#define STORE_SQL_VIEW_H

#include "bcd.h"

#include <sqlite3.h>

/* CREATE TEMP VIEW jobs, before the table of that name: what jobs say of themselves, one column
 * each. Parameters have their names (diameter), those of parts the part's before it
 * (potential_amplitude; potential itself is its type), derived facts derived_ (derived_steps), what
 * became of it outcome_ (outcome_realizations); without `outcomes` these are NULL.
 * malloc'ed; NULL = out of memory. */
char *store_sql_view_text(const struct bcd_scene *sample, bool outcomes);

/* Creates it where the database has jobs. An SQLite code. */
int store_sql_view(sqlite3 *db, const struct bcd_scene *sample);

#endif
