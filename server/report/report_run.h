/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_run.h - one job run on the calling thread and timed, for the reports that measure. Besides
 * worker.c and cli*.c the only place that moves runs.
 */
#ifndef REPORT_RUN_H
#define REPORT_RUN_H

#include "bcd.h"
#include "text.h"

#include <stdatomic.h>

enum report_outcome {
    REPORT_DONE,
    REPORT_REFUSED, /* the job is not accepted: error says why */
    REPORT_FAILED,  /* it was accepted, but did not end: error says why */
    REPORT_STOPPED, /* told to */
};

struct report_run {
    /* Given. */
    const atomic_int *stop; /* not 0 = stop; looked at every LIMIT_SLICE_MS; NULL = never */
    double core_seconds_max; /* then it has FAILED, error.code being BCD_OK; 0 = no limit */
    /* Results, to be ended with report_run_fini whatever the outcome was. */
    struct bcd_scene *scene;
    struct bcd_tally *tally; /* NULL unless DONE */
    double core_ns;          /* this thread's processor time within bcd_run_advance */
    struct bcd_error error;
};

/* Parses the job (JSON; NULL = out of memory) and runs it to its end. */
enum report_outcome report_run_job(struct report_run *run, const char *job);
/* The same of run->scene, which is prepared, and the run's from now on. */
enum report_outcome report_run_scene(struct report_run *run);
void report_run_fini(struct report_run *run);

/* ,"name":value - of a job or a report in the making, not its first member. */
void report_add_member(struct text *json, const char *name, double value);

/* A number that the engine derived from the completed job; NaN = there is none of that name. */
double report_run_fact(const struct bcd_scene *scene, const char *name);

/* The table of one observable, with exact values unless theory is NULL; NULL = the job has no such
 * observable, or out of memory. */
struct bcd_table *report_run_table(const struct report_run *run, const struct bcd_theory *theory,
                                   const char *observable);

/* Index of an observable among the scene's; -1 = not asked for. */
int report_run_observable(const struct bcd_scene *scene, const char *name);

/* Name of the index-th registered method, 0 = "auto"; NULL past the last. */
const char *report_run_method(size_t index);

#endif
