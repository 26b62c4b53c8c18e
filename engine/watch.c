/* SPDX-License-Identifier: GPL-3.0-or-later
 * watch.c - see watch.h. */
#include "watch.h"
#include "status.h"

/* Between two questions: little enough for whoever waits, much more than a question costs. */
#define ASKED_EVERY 0.01

bool watch_spend(struct bcd_watch *watch, double ns)
{
    if (!watch)
        return true;
    watch->seconds += 1e-9 * ns;
    if (watch->end)
        return false;
    if (watch->seconds_max > 0 && watch->seconds > watch->seconds_max) {
        watch->end = BCD_WATCH_SECONDS;
    } else if (watch->seconds - watch->asked >= ASKED_EVERY) {
        watch->asked = watch->seconds;
        if (watch->should_stop && watch->should_stop(watch->context))
            watch->end = BCD_WATCH_TOLD;
    }
    return watch->end == BCD_WATCH_GOES_ON;
}

bool watch_take(struct bcd_watch *watch, double bytes)
{
    if (!watch)
        return true;
    watch->bytes += bytes;
    watch->bytes_most = watch->bytes > watch->bytes_most ? watch->bytes : watch->bytes_most;
    if (!watch->end && watch->bytes_max > 0 && watch->bytes > watch->bytes_max)
        watch->end = BCD_WATCH_BYTES;
    return watch->end != BCD_WATCH_BYTES;
}

enum bcd_status watch_stopped(const struct bcd_watch *watch, struct bcd_error *error)
{
    switch (watch->end) {
    case BCD_WATCH_SECONDS:
        return error_set(error, BCD_STOPPED, "", "would take more than %g core seconds",
                         watch->seconds_max);
    case BCD_WATCH_BYTES:
        return error_set(error, BCD_STOPPED, "", "would take more than %g bytes of memory",
                         watch->bytes_max);
    default:
        return error_set(error, BCD_STOPPED, "", "was told to stop");
    }
}
