/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_link.h - how bcd worker and the daemon speak: over HTTP, or through a directory that both
 * see (share_dir.h). The words are the same JSON either way (lease_json.h).
 *
 * THREADS  One. A signal that ends the program makes waiting functions return.
 */
#ifndef WORKER_LINK_H
#define WORKER_LINK_H

#include "cli_server.h"
#include "lease_json.h"

struct link;

enum link_status {
    LINK_OK,      /* a chunk was lent; go on; taken */
    LINK_NOTHING, /* there is nothing to do, or what was returned is not wanted any more */
    LINK_STOP,    /* the chunk is somebody else's, or cancelled */
    LINK_UNKNOWN, /* the daemon does not know of it: it may have just started */
    LINK_AWAY,    /* the daemon is not to be reached */
    LINK_SIGNAL,
    LINK_REFUSED, /* the daemon or the directory says no: link_fault tells */
};

/* share: the directory, or NULL for HTTP by the options of `line`. CLI_OK, or the exit status with
 * words on stderr. */
int link_open(const struct cli_line *line, const char *share, struct link **link);
void link_free(struct link *link);

/* Sleeps; false when a signal came. */
bool link_wait(struct link *link, int64_t ms);

/* Asks for a chunk: OK and a loan to fini, NOTHING, AWAY, SIGNAL, REFUSED. */
enum link_status link_take(struct link *link, const char *worker, struct lease_loan *loan);

/* A heartbeat: OK, STOP, UNKNOWN, AWAY, SIGNAL, REFUSED. The last word about a chunk goes out even
 * if a signal came. */
enum link_status link_tell(struct link *link, const struct lease_loan *loan,
                           const struct lease_word *word, bool last);

/* The tally: OK, NOTHING, AWAY, REFUSED; whatever signal came. */
enum link_status link_return(struct link *link, const struct lease_loan *loan,
                             const struct lease_word *word);

/* After AWAY or REFUSED: words on stderr, and the exit status. `about` is a job, or NULL. */
int link_fault(struct link *link, const char *about);

/* ------------------------------------------------------------- worker_share.c */

struct share_dir;
/* LINK_REFUSED with words in reason. */
enum link_status worker_share_take(struct share_dir *dir, struct lease_loan *loan, char *reason,
                                   size_t size);
enum link_status worker_share_tell(struct share_dir *dir, const struct lease_loan *loan,
                                   const char *text, bool ended);

#endif
