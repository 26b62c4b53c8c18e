/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle.h - the handlers behind the routes: read the call, ask store and queue, fill the reply.
 *
 * THREADS  Handlers run on the threads of http.c, several at once; what they share is store and
 *          queue, which take care of themselves.
 */
#ifndef HANDLE_H
#define HANDLE_H

#include "access.h"
#include "feed.h"
#include "http.h"
#include "identity.h"
#include "queue.h"
#include "report_keeper.h"
#include "store_jobs.h"
#include "store_owners.h"
#include "worker.h"

#include <stdatomic.h>

struct metrics;

enum { CALL_ARGS_MAX = 2, CALL_ARG_SIZE = 64 };

/* What the daemon consists of, as far as requests are concerned. Borrowed. */
struct service {
    struct store *store;
    struct queue *queue;
    struct access *access; /* NULL = everybody is OWNER_LOCAL, and may do everything */
    struct feed *feed;
    atomic_flag *theory;           /* set while one is computed; NULL = no limit */
    struct report_keeper *reports; /* NULL = there are none */
    struct workers *workers;       /* NULL = there are none */
    struct metrics *metrics;       /* NULL = nothing is counted */
    _Atomic(struct http *) http;   /* NULL until it is there */
};

/* A request that met its route; arg[i] is what stood in the place of the pattern's i-th {...}. */
struct call {
    const struct request *request;
    struct identity identity; /* who asks */
    char arg[CALL_ARGS_MAX][CALL_ARG_SIZE];
};

/* A query parameter, NULL when it was not given. What the route's row says of it holds: a word is
 * one of its words, a number within its range. */
const char *call_query(const struct call *call, const char *name);

typedef void handler(const struct service *service, const struct call *call, struct reply *reply);

/* handle_jobs.c */
handler handle_jobs_submit, handle_jobs_get, handle_jobs_cancel;
handler handle_jobs_estimate, handle_jobs_theory;

/* The body as a finished scene; false with the reply filled when it is none. ticket may be NULL. */
bool handle_jobs_read(const struct request *request, struct bcd_scene **scene,
                      struct ticket *ticket, struct reply *reply);

/* handle_estimate.c: what a job needs, core seconds as this machine takes them; as JSON, with what
 * goes before it when it is known whose it is (ticket may be NULL). */
void handle_estimate(const struct service *service, const struct bcd_scene *scene,
                     struct bcd_estimate *estimate);
char *handle_estimate_print(const struct service *service, const struct bcd_scene *scene,
                            const struct ticket *ticket);

/* 0..1: the queue knows of chunks in motion, the record of those put away. */
double handle_jobs_progress(const struct service *service, const struct job_record *record);

/* handle_find.c */
handler handle_jobs_list;

/* handle_backup.c */
handler handle_backup;

/* handle_events.c */
handler handle_events_job, handle_events_all;

/* Holds the answer until the job's state has changed after change number `since`, or `ms`. */
struct wait {
    uint64_t since;
    int64_t ms;
};
void handle_events_hold(const struct service *service, int64_t seq, const struct wait *wait,
                        struct reply *reply);

/* handle_sweeps.c */
handler handle_sweeps_submit, handle_sweeps_list, handle_sweeps_get, handle_sweeps_extend;
handler handle_sweeps_retry, handle_sweeps_cancel;

/* handle_sweep_results.c */
handler handle_sweep_results_json, handle_sweep_results_csv, handle_sweep_results_lines;
handler handle_sweep_results_npz, handle_sweep_results_svg;

/* handle_results.c */
handler handle_results_all, handle_results_json, handle_results_csv, handle_results_svg;

/* Says which quota of the owner this is beyond, after STORE_QUOTA. */
void handle_people_quota(const struct service *service, const char *owner,
                         const struct quota_need *need, struct reply *reply);

/* handle_people.c */
handler handle_people_token_create, handle_people_token_list, handle_people_token_revoke;
handler handle_people_me, handle_people_owners, handle_people_owner_put, handle_people_audit;

/* handle_reports.c */
handler handle_reports_json, handle_reports_csv, handle_reports_svg, handle_reports_measure;
handler handle_reports_stop;

/* handle_service.c */
handler handle_service_index, handle_service_health, handle_service_ready;
handler handle_service_metrics; /* metrics.c */
handler handle_service_schema, handle_service_openapi;

#endif
