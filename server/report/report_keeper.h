/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_keeper.h - the daemon's own report on error against run time: measured once, on request,
 * by one thread that yields to everything else, and kept in the store. What ends before it is done
 * leaves nothing behind; the next request begins again.
 *
 * THREADS  All functions but _free may be called from any thread.
 */
#ifndef REPORT_KEEPER_H
#define REPORT_KEEPER_H

#include "report_work_precision.h"
#include "store_reports.h"

struct report_keeper;

/* Borrows the store. NULL = out of memory. */
struct report_keeper *report_keeper_create(struct store *store);

/* Stops a measurement (within a slice, LIMIT_SLICE_MS, and a theory) and ends. Accepts NULL. */
void report_keeper_free(struct report_keeper *keeper);

/* The report in one form, malloc'ed, as far as this program measured it on this machine. */
enum store_status report_keeper_get(struct report_keeper *keeper, enum report_form form,
                                    char **text);

/* Begins a measurement. options->scene and method as work_precision_known left them. */
enum report_begun {
    REPORT_BEGUN,
    REPORT_BUSY, /* one is under way, or has not ended yet after _stop */
    REPORT_NO_THREAD,
};
enum report_begun report_keeper_begin(struct report_keeper *keeper,
                                      const struct work_precision_options *options);

/* Tells a measurement to stop: it ends soon and leaves no report. False = none is under way. */
bool report_keeper_stop(struct report_keeper *keeper);

/* How far it is, 0..1; negative = none is under way. `reason` then tells why the last one failed,
 * once; else it is "". [WORK_PRECISION_REASON], or NULL. */
double report_keeper_progress(struct report_keeper *keeper, char *reason);

#endif
