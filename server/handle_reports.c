/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "reply.h"
#include "text.h"

#include <stdlib.h>
#include <string.h>

#define HERE "/v1/reports/work-precision"

static void answer(const struct service *service, enum report_form form, struct reply *reply);
static char *print_state(double share);
static bool read_options(const struct request *request, struct work_precision_options *options,
                         struct reply *reply);

void handle_reports_json(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    (void)call;
    answer(service, REPORT_JSON, reply);
}

void handle_reports_csv(const struct service *service, const struct call *call, struct reply *reply)
{
    (void)call;
    answer(service, REPORT_CSV, reply);
}

void handle_reports_svg(const struct service *service, const struct call *call, struct reply *reply)
{
    (void)call;
    answer(service, REPORT_SVG, reply);
}

void handle_reports_measure(const struct service *service, const struct call *call,
                            struct reply *reply)
{
    struct work_precision_options options = WORK_PRECISION_SHORT;
    char reason[WORK_PRECISION_REASON];
    if (!service->reports) {
        reply_problem(reply, PROBLEM_BUSY, "this server measures no reports");
        return;
    }
    if (!read_options(call->request, &options, reply))
        return;
    if (report_keeper_progress(service->reports, reason) >= 0)
        reply_problem(reply, PROBLEM_STATE, "one is being measured already");
    else if (!report_keeper_begin(service->reports, &options))
        reply_problem(reply, PROBLEM_BUSY, "no thread can be had");
    else
        reply_later_take(reply, HERE, print_state(0));
}

/* The report if there is one; else it is being measured, from now on if not before. */
static void answer(const struct service *service, enum report_form form, struct reply *reply)
{
    static const char *const types[REPORT_FORMS] = {
        "application/json", "text/csv; charset=utf-8; header=present", "image/svg+xml"};
    char reason[WORK_PRECISION_REASON], *text = NULL;
    if (!service->reports) {
        reply_problem(reply, PROBLEM_BUSY, "this server measures no reports");
        return;
    }
    /* Before the store is asked: what ends in between is found there. */
    double share = report_keeper_progress(service->reports, reason);
    enum store_status status = report_keeper_get(service->reports, form, &text);
    if (status == STORE_OK) {
        reply_text_take(reply, types[form], text);
        return;
    }
    if (status != STORE_NOT_FOUND) {
        reply_store(reply, status, "report");
        return;
    }
    if (share < 0 && reason[0])
        reply_problem(reply, PROBLEM_BUSY, "the report could not be measured: %s", reason);
    else if (share < 0 && !report_keeper_begin(service->reports, &WORK_PRECISION_SHORT))
        reply_problem(reply, PROBLEM_BUSY, "no thread can be had");
    else
        reply_later_take(reply, HERE, print_state(share));
}

static char *print_state(double share)
{
    struct text json = {0};
    text_add(&json, "{\"state\":\"measuring\",\"progress\":");
    text_add_number(&json, share < 0 ? 0 : share);
    text_add(&json, "}\n");
    return text_take(&json);
}

/* ?budget= (core seconds an entry), ?scene=, ?method= */
static bool read_options(const struct request *request, struct work_precision_options *options,
                         struct reply *reply)
{
    struct bcd_errors errors = {0};
    for (size_t i = 0; i < request->query_count; i++) {
        const char *name = request->query[i].name, *value = request->query[i].value;
        char *end;
        if (strcmp(name, "budget") == 0) {
            options->core_seconds = strtod(value, &end);
            if (end == value || *end != '\0' ||
                !(options->core_seconds >= 0.001 && options->core_seconds <= 60))
                bcd_errors_add(&errors, name, "must be seconds from 0.001 to 60");
        } else if (strcmp(name, "scene") == 0) {
            options->scene = value;
        } else if (strcmp(name, "method") == 0) {
            options->method = value;
        } else {
            bcd_errors_add(&errors, name, "is not known here: budget, scene and method are");
        }
    }
    if (!work_precision_known(options))
        bcd_errors_add(&errors, options->scene ? "scene" : "method",
                       "there is no such scene or method");
    if (errors.count > 0)
        reply_faults(reply, PROBLEM_QUERY, &errors, NULL);
    return errors.count == 0;
}
