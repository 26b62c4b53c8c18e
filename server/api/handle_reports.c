/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "record_json.h"
#include "reply.h"
#include "text.h"

#include <stdlib.h>
#include <string.h>

#define HERE "/v1/reports/"

static bool there(const struct service *service, struct reply *reply);
static void answer(const struct service *service, const struct call *call, enum report_kind kind,
                   enum report_form form, struct reply *reply);
static void measure(const struct service *service, enum report_kind kind, double core_seconds,
                    struct reply *reply);
static void stop(const struct service *service, enum report_kind kind, struct reply *reply);
static void add_report(struct text *json, struct report_keeper *keeper, enum report_kind kind);

void handle_reports_list(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    struct text json = {0};
    (void)call;
    if (!there(service, reply))
        return;
    text_add(&json, "{\"reports\":[");
    for (int kind = 0; kind < REPORT_KINDS; kind++) {
        text_add(&json, kind ? ",\n" : "\n");
        add_report(&json, service->reports, kind);
    }
    text_add(&json, "\n]}\n");
    reply_json_take(reply, text_take(&json));
}

void handle_reports_json(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    answer(service, call, REPORT_WORK_PRECISION, REPORT_JSON, reply);
}

void handle_reports_csv(const struct service *service, const struct call *call, struct reply *reply)
{
    answer(service, call, REPORT_WORK_PRECISION, REPORT_CSV, reply);
}

void handle_reports_svg(const struct service *service, const struct call *call, struct reply *reply)
{
    answer(service, call, REPORT_WORK_PRECISION, REPORT_SVG, reply);
}

void handle_reports_measure(const struct service *service, const struct call *call,
                            struct reply *reply)
{
    const char *budget = call_query(call, "budget"); /* all else makes no whole report */
    measure(service, REPORT_WORK_PRECISION, budget ? strtod(budget, NULL) : 0, reply);
}

void handle_reports_stop(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    (void)call;
    stop(service, REPORT_WORK_PRECISION, reply);
}

void handle_stability_json(const struct service *service, const struct call *call,
                           struct reply *reply)
{
    answer(service, call, REPORT_STABILITY, REPORT_JSON, reply);
}

void handle_stability_csv(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    answer(service, call, REPORT_STABILITY, REPORT_CSV, reply);
}

void handle_stability_svg(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    answer(service, call, REPORT_STABILITY, REPORT_SVG, reply);
}

void handle_stability_measure(const struct service *service, const struct call *call,
                              struct reply *reply)
{
    (void)call;
    measure(service, REPORT_STABILITY, 0, reply);
}

void handle_stability_stop(const struct service *service, const struct call *call,
                           struct reply *reply)
{
    (void)call;
    stop(service, REPORT_STABILITY, reply);
}

static bool there(const struct service *service, struct reply *reply)
{
    if (!service->reports)
        reply_problem(reply, PROBLEM_BUSY, "this server measures no reports");
    return service->reports != NULL;
}

/* {"state":..,"progress":..} and, of one that tells them, what it has found so far. */
static char *print_state(struct report_keeper *keeper, enum report_kind kind, const char *state,
                         double share)
{
    struct text json = {0};
    char *entries = report_keeper_so_far(keeper, kind);
    text_add(&json, "{\"state\":\"%s\",\"progress\":", state);
    text_add_number(&json, share < 0 ? 0 : share);
    if (entries) {
        text_add(&json, ",\"entries\":[");
        text_add_bytes(&json, entries, strlen(entries));
        text_add(&json, "]");
    }
    text_add(&json, "}\n");
    free(entries);
    return text_take(&json);
}

static void reply_measuring(struct reply *reply, struct report_keeper *keeper,
                            enum report_kind kind, double share)
{
    static const char *const places[REPORT_KINDS] = {HERE "work-precision", HERE "stability"};
    reply_later_take(reply, places[kind], print_state(keeper, kind, "measuring", share));
}

static void measure(const struct service *service, enum report_kind kind, double core_seconds,
                    struct reply *reply)
{
    if (!there(service, reply))
        return;
    switch (report_keeper_begin(service->reports, kind, core_seconds)) {
    case REPORT_BEGUN:
        reply_measuring(reply, service->reports, kind, 0);
        break;
    case REPORT_BUSY:
        reply_problem(reply, PROBLEM_MEASURING, "one is being measured already");
        break;
    case REPORT_NO_THREAD:
        reply_problem(reply, PROBLEM_BUSY, "no thread can be had");
        break;
    }
}

static void stop(const struct service *service, enum report_kind kind, struct reply *reply)
{
    if (!there(service, reply))
        return;
    double share = report_keeper_progress(service->reports, kind, NULL);
    if (report_keeper_stop(service->reports, kind))
        reply_text_take(reply, "application/json",
                        print_state(service->reports, kind, "stopping", share));
    else
        reply_problem(reply, PROBLEM_MEASURING, "none is being measured");
}

/* The report if there is one; else it is being measured, from now on if not before. */
static void answer(const struct service *service, const struct call *call, enum report_kind kind,
                   enum report_form form, struct reply *reply)
{
    static const char *const types[REPORT_FORMS] = {
        "application/json", "text/csv; charset=utf-8; header=present", "image/svg+xml"};
    const char *begin = call_query(call, "begin");
    char reason[WORK_PRECISION_REASON], *text = NULL;
    if (!there(service, reply))
        return;
    /* Before the store is asked: what ends in between is found there. */
    double share = report_keeper_progress(service->reports, kind, reason);
    enum store_status status = report_keeper_get(service->reports, kind, form, &text);
    if (status == STORE_OK) {
        reply_text_take(reply, types[form], text);
        return;
    }
    if (status != STORE_NOT_FOUND) {
        reply_store(reply, status, "report");
        return;
    }
    if (share >= 0)
        reply_measuring(reply, service->reports, kind, share);
    else if (reason[0])
        reply_problem(reply, PROBLEM_BUSY, "the report could not be measured: %s", reason);
    else if (strcmp(call->request->method, "HEAD") == 0 || (begin && strcmp(begin, "false") == 0))
        reply_problem(reply, PROBLEM_NOT_FOUND, "there is no report yet: GET has it measured");
    else
        measure(service, kind, 0, reply);
}

/* {"name":..,"measured_at":..,"state":..,"progress":..,"links":{..}} */
static void add_report(struct text *json, struct report_keeper *keeper, enum report_kind kind)
{
    const char *name = report_kind_name(kind);
    int64_t when = 0;
    double share = report_keeper_progress(keeper, kind, NULL);
    report_keeper_when(keeper, kind, &when);
    text_add(json, "{\"name\":\"%s\"", name);
    record_json_add_time(json, "measured_at", when);
    text_add(json, ",\"state\":\"%s\",\"progress\":", share < 0 ? "idle" : "measuring");
    if (share < 0)
        text_add(json, "null");
    else
        text_add_number(json, share);
    text_add(json,
             ",\"links\":{\"self\":\"" HERE "%s\",\"csv\":\"" HERE "%s.csv\",\"svg\":\"" HERE
             "%s.svg\"}}",
             name, name, name);
}
