/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle.h - the handlers behind the routes: read the call, ask store and queue, fill the reply.
 *            What several share lies below them, in job_request.h and request_check.h.
 *
 * THREADS  Handlers run on the threads of http.c, several at once; what they share is store and
 *          queue, which take care of themselves.
 */
#ifndef HANDLE_H
#define HANDLE_H

#include "service.h"

typedef void handler(const struct service *service, const struct call *call, struct reply *reply);

/* handle_jobs.c */
handler handle_jobs_submit, handle_jobs_get, handle_jobs_attempts, handle_jobs_cancel;
handler handle_jobs_estimate;

/* handle_forecast.c */
handler handle_forecast;

/* handle_theory.c */
handler handle_theory;

/* handle_find.c */
handler handle_jobs_list;

/* handle_backup.c */
handler handle_backup;

/* handle_events.c */
handler handle_events_job, handle_events_all;

/* handle_sweeps.c */
handler handle_sweeps_submit, handle_sweeps_list, handle_sweeps_get, handle_sweeps_extend;
handler handle_sweeps_retry, handle_sweeps_cancel;

/* handle_sweep_results.c */
handler handle_sweep_results_json, handle_sweep_results_csv, handle_sweep_results_lines;
handler handle_sweep_results_npz, handle_sweep_results_svg;

/* handle_results.c */
handler handle_results_all, handle_results_json, handle_results_csv, handle_results_svg;

/* handle_people.c */
handler handle_people_token_create, handle_people_token_list, handle_people_token_revoke;
handler handle_people_me, handle_people_owners, handle_people_owner_put, handle_people_audit;

/* handle_leases.c */
handler handle_leases_take, handle_leases_hear, handle_leases_return;

/* handle_reports.c */
handler handle_reports_json, handle_reports_csv, handle_reports_svg, handle_reports_measure;
handler handle_reports_stop, handle_reports_list;
handler handle_stability_json, handle_stability_csv, handle_stability_svg, handle_stability_measure;
handler handle_stability_stop;

/* handle_page.c */
handler handle_page_index, handle_page_file, handle_page_scenes;

/* handle_service.c */
handler handle_service_index, handle_service_health, handle_service_ready;
handler handle_service_metrics; /* metrics.c */
handler handle_service_schema, handle_service_openapi;

#endif
