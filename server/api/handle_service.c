/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "description.h"
#include "handle.h"
#include "limits.h"
#include "reply.h"
#include "routes.h"
#include "store_health.h"
#include "store_jobs.h"
#include "text.h"

#include <string.h>

static void check_store(const struct service *service, struct bcd_errors *errors);
static void check_workers(const struct service *service, struct bcd_errors *errors);
static const struct description *describe(const struct service *service, struct description *made);
static void reply_fixed(const struct call *call, const char *type, const struct fixed_text *fixed,
                        struct reply *reply);

void handle_service_health(const struct service *service, const struct call *call,
                           struct reply *reply)
{
    (void)service, (void)call;
    reply_json_take(reply, strdup("{\"status\":\"ok\"}\n"));
}

/* Ready = it would take a job and run it. */
void handle_service_ready(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    (void)call;
    struct bcd_errors errors = {0};
    check_store(service, &errors);
    check_workers(service, &errors);
    if (queue_stopping(service->queue))
        bcd_errors_add(&errors, "/server", "is stopping");
    if (errors.count > 0)
        reply_faults(reply, PROBLEM_BUSY, &errors, NULL);
    else
        reply_json_take(reply, strdup("{\"status\":\"ready\"}\n"));
}

static void check_store(const struct service *service, struct bcd_errors *errors)
{
    int64_t counts[JOB_STATES];
    struct store_health health;
    if (store_jobs_counts(service->store, counts) != STORE_OK)
        bcd_errors_add(errors, "/store", "does not answer");
    enum store_status status = store_health_try(service->store, LIMIT_READY_WRITE_MS);
    store_health(service->store, &health);
    /* What is small may fit where what is large did not. */
    if (status != STORE_OK || !health.writable)
        bcd_errors_add(errors, "/store", "cannot be written to, the log says why");
    else if (health.failed_ago_ms < LIMIT_READY_WRITE_MS)
        bcd_errors_add(errors, "/store", "could not take everything in the last %d s",
                       LIMIT_READY_WRITE_MS / 1000);
    if (health.disk_bytes > 0 && health.disk_free_bytes < LIMIT_READY_DISK_BYTES)
        bcd_errors_add(errors, "/disk", "has %lld bytes left, LIMIT_READY_DISK_BYTES is %d",
                       (long long)health.disk_free_bytes, LIMIT_READY_DISK_BYTES);
}

static void check_workers(const struct service *service, struct bcd_errors *errors)
{
    struct workers_counts counts;
    if (!service->workers)
        return;
    workers_count(service->workers, &counts);
    if (counts.alive < counts.started)
        bcd_errors_add(errors, "/workers", "%zu of %zu are gone", counts.started - counts.alive,
                       counts.started);
    if (counts.silent_ms > LIMIT_READY_WORKER_MS)
        bcd_errors_add(errors, "/workers", "one has not moved for %lld s",
                       (long long)counts.silent_ms / 1000);
    int64_t preparing_ms = queue_preparing_ms(service->queue);
    if (preparing_ms > LIMIT_READY_WORKER_MS)
        bcd_errors_add(errors, "/workers", "one has prepared a job for %lld s",
                       (long long)preparing_ms / 1000);
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
    struct description made = {0};
    const struct description *description = describe(service, &made);
    reply_fixed(call, "application/schema+json", &description->job_schema, reply);
    description_fini(&made);
}

void handle_service_openapi(const struct service *service, const struct call *call,
                            struct reply *reply)
{
    struct description made = {0};
    const struct description *description = describe(service, &made);
    reply_fixed(call, "application/json", &description->openapi, reply);
    description_fini(&made);
}

/* The service's, or one that is made for this once. */
static const struct description *describe(const struct service *service, struct description *made)
{
    if (service->description)
        return service->description;
    description_init(made);
    return made;
}

static void reply_fixed(const struct call *call, const char *type, const struct fixed_text *fixed,
                        struct reply *reply)
{
    if (!reply_unchanged(reply, call->request, fixed->etag))
        reply_text_take(reply, type, fixed->text ? strdup(fixed->text) : NULL);
    reply_revalidate(reply, fixed->etag);
}
