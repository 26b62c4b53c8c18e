/* SPDX-License-Identifier: GPL-3.0-or-later
 * handle_estimate.c - what a job will need, and when it would be done. */
#include "handle.h"
#include "record_json.h"
#include "reply.h"
#include "worker.h"

#include <math.h>
#include <stdio.h>
#include <time.h>

static int64_t now_ms(void);

void handle_jobs_estimate(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct ticket ticket = {0};
    struct bcd_scene *scene = NULL;
    snprintf(ticket.owner, sizeof(ticket.owner), "%s", call->identity.owner);
    if (handle_jobs_read(call->request, &scene, &ticket, reply))
        reply_json_take(reply, handle_estimate_print(service, scene, &ticket));
    ticket_fini(&ticket);
    bcd_scene_free(scene);
}

void handle_estimate(const struct service *service, const struct bcd_scene *scene,
                     struct bcd_estimate *estimate)
{
    bcd_scene_estimate(scene, estimate);
    estimate->core_seconds *=
        calibration_factor(queue_calibration(service->queue), calibration_method(scene), NULL);
}

char *handle_estimate_print(const struct service *service, const struct bcd_scene *scene,
                            const struct ticket *ticket)
{
    struct bcd_estimate estimate;
    struct waiting_before before = {0};
    struct workers_counts workers = {0};
    struct record_ahead ahead = {.now_ms = now_ms()};
    int64_t chunks = bcd_scene_chunks(scene);
    handle_estimate(service, scene, &estimate);
    if (!ticket || store_owners_before(service->store, ticket, estimate.core_seconds, &before))
        return record_json_estimate(&estimate, chunks, NULL);
    ahead.factor = calibration_factor(queue_calibration(service->queue), calibration_method(scene),
                                      &ahead.measured_seconds);
    ahead.jobs_before = before.jobs;
    ahead.core_seconds_before = before.seconds;
    if (service->workers)
        workers_count(service->workers, &workers);
    /* All workers are at what goes before, and then as many at this as it has chunks. */
    double all = (double)workers.alive, some = fmin(all, (double)chunks);
    ahead.finishes_in = all > 0 ? before.seconds / all + estimate.core_seconds / some : INFINITY;
    return record_json_estimate(&estimate, chunks, &ahead);
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
