/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle_sweeps.c - sweeps are submitted, looked at, extended, tried again and cancelled. A large
 * one takes seconds on a thread that has other connections to serve.
 */
#include "handle.h"
#include "job_request.h"
#include "limits.h"
#include "reply.h"
#include "request_check.h"
#include "scene_json.h"
#include "sweep_make.h"
#include "sweep_print.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool sound(struct sweep_make *make, struct reply *reply);
static void keep(const struct service *service, const struct sweep *sweep, struct sweep_make *make,
                 struct sweep_new *kept, struct reply *reply);
static void answer(struct reply *reply, const struct sweep_view *view);
static void extend(const struct service *service, const struct call *call,
                   const struct sweep_record *record, struct sweep *sweep, struct reply *reply);
static bool find_own(const struct service *service, const struct call *call,
                     struct sweep_record *record, struct reply *reply);

void handle_sweeps_submit(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    const struct request *request = call->request;
    struct bcd_errors errors = {0};
    struct ticket ticket = {0};
    struct sweep *sweep = NULL;
    if (!request_check_json(request, reply) || !request_check_key(request, reply))
        return;
    snprintf(ticket.owner, sizeof(ticket.owner), "%s", call->identity.owner);
    enum bcd_status status =
        sweep_json_parse(request->body, request->body_size, &sweep, &ticket, &errors);
    if (status != BCD_OK) {
        reply_bcd(reply, status, &errors);
        return;
    }
    struct sweep_make *make = sweep_make_create(sweep, service->queue, ticket.owner);
    if (sound(make, reply)) {
        struct sweep_new kept = {.ticket = &ticket,
                                 .by = &call->identity,
                                 .idempotency_key = request->idempotency_key,
                                 .source = sweep_make_source(make)};
        keep(service, sweep, make, &kept, reply);
    }
    sweep_make_free(make);
    sweep_free(sweep);
    ticket_fini(&ticket);
}

void handle_sweeps_list(const struct service *service, const struct call *call, struct reply *reply)
{
    const char *limit = call_query(call, "limit"), *cursor = call_query(call, "cursor");
    size_t rows = limit ? strtoul(limit, NULL, 10) : LIMIT_LIST_ROWS_DEFAULT, count = 0;
    struct sweep_record *records = NULL;
    struct bcd_errors errors = {0};
    char *end = NULL;
    int64_t before = cursor ? strtoll(cursor, &end, 10) : 0;
    if (cursor && (before < 1 || *end || cursor[0] < '1' || cursor[0] > '9')) {
        bcd_errors_add(&errors, "cursor", "must be the \"next\" of a page before, not \"%.40s\"",
                       cursor);
        reply_faults(reply, PROBLEM_QUERY, &errors, NULL);
        return;
    }
    enum store_status status = store_sweeps_list(service->store, call_query(call, "owner"), before,
                                                 rows + 1, &records, &count);
    if (status != STORE_OK) {
        reply_store(reply, status, "list of sweeps");
        return;
    }
    size_t shown = count > rows ? rows : count;
    reply_json_take(reply,
                    sweep_print_list(records, shown, count > rows ? records[shown - 1].seq : 0));
    sweep_records_free(records, count);
}

void handle_sweeps_get(const struct service *service, const struct call *call, struct reply *reply)
{
    struct sweep_record record = {0};
    enum store_status status = store_sweeps_get(service->store, call->arg[0], &record);
    if (status == STORE_OK)
        answer(reply, &(const struct sweep_view){.record = &record});
    else
        reply_store(reply, status, "such sweep");
    sweep_record_fini(&record);
}

void handle_sweeps_extend(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct sweep_record record = {0};
    struct bcd_errors errors = {0};
    if (!request_check_json(call->request, reply) || !find_own(service, call, &record, reply))
        return;
    struct sweep *sweep = sweep_json_restore(record.base, record.axes, record.zip);
    enum bcd_status status =
        sweep ? sweep_json_extend(sweep, call->request->body, call->request->body_size, &errors)
              : BCD_NO_MEMORY;
    if (status != BCD_OK)
        reply_bcd(reply, status, &errors);
    else if (sweep_points_new(sweep) == 0)
        answer(reply, &(const struct sweep_view){.record = &record});
    else
        extend(service, call, &record, sweep, reply);
    sweep_free(sweep);
    sweep_record_fini(&record);
}

/* A job of an earlier version under this one. */
static bool renew(void *context, const char *text, struct job_new *job)
{
    struct bcd_errors errors = {0};
    struct bcd_estimate estimate;
    struct bcd_scene *scene = NULL;
    if (scene_json_complete(text, strlen(text), NULL, &scene, &errors) != BCD_OK)
        return false;
    calibration_estimate(queue_calibration(context), scene, &estimate);
    bool made = job_admit_fill(scene, &estimate, job);
    bcd_scene_free(scene);
    return made;
}

void handle_sweeps_retry(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    struct sweep_record record = {0};
    struct sweep_retry retry = {.by = &call->identity, .renew = renew, .context = service->queue};
    const char *cancelled = call_query(call, "cancelled");
    retry.cancelled = cancelled && strcmp(cancelled, "true") == 0;
    if (!find_own(service, call, &record, reply))
        return;
    enum store_status status = store_sweeps_retry(service->store, record.id, &retry);
    if (status == STORE_OK && retry.count > 0)
        queue_take(service->queue, record.ticket.owner);
    if (status == STORE_QUOTA)
        job_request_over_quota(service, record.ticket.owner, &retry.need, reply);
    sweep_record_fini(&record);
    if (status == STORE_QUOTA)
        return;
    if (status == STORE_OK)
        status = store_sweeps_get(service->store, call->arg[0], &record);
    if (status == STORE_OK)
        answer(reply, &(const struct sweep_view){
                          .record = &record, .origin = SWEEP_RETRIED, .retried = retry.count});
    else if (status == STORE_CONFLICT)
        reply_problem(reply, PROBLEM_STATE, "sweep %s was cancelled", call->arg[0]);
    else
        reply_store(reply, status, "such sweep");
    sweep_record_fini(&record);
}

