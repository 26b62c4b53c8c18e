/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "openapi.h"
#include "reply.h"
#include "routes.h"
#include "schema_json.h"
#include "store_jobs.h"
#include "text.h"

#include <string.h>

void handle_service_health(const struct service *service, const struct call *call,
                           struct reply *reply)
{
    (void)service, (void)call;
    reply_json_take(reply, strdup("{\"status\":\"ok\"}\n"));
}

/* Ready = the store answers and the queue still hands out work. */
void handle_service_ready(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    (void)call;
    int64_t counts[JOB_STATES];
    enum store_status status = store_jobs_counts(service->store, counts);
    if (status != STORE_OK)
        reply_problem(reply, PROBLEM_BUSY, "the store does not answer");
    else if (queue_stopping(service->queue))
        reply_problem(reply, PROBLEM_BUSY, "the server is stopping");
    else
        reply_json_take(reply, strdup("{\"status\":\"ready\"}\n"));
}

void handle_service_index(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    (void)service, (void)call;
    struct text text = {0};
    text_add(&text, "{\"service\":\"bcdd\",\"version\":\"%s\",\"routes\":[", BCD_VERSION);
    const struct route *route;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        text_add(&text, "%s\n{\"method\":\"%s\",\"path\":\"%s\",\"doc\":", i ? "," : "",
                 route->method, route->pattern);
        text_add_json_string(&text, route->doc);
        text_add(&text, "}");
    }
    text_add(&text, "\n]}\n");
    reply_json_take(reply, text_take(&text));
}

void handle_service_schema(const struct service *service, const struct call *call,
                           struct reply *reply)
{
    (void)service, (void)call;
    reply_text_take(reply, "application/schema+json", schema_json_job());
}

void handle_service_openapi(const struct service *service, const struct call *call,
                            struct reply *reply)
{
    (void)service, (void)call;
    reply_json_take(reply, openapi_print());
}
