/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_backup.h - a copy of the whole database as of one moment, made while it is in use, and
 * checked before it gets its name: integrity, foreign keys, as many rows in every table.
 *
 * A copy is put back by becoming DIR/bcd.sqlite of a directory without a -wal. A copy of the file
 * by other means is none: it lacks what is in the -wal.
 */
#ifndef STORE_BACKUP_H
#define STORE_BACKUP_H

#include "store.h"

#include <stdatomic.h>
#include <stdint.h>

struct backup {
    int64_t taken_ms; /* milliseconds since 1970 */
    int64_t bytes, schema, jobs, results;
    char sha256[65]; /* of the file, in hexadecimal digits */
    int fd;          /* of store_backup_open */
};

struct backup_plan {
    const char *from;       /* a database: of a daemon, running or not, or a backup */
    const char *to;         /* there must be no such file */
    const atomic_int *stop; /* not 0 = give up; may be NULL */
};

/* `to` is there, whole and on disk, when it returns STORE_OK, else nothing is (after a kill
 * -9, TO.partial, which the next try removes). STORE_CONFLICT: it is there already. STORE_FULL: the
 * disk has no room for it. reason (size bytes) says what is wrong in words. */
enum store_status store_backup_file(const struct backup_plan *plan, struct backup *backup,
                                    char *reason, size_t size);

/* The same of a store in use, into a file without a name: backup->fd is to be read and closed.
 * STORE_CONFLICT: another one is being made. */
enum store_status store_backup_open(struct store *store, const atomic_int *stop,
                                    struct backup *backup, char *reason, size_t size);

/* Removes what a backup left that was killed. When the directory is locked. */
void store_backup_tidy(const struct store *store);

#endif
