/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_keeper.h - the daemon's own reports, on error against run time and on what the methods do
 * at the extremes: measured once, on request, one at a time, by a thread that yields to others, and
 * kept in the store. What ends before it is done leaves nothing behind; the next request begins
 * again.
 *
 * THREADS  All functions but _free may be called from any thread.
 */
#ifndef REPORT_KEEPER_H
#define REPORT_KEEPER_H

#include "report_stability.h"
#include "report_work_precision.h"
#include "store_reports.h"

enum report_kind { REPORT_WORK_PRECISION, REPORT_STABILITY, REPORT_KINDS };
const char *report_kind_name(enum report_kind kind); /* "work-precision", "stability" */

struct report_keeper;

/* Borrows the store; `nice` is what its thread gets. NULL = out of memory. */
struct report_keeper *report_keeper_create(struct store *store, int nice);

/* Stops a measurement (within a slice, LIMIT_SLICE_MS, and a theory) and ends. Accepts NULL. */
void report_keeper_free(struct report_keeper *keeper);

/* The report in one form, malloc'ed, as far as this program measured it on this machine. */
enum store_status report_keeper_get(struct report_keeper *keeper, enum report_kind kind,
                                    enum report_form form, char **text);

/* When it was measured, ms since 1970; 0 = it was not. */
enum store_status report_keeper_when(struct report_keeper *keeper, enum report_kind kind,
                                     int64_t *created_ms);

/* Begins a measurement; `core_seconds` for each entry of work-precision, 0 = as many as is usual.
 */
enum report_begun {
    REPORT_BEGUN,
    REPORT_BUSY, /* one of any kind is under way, or has not ended yet after _stop */
    REPORT_NO_THREAD,
};
enum report_begun report_keeper_begin(struct report_keeper *keeper, enum report_kind kind,
                                      double core_seconds);

/* Tells a measurement to stop: it ends soon and leaves no report. False = none of that kind is
 * under way. */
bool report_keeper_stop(struct report_keeper *keeper, enum report_kind kind);

/* How far it is, 0..1; negative = none of that kind is under way. `reason` then tells why the last
 * one failed, once; else it is "". [WORK_PRECISION_REASON], or NULL. */
double report_keeper_progress(struct report_keeper *keeper, enum report_kind kind, char *reason);

/* What the measurement under way has found so far: a JSON list (malloc'ed); NULL = this kind has
 * nothing before its end, or no memory. */
char *report_keeper_so_far(struct report_keeper *keeper, enum report_kind kind);

#endif
