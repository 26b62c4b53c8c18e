/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * share_dir.h - the directory through which a daemon lends chunks to workers that cannot reach it.
 * Below DIR, each file put there whole (spool.h):
 *
 *   offers/JOB.CHUNK.LEASE   the daemon's: a loan (lease_json.h). Who moves it
 *   taken/JOB.CHUNK.LEASE    here has the chunk, for as long as the daemon leaves it here
 *   words/LEASE              the worker's latest heartbeat; the daemon takes it away
 *   returns/LEASE            the worker's tally; the daemon takes it away
 *   refused/                 what could not be read: kept for whoever wants to know
 *
 * Tallies and checkpoints have their checksums with them (lease_json.h), so that half a file is
 * never taken for a whole one, whatever the file system does.
 */
#ifndef SHARE_DIR_H
#define SHARE_DIR_H

#include "lease_json.h"
#include "spool.h"

enum { SHARE_FILE_BYTES_MAX = 4 << 20 };

enum share_place { SHARE_OFFERS, SHARE_TAKEN, SHARE_WORDS, SHARE_RETURNS, SHARE_REFUSED };
enum { SHARE_PLACES = SHARE_REFUSED + 1 };

struct share_dir;
/* Makes what is below path if it is not there yet; path itself must be. NULL with words in
 * reason. */
struct share_dir *share_dir_open(const char *path, char *reason, size_t size);
void share_dir_free(struct share_dir *dir); /* accepts NULL */

int share_dir_at(const struct share_dir *dir, enum share_place place);
/* One daemon only: false when another has it. Held until the directory is freed. */
bool share_dir_lock(struct share_dir *dir);
/* The name of a loan's file, and back: what the name alone tells. */
void share_name(const struct lease_loan *loan, char name[SPOOL_NAME_SIZE]);
bool share_name_is(const char *name, const struct lease_loan *loan);
bool share_name_read(const char *name, struct lease_word *word);

#endif
