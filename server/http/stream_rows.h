/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * stream_rows.h - a stream of text from a function that writes one row at a time: what it wrote is
 * handed out in whatever pieces the connection takes.
 */
#ifndef STREAM_ROWS_H
#define STREAM_ROWS_H

#include "http.h"
#include "text.h"

/* next appends the following row (a few KiB at best; nothing is fine too) and returns true; false
 * when there is none. Why it ended before its end, if it did: *failed = true. free ends `state`
 * once, sent or not. */
struct rows {
    bool (*next)(void *state, struct text *text, bool *failed);
    void (*free)(void *state); /* may be NULL */
    void *state;
};

/* Takes the rows over, whatever it returns: without memory for it they are freed, and the stream
 * is empty (read == NULL). */
struct stream stream_rows_take(const struct rows *rows);

#endif
