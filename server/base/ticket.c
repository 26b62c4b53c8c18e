/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ticket.h"

#include <stdlib.h>

void ticket_fini(struct ticket *ticket)
{
    free(ticket->label);
    free(ticket->tags);
    ticket->label = ticket->tags = NULL;
}
