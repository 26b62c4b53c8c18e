/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "routes.h"
#include "reply.h"

#include <stdio.h>
#include <string.h>

#define JOB "/v1/jobs/{id}"
#define WORK "/v1/reports/work-precision"

/* clang-format off */
static const struct route routes[] = {
    {"POST",   "/v1/jobs", ROLE_SUBMITTER, true, handle_jobs_submit,
     "submit a job; ?force=true runs it anew although it stands"},
    {"GET",    "/v1/jobs", ROLE_READER, true, handle_jobs_list,
     "jobs, newest first; ?state= &limit= &cursor= and filters like &potential.amplitude=6"},
    {"GET",    JOB, ROLE_READER, false, handle_jobs_get, "one job: state, progress, parameters"},
    {"DELETE", JOB, ROLE_SUBMITTER, false, handle_jobs_cancel, "cancel a job"},
    {"GET",    JOB "/results", ROLE_READER, false, handle_results_all, "all results of a job"},
    {"GET",    JOB "/results/{name}", ROLE_READER, false, handle_results_json, "one observable"},
    {"GET",    JOB "/results/{name}.csv", ROLE_READER, false, handle_results_csv,
     "the same as CSV"},
    {"GET",    JOB "/results/{name}.svg", ROLE_READER, false, handle_results_svg,
     "the same as a picture"},
    {"POST",   "/v1/estimate", ROLE_READER, false, handle_jobs_estimate,
     "a job's cost before it is submitted"},
    {"POST",   "/v1/theory", ROLE_READER, false, handle_jobs_theory, "a job's exact references"},
    {"GET",    WORK, ROLE_READER, false, handle_reports_json,
     "error against run time on this machine"},
    {"GET",    WORK ".csv", ROLE_READER, false, handle_reports_csv, "the same as CSV"},
    {"GET",    WORK ".svg", ROLE_READER, false, handle_reports_svg, "the same as a picture"},
    {"POST",   WORK, ROLE_OPERATOR, true, handle_reports_measure, "measure it again; ?budget="},
    {"DELETE", WORK, ROLE_OPERATOR, false, handle_reports_stop, "stop measuring it"},
    {"GET",    "/healthz", ROLE_NONE, false, handle_service_health, "is the server alive"},
    {"GET",    "/readyz", ROLE_NONE, false, handle_service_ready, "does it take jobs"},
    {"GET",    "/v1/schema/job", ROLE_NONE, false, handle_service_schema,
     "JSON Schema of a job"},
    {"GET",    "/", ROLE_NONE, false, handle_service_index, "this list"},
};
/* clang-format on */

enum { ROUTES = sizeof(routes) / sizeof(routes[0]) };

static struct identity identify(const struct request *request);
static void refuse_role(const struct call *call, enum role needed, struct reply *reply);
static bool match(const char *pattern, const char *path, struct call *call);
static size_t capture(const char *kind, const char *path, char arg[CALL_ARG_SIZE]);
static void add_allowed(char *allow, size_t size, const char *method);
static void refuse_query(const struct request *request, struct reply *reply);

const struct route *routes_at(size_t index)
{
    return index < ROUTES ? &routes[index] : NULL;
}

void routes_dispatch(void *service, const struct request *request, struct reply *reply)
{
    const char *method = strcmp(request->method, "HEAD") == 0 ? "GET" : request->method;
    struct call call = {.request = request, .identity = identify(request)};
    char allow[sizeof(reply->allow)] = "";
    for (size_t i = 0; i < ROUTES; i++) {
        if (!match(routes[i].pattern, request->path, &call))
            continue;
        if (strcmp(routes[i].method, method) != 0) {
            add_allowed(allow, sizeof(allow), routes[i].method);
            continue;
        }
        if (call.identity.role < routes[i].role)
            refuse_role(&call, routes[i].role, reply);
        else if (request->query_count > 0 && !routes[i].free_query)
            refuse_query(request, reply);
        else
            routes[i].handle(service, &call, reply);
        return;
    }
    if (allow[0])
        reply_method(reply, request->method, allow);
    else
        reply_problem(reply, PROBLEM_NOT_FOUND,
                      "there is nothing at this path; GET / lists the paths");
}

static struct identity identify(const struct request *request)
{
    (void)request;
    return (struct identity){.owner = OWNER_LOCAL, .role = ROLE_ADMIN};
}

static void refuse_role(const struct call *call, enum role needed, struct reply *reply)
{
    if (call->identity.role == ROLE_NONE)
        reply_problem(reply, PROBLEM_WHO, "send a token: Authorization: Bearer bcd_...");
    else
        reply_problem(reply, PROBLEM_ROLE, "this is for role %s and above; %s has role %s",
                      role_name(needed), call->identity.owner, role_name(call->identity.role));
}

static bool match(const char *pattern, const char *path, struct call *call)
{
    size_t args = 0;
    while (*pattern) {
        if (*pattern == '{') {
            size_t length = capture(pattern, path, call->arg[args]);
            if (length == 0)
                return false;
            args++;
            path += length;
            pattern = strchr(pattern, '}') + 1;
        } else if (*pattern++ != *path++) {
            return false;
        }
    }
    return *path == '\0';
}

/* Takes from the path what {id} or {name} may stand for; its length, 0 when there is none. */
static size_t capture(const char *kind, const char *path, char arg[CALL_ARG_SIZE])
{
    const char *allowed = strncmp(kind, "{id}", 4) == 0 ? "abcdefghijklmnopqrstuvwxyz0123456789-"
                                                        : "abcdefghijklmnopqrstuvwxyz0123456789_";
    size_t length = strspn(path, allowed);
    if (length >= CALL_ARG_SIZE)
        return 0;
    memcpy(arg, path, length);
    arg[length] = '\0';
    return length;
}

static void add_allowed(char *allow, size_t size, const char *method)
{
    size_t length = strlen(allow);
    snprintf(allow + length, size - length, "%s%s", length ? ", " : "",
             strcmp(method, "GET") == 0 ? "GET, HEAD" : method);
}

static void refuse_query(const struct request *request, struct reply *reply)
{
    struct bcd_errors errors = {0};
    for (size_t i = 0; i < request->query_count; i++)
        bcd_errors_add(&errors, request->query[i].name, "this path takes no query parameters");
    reply_faults(reply, PROBLEM_QUERY, &errors, NULL);
}
