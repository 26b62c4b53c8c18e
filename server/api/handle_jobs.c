/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "job_admit.h"
#include "job_request.h"
#include "limits.h"
#include "record_json.h"
#include "reply.h"
#include "request_check.h"
#include "store_audit.h"
#include "store_jobs.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What ?wait= asks for: after which change, and how long at most. */
struct wait {
    uint64_t since;
    int64_t ms;
};

/* What an answer that is held looks at. */
struct waiting {
    struct feed *feed;
    uint64_t since;
    int64_t seq;
};

static bool must_wait(const struct service *service, const struct call *call,
                      const struct job_record *record, struct wait *wait);
static void hold(const struct service *service, int64_t seq, const struct wait *wait,
                 struct reply *reply);
static bool has_moved(void *state);
static void etag_of(const struct job_record *record, char etag[ETAG_SIZE]);
static char *print(const struct service *service, const struct job_record *record, int origin);

void handle_jobs_submit(const struct service *service, const struct call *call, struct reply *reply)
{
    struct ticket ticket = {0};
    struct job_new job = {.idempotency_key = call->request->idempotency_key,
                          .ticket = &ticket,
                          .by = &call->identity};
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    struct bcd_estimate estimate;
    struct job_record record = {0};
    bool existed = false;
    snprintf(ticket.owner, sizeof(ticket.owner), "%s", call->identity.owner);
    const char *force = call_query(call, "force");
    job.force = force && strcmp(force, "true") == 0;
    if (!request_check_key(call->request, reply) ||
        !job_request_read(call->request, &scene, &ticket, reply))
        return;
    calibration_estimate(NULL, scene, &estimate);
    job_admit_check(queue_limits(service->queue), &estimate, &errors);
    if (errors.count > 0) {
        char more[512];
        char *print = job_request_print_estimate(service, scene, NULL);
        snprintf(more, sizeof(more), "\"estimate\":%s", print ? print : "null");
        reply_faults(reply, PROBLEM_TOO_COSTLY, &errors, more);
        free(print);
        goto cleanup;
    }
    enum store_status status = STORE_BROKEN;
    job_request_estimate(service, scene, &estimate);
    if (job_admit_fill(scene, &estimate, &job))
        status = store_jobs_insert(service->store, &job, &record, &existed);
    if (status == STORE_CONFLICT) {
        reply_problem(reply, PROBLEM_KEY_REUSED,
                      "this Idempotency-Key came with another job before");
    } else if (status == STORE_QUOTA) {
        job_request_over_quota(service, ticket.owner,
                               &(struct quota_need){{1, job.core_seconds, job.bytes}}, reply);
    } else if (status != STORE_OK) {
        reply_store(reply, status, "the job was not taken");
    } else if (existed) {
        reply_json_take(reply, print(service, &record, RECORD_DEDUPLICATED));
    } else {
        char location[64];
        snprintf(location, sizeof(location), "/v1/jobs/%s", record.id);
        queue_take(service->queue, record.ticket.owner);
        reply_accepted_take(reply, location, print(service, &record, RECORD_NEW));
    }
cleanup:
    free((char *)job.job);
    free((char *)job.derived);
    job_record_fini(&record);
    ticket_fini(&ticket);
    bcd_scene_free(scene);
}

void handle_jobs_get(const struct service *service, const struct call *call, struct reply *reply)
{
    char etag[ETAG_SIZE];
    struct job_record record = {0};
    struct wait wait = {.since = service->feed ? feed_now(service->feed) : 0};
    enum store_status status = store_jobs_get(service->store, call->arg[0], &record);
    if (status != STORE_OK) {
        reply_store(reply, status, "such job");
    } else if (must_wait(service, call, &record, &wait)) {
        hold(service, record.seq, &wait, reply);
    } else if (record.finished_ms == 0) {
        reply_json_take(reply, print(service, &record, RECORD_PLAIN));
    } else {
        etag_of(&record, etag);
        if (!reply_unchanged(reply, call->request, etag))
            reply_json_take(reply, print(service, &record, RECORD_PLAIN));
        reply_revalidate(reply, etag);
    }
    job_record_fini(&record);
}

