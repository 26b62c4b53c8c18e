/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * aside.h - requests that may take seconds (sweeps, and pictures of them) are answered by a thread
 * of their own, one after another, while their connections rest: the threads of http.c go on with
 * everybody else.
 *
 * THREADS  aside_answer may be called from any thread, the others from one.
 */
#ifndef ASIDE_H
#define ASIDE_H

#include "handle.h"

struct aside;

/* `name` of the thread. NULL = no memory, or no thread. */
struct aside *aside_create(const char *name);

/* What is being answered is answered to its end; what waits is refused, and so is what comes.
 * Accepts NULL. */
void aside_stop(struct aside *aside);

/* Stops. No hold of its replies may be left. Accepts NULL. */
void aside_free(struct aside *aside);

/* Has `handle` answer the call, which it gets a copy of: until that is done the reply is held, and
 * this is to be called again. One whose client has left is answered all the same. Refused when
 * LIMIT_ASIDE_MAX others wait. */
void aside_answer(struct aside *aside, handler *handle, const struct service *service,
                  const struct call *call, struct reply *reply);

#endif
