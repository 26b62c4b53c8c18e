/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * ticket_json.h - "label", "tags" and "priority" of a submission, beside the job's physics.
 */
#ifndef TICKET_JSON_H
#define TICKET_JSON_H

#include "bcd.h"
#include "text.h"
#include "ticket.h"

struct json_t;

/* Takes those keys out of `object`, whatever they hold, and fills label, tags and priority; the
 * owner stays. Faults (wrong types, too long, too many) go to errors with the key as pointer. The
 * caller ends the ticket with ticket_fini, also after faults. */
void ticket_json_take(struct json_t *object, struct ticket *ticket, struct bcd_errors *errors);

/* "owner":..,"label":..,"tags":[..],"priority":.. without braces. */
void ticket_json_add(struct text *text, const struct ticket *ticket);

/* "label":{..},"tags":{..},"priority":{..}: what they may be, as JSON Schema, without braces. */
void ticket_json_add_schema(struct text *text);

#endif
