/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * stream_events.h - Server-Sent Events from a function that writes what is new: paced, with a
 * comment now and then so that both ends and what is between them know that the other lives.
 */
#ifndef STREAM_EVENTS_H
#define STREAM_EVENTS_H

#include "http.h"
#include "text.h"

/* What follows a batch: nothing any more; others at their time; others that wait already, to be
 * asked for as soon as the client has taken this one. */
enum events_next { EVENTS_END, EVENTS_LATER, EVENTS_MORE };

/* next appends a batch of the events since the last call, if there are any. It is called at once,
 * after EVENTS_MORE, and else at most every LIMIT_EVENTS_GAP_MS when `fresh`, which must be quick:
 * see `ready` of struct stream. free ends `state` once. */
struct events {
    bool (*fresh)(void *state);
    enum events_next (*next)(void *state, struct text *text);
    void (*free)(void *state);
    void *state;
};

/* Takes the events over, whatever it returns: without memory they are freed, and the stream is
 * empty (read == NULL). */
struct stream stream_events_take(const struct events *events);

#endif
