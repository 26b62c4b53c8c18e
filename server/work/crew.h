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

/* Takes help from now on, through the hands returned (borrowed), for a chunk of a job, whose name
 * helpers tell should they crash (crash.h). NULL = all places are taken, or there is no crew. */
struct crew_lead;
struct crew_lead *crew_lead(struct crew *crew, const char *job, int64_t chunk);
const struct bcd_hands *crew_hands(struct crew_lead *lead);

/* How long so many ticks took the leader, who lets it be known now and then: help that does not
 * make it faster, because others need the processors, is done without for a while. */
void crew_note(struct crew_lead *lead, int64_t ticks, int64_t elapsed_ns);

/* Processor time that helpers have spent since it was asked last. Accepts NULL. */
int64_t crew_helped_ns(struct crew_lead *lead);

/* No help any more: between two calls of the hands there is nothing that a helper could be at.
 * Accepts NULL. */
void crew_end(struct crew_lead *lead);

/* How many help at the moment. No crew: 0. */
size_t crew_helpers(struct crew *crew);

/* Helps whoever leads, the one with the fewest helpers first, until wanted(context); looks at that
 * once for each part of a step, and every few milliseconds. False = nobody leads. No crew: false.
 */
bool crew_help(struct crew *crew, bool (*wanted)(void *context), void *context);

#endif