void handle_jobs_attempts(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct attempt *attempts = NULL;
    size_t count = 0;
    enum store_status status =
        store_attempts_list(service->store, call->arg[0], LIMIT_LIST_ROWS_MAX, &attempts, &count);
    if (status == STORE_OK)
        reply_json_take(reply, record_json_print_attempts(attempts, count));
    else
        reply_store(reply, status, "such job");
    attempts_free(attempts, count);
}

/* ?wait=SECONDS: until the job has ended. */
static bool must_wait(const struct service *service, const struct call *call,
                      const struct job_record *record, struct wait *wait)
{
    const char *seconds = call_query(call, "wait");
    if (!seconds || !service->feed || record->finished_ms != 0 || call->request->last)
        return false;
    wait->ms = (int64_t)(strtod(seconds, NULL) * 1000) - call->request->waited_ms;
    return wait->ms > 0;
}

/* The answer waits until the job has moved, or long enough. */
static void hold(const struct service *service, int64_t seq, const struct wait *wait,
                 struct reply *reply)
{
    struct waiting *waiting = malloc(sizeof(*waiting));
    if (!waiting) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
        return;
    }
    *waiting = (struct waiting){.feed = service->feed, .since = wait->since, .seq = seq};
    reply_hold_take(reply,
                    &(const struct hold){
                        .ready = has_moved, .free = free, .state = waiting, .wait_ms = wait->ms});
}

static bool has_moved(void *state)
{
    struct waiting *waiting = state;
    return feed_moved(waiting->feed, &waiting->since, waiting->seq);
}

/* Records of jobs that have ended stay as they are, in one version of this program. */
static void etag_of(const struct job_record *record, char etag[ETAG_SIZE])
{
    snprintf(etag, ETAG_SIZE, "%s-%" PRIx64 "-" BCD_VERSION, record->id, record->finished_ms);
}

/* Submitters cancel their own jobs, operators anybody's. */
static bool may_cancel(const struct service *service, const struct call *call, struct reply *reply)
{
    struct job_record record = {0};
    if (call->identity.role >= ROLE_OPERATOR)
        return true;
    enum store_status status = store_jobs_get(service->store, call->arg[0], &record);
    bool own = status == STORE_OK && strcmp(record.ticket.owner, call->identity.owner) == 0;
    if (status != STORE_OK)
        reply_store(reply, status, "such job");
    else if (!own)
        reply_problem(reply, PROBLEM_ROLE,
                      "job %s belongs to %s: only they, and operators, can cancel it", record.id,
                      record.ticket.owner);
    job_record_fini(&record);
    return own;
}

void handle_jobs_cancel(const struct service *service, const struct call *call, struct reply *reply)
{
    const char *id = call->arg[0];
    struct job_record record = {0};
    if (!may_cancel(service, call, reply))
        return;
    /* The store first: what it says stands, and the queue only saves the work. */
    enum store_status cancelled = store_jobs_cancel_by(service->store, id, &call->identity);
    if (cancelled == STORE_OK)
        queue_cancel(service->queue, id);
    enum store_status status = cancelled;
    if (cancelled == STORE_OK || cancelled == STORE_CONFLICT)
        status = store_jobs_get(service->store, id, &record);
    if (status != STORE_OK)
        reply_store(reply, status, "such job");
    else if (record.state == JOB_CANCELLED)
        reply_json_take(reply, print(service, &record, RECORD_PLAIN));
    else
        reply_problem(reply, PROBLEM_STATE, "job %s is %s already", id,
                      job_state_name(record.state));
    job_record_fini(&record);
}

void handle_jobs_estimate(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct ticket ticket = {0};
    struct bcd_scene *scene = NULL;
    snprintf(ticket.owner, sizeof(ticket.owner), "%s", call->identity.owner);
    if (job_request_read(call->request, &scene, &ticket, reply))
        reply_json_take(reply, job_request_print_estimate(service, scene, &ticket));
    ticket_fini(&ticket);
    bcd_scene_free(scene);
}

static char *print(const struct service *service, const struct job_record *record, int origin)
{
    const struct record_view view = {
        .record = record, .progress = job_request_progress(service, record), .origin = origin};
    return record_json_print(&view);
}
