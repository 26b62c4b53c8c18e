/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "routes.h"
#include "aside.h"
#include "reply.h"
#include "route_query.h"
#include "store_settle.h"

#include <stdio.h>
#include <string.h>

static void go(const struct service *service, const struct route *route, const struct call *call,
               struct reply *reply);
static bool must_wait(const struct service *service, const struct request *request,
                      struct reply *reply);
static bool let_in(const struct service *service, const struct route *route, struct call *call,
                   struct reply *reply);
static bool query_fits(const struct route *route, const struct request *request,
                       struct reply *reply);
static bool match(const char *pattern, const char *path, struct call *call);
static size_t capture(const char *kind, const char *path, char arg[CALL_ARG_SIZE]);
static void add_allowed(char *allow, size_t size, const char *method);

void routes_dispatch(void *context, const struct request *as_asked, struct reply *reply)
{
    const struct service *service = context;
    struct request own = *as_asked, *request = &own;
    if (own.held == service->store) /* it was held by must_wait, which no handler knows */
        own.held = NULL;
    const char *method = strcmp(request->method, "HEAD") == 0 ? "GET" : request->method;
    struct call call = {.request = request};
    char allow[sizeof(reply->allow)] = "";
    const struct route *route;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        if (!match(route->pattern, request->path, &call))
            continue;
        if (strcmp(route->method, method) != 0) {
            add_allowed(allow, sizeof(allow), route->method);
            continue;
        }
        reply->route = route->pattern;
        if (let_in(service, route, &call, reply) && query_fits(route, request, reply))
            go(service, route, &call, reply);
        return;
    }
    if (allow[0])
        reply_method(reply, request->method, allow);
    else
        reply_problem(reply, PROBLEM_NOT_FOUND,
                      "there is nothing at this path; GET /v1 lists the paths");
}

static void go(const struct service *service, const struct route *route, const struct call *call,
               struct reply *reply)
{
    bool reads = strcmp(route->method, "GET") == 0 || route->role <= ROLE_READER;
    struct aside *aside = service->lane[route->lane];
    if (aside)
        aside_answer(aside, route->handle, service, call, reply);
    else if (reads || !must_wait(service, call->request, reply))
        route->handle(service, call, reply);
}

static bool may_write(void *store)
{
    return !store_busy(store);
}

/* Who wants to write while a large sweep is being kept rests until that is done: to wait for the
 * store would keep a thread that others are served by. */
static bool must_wait(const struct service *service, const struct request *request,
                      struct reply *reply)
{
    enum { LOOK_MS = 10000 };
    if (!service->lane[LANE_SWEEPS] || request->last || !store_busy(service->store))
        return false;
    reply_hold_take(reply, &(const struct hold){
                               .ready = may_write, .state = service->store, .wait_ms = LOOK_MS});
    return true;
}

/* False, with the reply filled, when this route is not for who asks. */
static bool let_in(const struct service *service, const struct route *route, struct call *call,
                   struct reply *reply)
{
    const char *why = "";
    if (service->access)
        call->identity = access_identify(service->access, call->request, &why);
    else
        call->identity = (struct identity){.owner = OWNER_LOCAL, .role = ROLE_ADMIN};
    snprintf(reply->owner, sizeof(reply->owner), "%s", call->identity.owner);
    if (role_may(call->identity.role, route->role))
        return true;
    if (call->identity.role == ROLE_NONE) {
        if (must_wait(service, call->request, reply)) /* it is written down */
            return false;
        access_note_refusal(service->access, route->pattern, why);
        reply_problem(reply, PROBLEM_WHO, "%s", why);
    } else {
        reply_problem(reply, PROBLEM_ROLE, "this is for role %s and %s; %s has role %s",
                      role_name(route->role), route->role == ROLE_WORKER ? "admins" : "above",
                      call->identity.owner, role_name(call->identity.role));
    }
    snprintf(reply->owner, sizeof(reply->owner), "%s", call->identity.owner);
    return false;
}

static bool query_fits(const struct route *route, const struct request *request,
                       struct reply *reply)
{
    if (request->query_count == 0)
        return true;
    struct bcd_errors errors = {0};
    route_query_check(route, request, &errors);
    if (errors.count > 0)
        reply_faults(reply, PROBLEM_QUERY, &errors, NULL);
    return errors.count == 0;
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

/* Takes from the path what {id} or the like may stand for; its length, 0 when there is none. */
static size_t capture(const char *kind, const char *path, char arg[CALL_ARG_SIZE])
{
    const struct route_arg *row;
    size_t at = 0, name = strcspn(kind + 1, "}");
    while ((row = routes_arg(at)) &&
           (strlen(row->name) != name || strncmp(kind + 1, row->name, name) != 0))
        at++;
    size_t length = row ? strspn(path, row->characters) : 0;
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
