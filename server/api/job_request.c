/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "job_request.h"
#include "lease.h"
#include "limits.h"
#include "people_json.h"
#include "record_json.h"
#include "reply.h"
#include "request_check.h"
#include "scene_json.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

static enum bcd_status prepare(struct bcd_scene *scene, struct ticket *ticket,
                               struct bcd_watch *watch, struct bcd_errors *errors);
static int64_t now_ms(void);

bool job_request_read(const struct request *request, struct bcd_scene **scene,
                      struct ticket *ticket, struct reply *reply)
{
    struct bcd_errors errors = {0};
    if (!request_check_json(request, reply))
        return false;
    struct ticket own = {0};
    struct bcd_watch watch = {.seconds_max = LIMIT_PREPARE_SECONDS_MAX};
    enum bcd_status status = scene_json_complete_ticket(request->body, request->body_size, scene,
                                                        ticket ? ticket : &own, &errors);
    if (status == BCD_OK)
        status = prepare(*scene, ticket, &watch, &errors);
    ticket_fini(&own);
    if (status != BCD_OK)
        reply_bcd(reply, status, &errors);
    return status == BCD_OK;
}

/* On failure the scene is gone, and so is what the ticket was given. */
static enum bcd_status prepare(struct bcd_scene *scene, struct ticket *ticket,
                               struct bcd_watch *watch, struct bcd_errors *errors)
{
    struct bcd_errors faults = {0};
    enum bcd_status status = bcd_scene_prepare(scene, watch, &faults);
    if (status == BCD_OK || status == BCD_STOPPED)
        return BCD_OK;
    *errors = faults;
    bcd_scene_free(scene);
    if (ticket)
        ticket_fini(ticket);
    return status;
}

void job_request_estimate(const struct service *service, const struct bcd_scene *scene,
                          struct bcd_estimate *estimate)
{
    calibration_estimate(queue_calibration(service->queue), scene, estimate);
}

/* Here, or elsewhere: those that are known, or may come. */
static double workers_there(const struct service *service)
{
    struct workers_counts here = {0};
    struct lease_counts elsewhere;

    if (service->workers)
        workers_count(service->workers, &here);
    if (!service->leases)
        return (double)here.alive;
    leases_count(service->leases, &elsewhere);
    return fmin(fmax(1, fmax((double)elsewhere.held, (double)elsewhere.expected)),
                (double)here.most);
}

char *job_request_print_estimate(const struct service *service, const struct bcd_scene *scene,
                                 const struct ticket *ticket)
{
    struct bcd_estimate estimate;
    struct waiting_before before = {0};
    struct record_ahead ahead = {.now_ms = now_ms()};
    int64_t chunks = bcd_scene_chunks(scene);
    job_request_estimate(service, scene, &estimate);
    if (!ticket || store_owners_before(service->store, ticket, estimate.core_seconds, &before))
        return record_json_estimate(&estimate, chunks, NULL);
    ahead.factor = calibration_factor(queue_calibration(service->queue), calibration_method(scene),
                                      &ahead.measured_seconds);
    ahead.jobs_before = before.jobs;
    ahead.core_seconds_before = before.seconds;
    /* All workers are at what goes before, and then as many at this as it has chunks; at a large
     * ring one more helps, which is worth a little more than half a worker. */
    const bool helped = !service->leases && bcd_scene_takes_hands(scene);
    double all = workers_there(service), some = fmin(all, (helped ? 1.6 : 1) * (double)chunks);
    ahead.finishes_in = all > 0 ? before.seconds / all + estimate.core_seconds / some : INFINITY;
    char *derived = scene_json_derived(scene);
    ahead.derived = derived;
    char *print = derived ? record_json_estimate(&estimate, chunks, &ahead) : NULL;
    free(derived);
    return print;
}

void job_request_over_quota(const struct service *service, const char *name,
                            const struct quota_need *need, struct reply *reply)
{
    struct owner_record owner;
    struct bcd_errors errors = {0};
    enum store_status status = store_owners_get(service->store, name, &owner);
    enum quota quota = status == STORE_OK ? owner_record_excess(&owner, need) : QUOTAS;
    if (quota == QUOTAS) { /* there is room again, or no answer */
        reply_store(reply, status == STORE_OK ? STORE_QUOTA : status, "the job");
        return;
    }
    bcd_errors_add(&errors, "", "needs %.6g %s; of %.6g that %s may have, %.6g are taken",
                   need->value[quota], quota_names[quota], owner.quota[quota], name,
                   owner_record_use(&owner, quota));
    char *more = people_json_excess(&owner, quota, need->value[quota]);
    reply_faults(reply, PROBLEM_QUOTA, &errors, more);
    free(more);
}

double job_request_progress(const struct service *service, const struct job_record *record)
{
    if (record->state == JOB_DONE)
        return 1;
    double progress = queue_progress(service->queue, record->id);
    if (progress >= 0)
        return progress;
    return record->chunks > 0 ? (double)record->chunks_done / (double)record->chunks : 0;
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
