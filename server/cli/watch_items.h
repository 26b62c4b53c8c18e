/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * watch_items.h - jobs and sweeps that are followed: what is known of each, and how it is shown.
 */
#ifndef WATCH_ITEMS_H
#define WATCH_ITEMS_H

#include "answer_json.h"
#include "cli_words.h"

struct watch_item {
    const char *id; /* borrowed */
    bool sweep, ended, good;
    char state[16]; /* a sweep's: "running" until all of it has ended */
    char *error;    /* why it failed, or NULL */
    double progress, jobs, jobs_done, jobs_failed, jobs_cancelled; /* counts of a sweep */
    int64_t started_ms, finished_ms;                               /* 0 = unknown */
    double first_progress;                                         /* when it was first seen */
    int64_t first_ms;
    int64_t asked_ms;    /* when its record was last had */
    bool stale;          /* something happened since */
    char said_state[16]; /* what plain lines said last */
    int said_tenths;
};
void watch_item_fini(struct watch_item *item);

/* Takes over what a record of the server says. */
void watch_item_read(struct watch_item *item, const struct answer *record);
/* A job's progress by an event, 0..1. */
void watch_item_progress(struct watch_item *item, double progress);

/* A line on stdout when there is something new to say: another state, another tenth. */
void watch_item_say(struct watch_item *item);

/* Draws all of them over what was drawn before; *lines is how many lines that took, initially 0.
 * `remark` (may be NULL) stands below. */
void watch_items_draw(const struct cli_screen *screen, const struct watch_item *items, size_t count,
                      const char *remark, size_t *lines);

#endif
