/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_sql.h - one SQL question to a database, without a store: it may be a running daemon's, or a
 * backup. Nothing can be changed, and it ends in time, or after the one function that it is at: a
 * program that cannot wait for that has to end itself. Texts and memory are bounded, the latter for
 * the whole program (limits.h).
 *
 * THREADS  A call has its own connection.
 */
#ifndef STORE_SQL_H
#define STORE_SQL_H

#include "store.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct sql_value {
    enum { SQL_NULL, SQL_INTEGER, SQL_REAL, SQL_TEXT, SQL_BLOB } type;
    int64_t integer;
    double real;
    const char *text; /* or the bytes of a blob */
    size_t size;
};

/* Who gets the rows; false from `row` ends the question. Borrowed for the call. */
struct sql_reader {
    void *context;
    void (*names)(void *context, size_t columns, const char *const *name);
    bool (*row)(void *context, size_t columns, const struct sql_value *value);
};

struct sql_question {
    const char *file;
    const char *sql;  /* one statement that reads */
    double timeout_s; /* 0 = none */
};

/* reason (size bytes): what went wrong, in words. STORE_NOT_FOUND: there is no such file.
 * STORE_CONFLICT: the statement is wrong, or would change something. STORE_FULL: it took too long,
 * or too much.
 */
enum store_status store_sql_ask(const struct sql_question *question,
                                const struct sql_reader *reader, char *reason, size_t size);

/* The schema as its migrations say it, comments and all, and the view `jobs`; malloc'ed, NULL = out
 * of memory. */
char *store_sql_schema(void);

#endif
