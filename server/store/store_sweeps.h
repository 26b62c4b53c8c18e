/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_sweeps.h - sweeps, their points and what becomes of them; the jobs themselves are those of
 * store_jobs.h. A point whose job stands already has that one. See store.h for threads, errors and
 * memory.
 */
#ifndef STORE_SWEEPS_H
#define STORE_SWEEPS_H

#include "store_jobs.h"
#include "store_owners.h"

/* A row as users see it; axes, zip and base are JSON as sweep_json.h prints it. */
struct sweep_record {
    int64_t seq; /* the keyset cursor */
    char id[JOB_ID_SIZE];
    struct ticket ticket;
    int64_t submitted_ms, cancelled_ms; /* 0 = was not */
    int64_t points, counts[JOB_STATES];
    char *base, *axes, *zip;
};
void sweep_record_fini(struct sweep_record *record);

struct sweep_point_new {
    struct job_new job; /* ticket, key and force do not count: the sweep's ticket is that of all */
    const char *place;
};

/* Points that are still being made, `count` in all. take gives the next of them in order, 0 after
 * the last, and borrows them until it is called again; `hash`, what makes a sweep the same, is
 * there after that. Anything but STORE_OK: one cannot be made, and nothing is kept. */
struct sweep_source {
    enum store_status (*take)(void *state, const struct sweep_point_new **points, size_t *count);
    void *state;
    size_t count;
    const unsigned char *hash;
};

struct sweep_new {
    const char *base, *axes, *zip;
    const struct ticket *ticket;
    const char *idempotency_key; /* NULL = none */
    const struct identity *by;   /* for the audit log, here and below; NULL = no line */
    const struct sweep_source *source;
    struct quota_need *need; /* filled in where it is too much: STORE_QUOTA. NULL = not wanted */
};

/* The whole sweep on disk in one transaction when it returns STORE_OK. *existed: the same sweep
 * stands, not cancelled, and the record is that one. Keys as for jobs (store_jobs_insert), with
 * which they share their names. */
enum store_status store_sweeps_insert(struct store *store, const struct sweep_new *sweep,
                                      struct sweep_record *record, bool *existed);

enum store_status store_sweeps_get(struct store *store, const char *id,
                                   struct sweep_record *record);

/* Newest first, seq < before_seq (0 = from the newest). owner NULL = all. */
enum store_status store_sweeps_list(struct store *store, const char *owner, int64_t before_seq,
                                    size_t limit, struct sweep_record **records, size_t *count);
void sweep_records_free(struct sweep_record *records, size_t count);

/* More points, and the axes as they are now. STORE_CONFLICT when the sweep was cancelled or has
 * been extended meanwhile: `had` is how many points the caller knew. */
struct sweep_extension {
    const char *axes;
    const struct identity *by;
    int64_t had;
    const struct sweep_source *source;
    struct quota_need *need;
};
enum store_status store_sweeps_extend(struct store *store, const char *id,
                                      const struct sweep_extension *more,
                                      struct sweep_record *record);

/* Points whose jobs failed, or were cancelled by themselves if that is wanted, get new ones:
 * `count` of them. Those that failed as JOB_OUTDATED are
 * made anew by `renew` from their text, as by job_admit_fill; where it cannot, they are tried as
 * they were. STORE_CONFLICT = the sweep was cancelled. STORE_QUOTA fills in `need`. */
struct sweep_retry {
    const struct identity *by;
    bool cancelled; /* those, too */
    bool (*renew)(void *context, const char *text, struct job_new *job); /* may be NULL */
    void *context;
    int64_t count;
    struct quota_need need;
};
enum store_status store_sweeps_retry(struct store *store, const char *id,
                                     struct sweep_retry *retry);

/* Cancels the sweep and those of its jobs that have not ended and that nobody else wants: no other
 * sweep that was not cancelled, no one who submitted the job by itself. *running: ids of those that
 * ran, malloc'ed. STORE_CONFLICT when it was cancelled before, and all of its jobs were, too: they
 * are by the thousands, in transactions of their own after that of the sweep. */
enum store_status store_sweeps_cancel(struct store *store, const char *id,
                                      const struct identity *by, char (**running)[JOB_ID_SIZE],
                                      size_t *count);

/* Cancels what was to be cancelled with a sweep when the server ended: at the start. */
enum store_status store_sweeps_resume(struct store *store);

/* A page of points, in order, beginning with `first`, at most `limit`: fewer = there are no more.
 * With the table of one observable where the job has it (else NULL, 0). */
struct sweep_point {
    int64_t point, job_seq;
    char job[JOB_ID_SIZE];
    enum job_state state;
    char *place;
    void *table;
    size_t table_size;
};
void sweep_points_free(struct sweep_point *points, size_t count);
enum store_status store_sweeps_points(struct store *store, int64_t sweep, int64_t first,
                                      const char *observable, size_t limit,
                                      struct sweep_point **points, size_t *count);

#endif
