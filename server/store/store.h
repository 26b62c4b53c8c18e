/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store.h - everything that outlives the process: one SQLite database, DIR/bcd.sqlite.
 *
 * THREADS  Every store_* function may be called from any thread. Exactly one connection writes and
 *          checkpoints, behind a mutex; readers take read-only connections from a small pool.
 * ERRORS   enum store_status; the cause goes to the log with statement and extended code.
 * MEMORY   Outputs are malloc'ed and owned by the caller; _fini functions free what a struct holds.
 */
#ifndef STORE_H
#define STORE_H

#include <stddef.h>

enum store_status {
    STORE_OK,
    STORE_NOT_FOUND, /* no such row */
    STORE_CONFLICT,  /* the row is not in a state that allows this */
    STORE_QUOTA,     /* the owner would be beyond a quota: nothing was changed */
    STORE_FULL,      /* the disk (or a limit on it) is full: nothing was changed */
    STORE_BROKEN,    /* anything else: I/O error, corruption, our own mistake */
};

struct store;

/* Opens DIR/bcd.sqlite, creating DIR and schema when missing, migrating older schemas (after a
 * backup beside it). Refuses a second daemon on the same directory (lock on a separate file), a
 * newer schema, a database that is not ours and a network file system; `reason` (size bytes) then
 * says so in words for the operator. */
enum store_status store_open(struct store **store, const char *dir, char *reason, size_t size);

/* Where a file of this name stands beside the database: malloc'ed, NULL = no memory. */
char *store_beside(const struct store *store, const char *name);

/* Ends all connections; the last one checkpoints. Accepts NULL. */
void store_close(struct store *store);

#endif
