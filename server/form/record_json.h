/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * record_json.h - jobs as users see them, the list of jobs, estimates. Functions return malloc'ed
 * JSON text, NULL = out of memory.
 */
#ifndef RECORD_JSON_H
#define RECORD_JSON_H

#include "bcd.h"
#include "store_attempts.h"
#include "text.h"

/* A record and what only the moment knows. */
struct record_view {
    const struct job_record *record;
    double progress;                                               /* 0..1 */
    enum { RECORD_PLAIN, RECORD_NEW, RECORD_DEDUPLICATED } origin; /* says so if not plain */
};
char *record_json_print(const struct record_view *view);

/* {"jobs":[...],"next":...}; next is the cursor of the page that follows, [a-z0-9]+, or NULL. */
char *record_json_print_list(const struct record_view *views, size_t count, const char *next);

/* {"attempts":[...]}. */
char *record_json_print_attempts(const struct attempt *attempts, size_t count);

/* What stands before a job that would be submitted now. */
struct record_ahead {
    double factor, measured_seconds; /* of calibration.h */
    int64_t jobs_before;
    double core_seconds_before;
    double finishes_in; /* seconds from now; of a server without workers infinity */
    int64_t now_ms;
    const char *derived; /* of the job: JSON, as scene_json_derived() gives it */
};

/* {"memory_bytes":..,"result_bytes":..,...}; of a job that this many chunks are made of. ahead may
 * be NULL. core_seconds are those of `estimate`, as they are. */
char *record_json_estimate(const struct bcd_estimate *estimate, int64_t chunks,
                           const struct record_ahead *ahead);

/* The end of a list and of its object, with the cursor of the page that follows: NULL, or a number
 * that is not above 0, for none. */
void record_json_end_page(struct text *text, const char *next);
void record_json_end_page_at(struct text *text, int64_t next);

/* ,"name":"2026-01-31T12:00:00.123Z" (UTC), null for 0. */
void record_json_add_time(struct text *text, const char *name, int64_t ms);

#endif
