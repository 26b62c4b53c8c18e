/* SPDX-License-Identifier: GPL-3.0-or-later
 * watch.h - keeping a struct bcd_watch (bcd.h) informed. All functions accept NULL. */
#ifndef WATCH_H
#define WATCH_H

#include "bcd.h"

/* ns of a nominal core went, or are about to go; false = end it here. To be called at least every
 * few milliseconds. Once false, always false. */
bool watch_spend(struct bcd_watch *watch, double ns);

/* Memory that is about to be taken (or, negative, was given back); false = too much. */
bool watch_take(struct bcd_watch *watch, double bytes);

static inline bool watch_ended(const struct bcd_watch *watch)
{
    return watch && watch->end != BCD_WATCH_GOES_ON;
}

/* BCD_STOPPED, with words. */
enum bcd_status watch_stopped(const struct bcd_watch *watch, struct bcd_error *error);

#endif
