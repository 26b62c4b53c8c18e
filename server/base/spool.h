/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * spool.h - directories through which programs on several machines hand files to one another. A
 * file appears whole or not at all (written under another name, synced, renamed), and who renames
 * it away has it alone; both hold on network file systems, too. Names that begin with a dot are of
 * files that are being written, and nobody else's business.
 *
 * What is in a file may still be anything: who reads it checks it. Only regular files are read, and
 * no link is followed.
 */
#ifndef SPOOL_H
#define SPOOL_H

#include <stdbool.h>
#include <stddef.h>

enum { SPOOL_NAME_SIZE = 80 };

/* Whether a file may be called so: 1 to SPOOL_NAME_SIZE - 1 of a-z 0-9 - and dots within. */
bool spool_name_sound(const char *name);

/* Opens DIR/name, which is made if need be (for its owner and group); -1 and errno. */
int spool_open(int dir, const char *name);

/* False with errno. What had the name is replaced. */
bool spool_put(int dir, const char *name, const void *bytes, size_t size);

/* malloc'ed, with a NUL behind; NULL with errno: EFBIG = more than `most` bytes, EINVAL = no
 * regular file. */
char *spool_read(int dir, const char *name, size_t most, size_t *size);

/* Moves a file to where nobody else has it; false with errno (ENOENT: somebody was faster). */
bool spool_move(int from, const char *name, int to, const char *as);

/* Sound names of what is in it, sorted; *count = 0 and NULL when there are none, or it cannot be
 * read. malloc'ed in one piece. */
char (*spool_list(int dir, size_t *count))[SPOOL_NAME_SIZE];

/* Removes a file; that it is not there is no fault. */
void spool_remove(int dir, const char *name);

#endif
