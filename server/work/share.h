/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * share.h - chunks lent through a directory (share_dir.h), to workers that cannot reach the daemon.
 * What is offered in lease.h is put there, and what workers put there is told to lease.h: to the
 * queue and to results it makes no difference which way a chunk went.
 *
 * What cannot be read goes to refused/, and the chunk's time runs out. A worker that is not heard
 * of for as long as a lease holds loses its chunk, and sees that by its file being gone.
 *
 * THREADS  One of its own, which alone touches the directory on this side.
 */
#ifndef SHARE_H
#define SHARE_H

#include "lease.h"

struct share;

/* lease_ms: as leases_create had it. NULL with words in reason: no such directory, or another
 * daemon uses it. */
struct share *share_start(const char *path, struct leases *leases, int64_t lease_ms, char *reason,
                          size_t size);

/* What workers have taken stays theirs: the next daemon takes it up. Accepts NULL. */
void share_stop(struct share *share);

#endif
