/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * theory_keeper.h - exact theory on request: by a thread of its own, one at a time, and the latest
 * one kept for whoever asks for it once more. Under LIMIT_THEORY_ANSWER_SECONDS_MAX; ended when
 * nobody waits for it any more.
 *
 * THREADS  All functions but create and free may be called from any thread.
 */
#ifndef THEORY_KEEPER_H
#define THEORY_KEEPER_H

#include "queue.h"

struct theory_keeper;

/* Borrows the queue (for its theories and calibration). NULL = no memory. */
struct theory_keeper *theory_keeper_create(struct queue *queue);
/* Ends what is being computed: within a tenth of a second or so. Accepts NULL. */
void theory_keeper_free(struct theory_keeper *keeper);

/* `wake` is called, from another thread, when a theory has come to its end. NULL = nobody.
 * Accepts no keeper. */
void theory_keeper_wake(struct theory_keeper *keeper, void (*wake)(void *context), void *context);

/* The theory of a completed scene, which stays the caller's, as JSON (malloc'ed). */
enum theory_state {
    THEORY_READY,     /* here it is */
    THEORY_COMPUTING, /* this one, begun now or before */
    THEORY_BUSY,      /* another one */
    THEORY_FAILED,    /* no memory */
};
enum theory_state theory_keeper_ask(struct theory_keeper *keeper, const struct bcd_scene *scene,
                                    char **text);

/* Somebody waits for what is being computed, until _leave. NULL = no memory. */
void *theory_keeper_wait(struct theory_keeper *keeper);
bool theory_keeper_moved(void *waiting); /* it has come to its end */
void theory_keeper_leave(void *waiting);

#endif
