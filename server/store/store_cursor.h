/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_cursor.h - places in a sorted list as opaque text: hexadecimal, with a checksum that covers
 * the sort, so that a cursor of another list or a made-up one is told from a good one. For store*.c
 * only.
 */
#ifndef STORE_CURSOR_H
#define STORE_CURSOR_H

#include "store_scalar.h"

/* One job's place. The text of value is owned, ended with free. */
struct place {
    struct scalar value; /* what is sorted by */
    int64_t seq;
};

/* malloc'ed; NULL = out of memory. `sort` names path and direction. */
char *cursor_print(const struct place *place, const char *sort);

/* False = none of this sort (or out of memory); place->value's text is the caller's to free. */
bool cursor_parse(const char *text, const char *sort, struct place *place);

#endif
