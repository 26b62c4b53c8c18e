/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * aside.h - requests that may take seconds (sweeps, and pictures of them, theories, backups, long
 * results) are answered by threads of their own, one for each lane, one request after another,
 * while their connections rest: the threads of http.c go on with everybody else.
 *
 * THREADS  aside_answer may be called from any thread, the others from one.
 */
#ifndef ASIDE_H
#define ASIDE_H

#include "handle.h"

struct aside;

/* How a lane goes about it. */
struct aside_rules {
    const char *name;   /* of the thread */
    size_t waiting_max; /* requests beside the one being answered; then others are refused, */
    const char *full;   /* in these words */
    size_t owner_max;   /* of both together that one owner may have; 0 = any number. Then */
    const char *enough; /* this is said */
    bool ends;          /* what nobody waits for any more, and what is under way when the server
                         * stops, is told to stop (call->stop), or not even begun */
    int64_t ms_max;     /* then nobody waits for it any more; 0 = however long it takes */
    bool settles;       /* afterwards the store does what it has put off */
};
extern const struct aside_rules aside_rules[LANES];

/* The rules are borrowed. NULL = no memory, or no thread. */
struct aside *aside_create(const struct aside_rules *rules);

/* What is being answered is answered to its end, or told to stop; what waits is refused, and so is
 * what comes. Accepts NULL. */
void aside_stop(struct aside *aside);

/* Stops. No hold of its replies may be left. Accepts NULL. */
void aside_free(struct aside *aside);

/* Has `handle` answer the call, which it gets a copy of: until that is done the reply is held, and
 * this is to be called again. Refused where the rules say so. */
void aside_answer(struct aside *aside, handler *handle, const struct service *service,
                  const struct call *call, struct reply *reply);

#endif
