/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_print.h - sweeps as users see them. Functions return malloc'ed JSON text, NULL = no memory.
 */
#ifndef SWEEP_PRINT_H
#define SWEEP_PRINT_H

#include "store_sweeps.h"

/* The record; the answer to a submission says whether the sweep stood before, that to a retry how
 * many points are tried again. */
struct sweep_view {
    const struct sweep_record *record;
    enum { SWEEP_PLAIN, SWEEP_NEW, SWEEP_DEDUPLICATED, SWEEP_RETRIED } origin;
    int64_t retried;
};
char *sweep_print(const struct sweep_view *view);

/* {"sweeps":[..],"next":..}: records without base and axes, which can be long. */
char *sweep_print_list(const struct sweep_record *records, size_t count, int64_t next);

#endif
