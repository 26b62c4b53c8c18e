/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * job_request.h - what several handlers do with a job: read one from a request, tell what it will
 * need and how far it is, refuse it.
 */
#ifndef JOB_REQUEST_H
#define JOB_REQUEST_H

#include "bcd.h"
#include "service.h"

/* The body as a completed scene; false with the reply filled when it is none. ticket may be NULL.
 * Whether its equilibrium starts can be drawn, if it has such, is left to the start of the job
 * where it would take more than LIMIT_PREPARE_SECONDS_MAX to find out. */
bool job_request_read(const struct request *request, struct bcd_scene **scene,
                      struct ticket *ticket, struct reply *reply);

/* What a job needs, core seconds as this machine takes them; as JSON, with what goes before it when
 * it is known whose it is (ticket may be NULL). */
void job_request_estimate(const struct service *service, const struct bcd_scene *scene,
                          struct bcd_estimate *estimate);
char *job_request_print_estimate(const struct service *service, const struct bcd_scene *scene,
                                 const struct ticket *ticket);

/* Says which quota of the owner this is beyond, after STORE_QUOTA. */
void job_request_over_quota(const struct service *service, const char *owner,
                            const struct quota_need *need, struct reply *reply);

/* 0..1: the queue knows of chunks in motion, the record of those put away. */
double job_request_progress(const struct service *service, const struct job_record *record);

#endif
