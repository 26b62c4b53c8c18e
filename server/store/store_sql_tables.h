/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_sql_tables.h - results as SQL tables: msd(job), density(job), ... for every observable of
 * the catalogue, and a view `jobs` that has the parameters of jobs as columns. For store*.c only.
 *
 * The same code is linked into bcd and built as an extension that other programs load
 * (build/bcd_sqlite.so).
 */
#ifndef STORE_SQL_TABLES_H
#define STORE_SQL_TABLES_H

#include <sqlite3.h>

/* Adds the tables to a connection, and the view where the database is one of ours. An SQLite code.
 * What can be had is told by
 *
 *   SELECT lag, msd, stderr FROM msd(ID)       ID = a job's id or its seq; a list of one observable
 *   SELECT job, energy FROM energy             all jobs that have one
 *   SELECT name, value, text FROM notes(ID)    remarks on results: observable, name, value, text
 */
int store_sql_tables(sqlite3 *db);

#endif
