/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ticket.h"

#include "limits.h"

#include <stdlib.h>
#include <string.h>

void ticket_fini(struct ticket *ticket)
{
    free(ticket->label);
    free(ticket->tags);
    ticket->label = ticket->tags = NULL;
}

bool ticket_tag_sound(const char *tag)
{
    size_t length =
        strspn(tag, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-");
    return length > 0 && length <= LIMIT_TAG_BYTES_MAX && tag[length] == '\0';
}

bool ticket_label_sound(const char *label)
{
    size_t characters = 0;
    for (const char *c = label; *c; c++)
        characters += ((unsigned char)*c & 0xC0) != 0x80; /* not the rest of one */
    return characters > 0 && characters <= LIMIT_LABEL_CHARACTERS_MAX;
}
