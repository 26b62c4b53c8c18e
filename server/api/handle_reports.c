/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "reply.h"
#include "text.h"

#include <stdlib.h>
#include <string.h>

#define HERE "/v1/reports/work-precision"

static void answer(const struct service *service, const struct call *call, enum report_form form,
                   struct reply *reply);
static void measure(const struct service *service, const struct work_precision_options *options,
                    struct reply *reply);
static char *print_state(const char *state, double share);

void handle_reports_json(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    answer(service, call, REPORT_JSON, reply);
}

void handle_reports_csv(const struct service *service, const struct call *call, struct reply *reply)
{
    answer(service, call, REPORT_CSV, reply);
}

void handle_reports_svg(const struct service *service, const struct call *call, struct reply *reply)
{
    answer(service, call, REPORT_SVG, reply);
}

void handle_reports_measure(const struct service *service, const struct call *call,
                            struct reply *reply)
{
    struct work_precision_options options = WORK_PRECISION_SHORT;
    const char *budget = call_query(call, "budget"); /* all else makes no whole report */
    if (budget)
        options.core_seconds = strtod(budget, NULL);
    if (!service->reports)
        reply_problem(reply, PROBLEM_BUSY, "this server measures no reports");
    else
        measure(service, &options, reply);
}

void handle_reports_stop(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    (void)call;
    if (!service->reports) {
        reply_problem(reply, PROBLEM_BUSY, "this server measures no reports");
        return;
    }
    double share = report_keeper_progress(service->reports, NULL);
    if (report_keeper_stop(service->reports))
        reply_text_take(reply, "application/json", print_state("stopping", share));
    else
        reply_problem(reply, PROBLEM_MEASURING, "none is being measured");
}

static void measure(const struct service *service, const struct work_precision_options *options,
                    struct reply *reply)
{
    switch (report_keeper_begin(service->reports, options)) {
    case REPORT_BEGUN:
        reply_later_take(reply, HERE, print_state("measuring", 0));
        break;
    case REPORT_BUSY:
        reply_problem(reply, PROBLEM_MEASURING, "one is being measured already");
        break;
    case REPORT_NO_THREAD:
        reply_problem(reply, PROBLEM_BUSY, "no thread can be had");
        break;
    }
}

/* The report if there is one; else it is being measured, from now on if not before. */
static void answer(const struct service *service, const struct call *call, enum report_form form,
                   struct reply *reply)
{
    static const char *const types[REPORT_FORMS] = {
        "application/json", "text/csv; charset=utf-8; header=present", "image/svg+xml"};
    const char *begin = call_query(call, "begin");
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
    if (share >= 0)
        reply_later_take(reply, HERE, print_state("measuring", share));
    else if (reason[0])
        reply_problem(reply, PROBLEM_BUSY, "the report could not be measured: %s", reason);
    else if (strcmp(call->request->method, "HEAD") == 0 || (begin && strcmp(begin, "false") == 0))
        reply_problem(reply, PROBLEM_NOT_FOUND, "there is no report yet: GET has it measured");
    else if (report_keeper_begin(service->reports, &WORK_PRECISION_SHORT) == REPORT_NO_THREAD)
        reply_problem(reply, PROBLEM_BUSY, "no thread can be had");
    else
        reply_later_take(reply, HERE, print_state("measuring", 0));
}

static char *print_state(const char *state, double share)
{
    struct text json = {0};
    text_add(&json, "{\"state\":\"%s\",\"progress\":", state);
    text_add_number(&json, share < 0 ? 0 : share);
    text_add(&json, "}\n");
    return text_take(&json);
}
