/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * event_lines.h - reads a stream of Server-Sent Events piece by piece, wherever it was cut.
 */
#ifndef EVENT_LINES_H
#define EVENT_LINES_H

#include "text.h"

enum { EVENT_NAME_SIZE = 32, EVENT_DATA_BYTES_MAX = 1 << 20 };

struct event_lines {
    /* One event; data lines are joined by newlines. */
    void (*take)(void *context, const char *name, const char *data);
    void *context;
    struct text line, data; /* in progress; initially empty */
    char name[EVENT_NAME_SIZE];
    bool any_data;
};

/* False when it is no event stream: a line without end, or no memory. */
bool event_lines_add(struct event_lines *lines, const char *bytes, size_t size);
void event_lines_fini(struct event_lines *lines);

#endif
