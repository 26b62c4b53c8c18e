/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_places.h - the first places of a sorted list, picked from places that come in any order.
 * For store*.c only.
 */
#ifndef STORE_PLACES_H
#define STORE_PLACES_H

#include "store_cursor.h"

struct places {
    bool descending;           /* by value; among equals the newest comes first */
    bool oldest_first;         /* not so */
    const struct place *after; /* only places behind this one; NULL = all */
    struct place *heap;        /* the worst of them first, until places_sort */
    size_t found, room;
};

/* False = out of memory. */
bool places_init(struct places *places, size_t room);
void places_fini(struct places *places);

/* < 0: a comes before b. */
int places_compare(const struct places *places, const struct place *a, const struct place *b);

/* The list is full, and this place is behind its end. */
bool places_behind(const struct places *places, const struct place *place);

/* Takes a place into the list if it belongs there; a text is copied. False = out of memory. */
bool places_offer(struct places *places, const struct place *place);

void places_sort(struct places *places);

#endif