void handle_sweeps_cancel(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct sweep_record record = {0};
    char(*running)[JOB_ID_SIZE] = NULL;
    size_t count = 0;
    if (!find_own(service, call, &record, reply))
        return;
    sweep_record_fini(&record);
    /* The store first, as for jobs. Cancelled before is as good. */
    enum store_status status =
        store_sweeps_cancel(service->store, call->arg[0], &call->identity, &running, &count);
    for (size_t i = 0; i < count; i++)
        queue_cancel(service->queue, running[i]);
    free(running);
    if (status == STORE_OK || status == STORE_CONFLICT)
        status = store_sweeps_get(service->store, call->arg[0], &record);
    if (status == STORE_OK)
        answer(reply, &(const struct sweep_view){.record = &record});
    else
        reply_store(reply, status, "such sweep");
    sweep_record_fini(&record);
}

/* False with the reply saying which points cannot be accepted, if that is known. */
static bool sound(struct sweep_make *make, struct reply *reply)
{
    struct bcd_errors errors = {0};
    enum bcd_status status = make ? sweep_make_check(make, &errors) : BCD_NO_MEMORY;
    if (status != BCD_OK)
        reply_bcd(reply, status, &errors);
    return status == BCD_OK;
}

static void keep(const struct service *service, const struct sweep *sweep, struct sweep_make *make,
                 struct sweep_new *kept, struct reply *reply)
{
    struct sweep_record record = {0};
    struct quota_need need = {{0}};
    bool existed = false;
    char *base = sweep_json_base(sweep), *axes = sweep_json_axes(sweep);
    char *zip = sweep_json_zip(sweep);
    enum store_status status = STORE_BROKEN;
    kept->base = base;
    kept->axes = axes;
    kept->zip = zip;
    kept->need = &need;
    if (base && axes && zip)
        status = store_sweeps_insert(service->store, kept, &record, &existed);
    if (status == STORE_CONFLICT) {
        if (sound(make, reply))
            reply_problem(reply, PROBLEM_KEY_REUSED,
                          "this Idempotency-Key came with something else before");
    } else if (status == STORE_QUOTA) {
        job_request_over_quota(service, kept->ticket->owner, &need, reply);
    } else if (status != STORE_OK) {
        reply_store(reply, status, "the sweep was not taken");
    } else {
        const struct sweep_view view = {.record = &record,
                                        .origin = existed ? SWEEP_DEDUPLICATED : SWEEP_NEW};
        answer(reply, &view);
        if (!existed)
            queue_take(service->queue, record.ticket.owner);
    }
    sweep_record_fini(&record);
    free(base);
    free(axes);
    free(zip);
}

/* 202 when there is something new to be run. */
static void answer(struct reply *reply, const struct sweep_view *view)
{
    char *json = sweep_print(view);
    char location[64];
    snprintf(location, sizeof(location), "/v1/sweeps/%s", view->record->id);
    if (view->origin == SWEEP_NEW || (view->origin == SWEEP_RETRIED && view->retried > 0))
        reply_accepted_take(reply, location, json);
    else
        reply_json_take(reply, json);
}

static void extend(const struct service *service, const struct call *call,
                   const struct sweep_record *record, struct sweep *sweep, struct reply *reply)
{
    struct sweep_record grown = {0};
    struct quota_need need = {{0}};
    struct sweep_make *make = sweep_make_create(sweep, service->queue, record->ticket.owner);
    char *axes = sweep_json_axes(sweep);
    enum store_status status = STORE_BROKEN;
    if (!sound(make, reply))
        goto cleanup;
    const struct sweep_extension more = {.axes = axes,
                                         .by = &call->identity,
                                         .had = record->points,
                                         .source = sweep_make_source(make),
                                         .need = &need};
    if (axes)
        status = store_sweeps_extend(service->store, record->id, &more, &grown);
    if (status == STORE_CONFLICT) {
        if (sound(make, reply))
            reply_problem(reply, PROBLEM_STATE,
                          "sweep %s was cancelled, or extended by somebody else meanwhile",
                          record->id);
    } else if (status == STORE_QUOTA) {
        job_request_over_quota(service, record->ticket.owner, &need, reply);
    } else if (status != STORE_OK) {
        reply_store(reply, status, "the sweep was not extended");
    } else {
        queue_take(service->queue, grown.ticket.owner);
        answer(reply, &(const struct sweep_view){.record = &grown, .origin = SWEEP_NEW});
    }
cleanup:
    free(axes);
    sweep_make_free(make);
    sweep_record_fini(&grown);
}

/* A sweep that is the caller's, or anybody's for operators. */
static bool find_own(const struct service *service, const struct call *call,
                     struct sweep_record *record, struct reply *reply)
{
    enum store_status status = store_sweeps_get(service->store, call->arg[0], record);
    if (status != STORE_OK) {
        reply_store(reply, status, "such sweep");
        return false;
    }
    if (call->identity.role >= ROLE_OPERATOR ||
        strcmp(record->ticket.owner, call->identity.owner) == 0)
        return true;
    reply_problem(reply, PROBLEM_ROLE, "sweep %s is of %s; changing it needs role operator",
                  record->id, record->ticket.owner);
    sweep_record_fini(record);
    return false;
}
