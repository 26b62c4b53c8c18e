/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * crew.h - threads that help one another with large rings (bcd.h, hands). A leader is a thread that
 * advances a run and takes help; a helper is one that has nothing else to do at the moment. Helpers
 * come when there is a leader and leave as soon as they are wanted elsewhere: a leader that is left
 * alone goes on alone, from one part of a step to the next, and nothing of it shows in the bits.
 *
 * THREADS  Any thread may help. A crew_lead belongs to the leading thread; others meet it through
 *          its atomics. Who waits for another looks for some ten microseconds first and sleeps
 *          then, so that a processor that somebody else needs is not kept.
 */
#ifndef CREW_H
#define CREW_H

#include "bcd.h"

#include <stdatomic.h>
#include <stddef.h>

struct crew;

/* For up to `leaders` at a time; NULL = no memory. */
struct crew *crew_create(size_t leaders);
void crew_free(struct crew *crew);

/* Takes help from now on, through the hands returned (borrowed); NULL = all places are taken. */
struct crew_lead;
struct crew_lead *crew_lead(struct crew *crew);
const struct bcd_hands *crew_hands(struct crew_lead *lead);

/* Processor time that helpers have spent since it was asked last. Any thread. */
int64_t crew_helped_ns(struct crew_lead *lead);

/* No help any more: waits until the helpers have let go. Accepts NULL. */
void crew_end(struct crew_lead *lead);

/* Helps whoever leads, the one with the fewest helpers first, until wanted(context); looks at that
 * once for each part of a step, and every few milliseconds. False = nobody leads. */
bool crew_help(struct crew *crew, bool (*wanted)(void *context), void *context);

#endif
