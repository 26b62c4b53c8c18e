/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * ticket.h - what hangs on a job beside its physics: whose it is, how people call it, how much it
 * hurries. Nothing here enters the hash: the same job is the same job whoever wants it.
 */
#ifndef TICKET_H
#define TICKET_H

#include "identity.h"

enum { TICKET_PRIORITY_MAX = 100 }; /* and -100 */

struct ticket {
    char owner[OWNER_SIZE];
    int priority;
    char *label; /* NULL = none */
    char *tags;  /* sorted, none twice, one space between two: [A-Za-z0-9._-]+; NULL = none */
};
void ticket_fini(struct ticket *ticket);

/* What can be a tag; what a label can be that says something. */
bool ticket_tag_sound(const char *tag);
bool ticket_label_sound(const char *label);

#endif
