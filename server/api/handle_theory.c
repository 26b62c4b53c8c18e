/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "aside.h"
#include "handle.h"
#include "job_request.h"
#include "limits.h"
#include "log.h"
#include "reply.h"
#include "request_check.h"
#include "scene_json.h"
#include "theory_print.h"

#include <stdlib.h>
#include <time.h>

static struct bcd_scene *read_scene(const struct request *request, struct reply *reply);
static bool small_enough(const struct bcd_scene *scene, struct reply *reply);
static bool may_have(const struct service *service, const struct call *call,
                     const struct bcd_scene *scene, struct reply *reply);
static handler compute;
static enum bcd_status make(const struct service *service, const struct bcd_scene *scene,
                            const atomic_int *stop, char **text);
static bool should_stop(void *stop);
static double cpu_seconds(void);

/* What is wrong with the job is told at once; the theory is computed aside, and ended when nobody
 * waits for it any more. */
void handle_theory(const struct service *service, const struct call *call, struct reply *reply)
{
    if (!service->lane[LANE_THEORIES]) {
        reply_problem(reply, PROBLEM_BUSY, "this server computes no theory");
        return;
    }
    bool sound = call->request->held;
    if (!sound) {
        struct bcd_scene *scene = read_scene(call->request, reply);
        sound = scene && small_enough(scene, reply) && may_have(service, call, scene, reply);
        bcd_scene_free(scene);
    }
    if (sound)
        aside_answer(service->lane[LANE_THEORIES], compute, service, call, reply);
}

/* NULL with the reply filled. */
static struct bcd_scene *read_scene(const struct request *request, struct reply *reply)
{
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    struct ticket ticket = {0};
    if (!request_check_json(request, reply))
        return NULL;
    enum bcd_status status =
        scene_json_complete_ticket(request->body, request->body_size, &scene, &ticket, &errors);
    ticket_fini(&ticket);
    if (status == BCD_OK)
        return scene;
    reply_bcd(reply, status, &errors);
    return NULL;
}

static bool small_enough(const struct bcd_scene *scene, struct reply *reply)
{
    struct bcd_estimate estimate;
    struct bcd_errors errors = {0};
    bcd_scene_estimate(scene, &estimate);
    if (estimate.result_bytes <= LIMIT_THEORY_ANSWER_BYTES_MAX)
        return true;
    bcd_errors_add(&errors, "/observables",
                   "needs about %.3g bytes of tables; LIMIT_THEORY_ANSWER_BYTES_MAX is %g",
                   estimate.result_bytes, LIMIT_THEORY_ANSWER_BYTES_MAX);
    reply_faults(reply, PROBLEM_TOO_COSTLY, &errors, NULL);
    return false;
}

/* It counts as core seconds of the owner's like a job's. */
static bool may_have(const struct service *service, const struct call *call,
                     const struct bcd_scene *scene, struct reply *reply)
{
    struct quota_need need = {{0}};
    struct bcd_theory_cost cost;
    struct owner_record owner;
    enum store_status status = store_owners_get(service->store, call->identity.owner, &owner);
    bcd_theory_estimate(scene, BCD_THEORY_INFINITE, LIMIT_THEORY_ANSWER_SECONDS_MAX, &cost);
    need.value[QUOTA_DAY_SECONDS] = cost.seconds;
    if (status == STORE_OK && owner_record_excess(&owner, &need) == QUOTAS)
        return true;
    job_request_over_quota(service, call->identity.owner, &need, reply);
    return false;
}

static void compute(const struct service *service, const struct call *call, struct reply *reply)
{
    char *text = NULL;
    struct bcd_scene *scene = read_scene(call->request, reply);
    if (!scene)
        return;
    double before = cpu_seconds();
    enum bcd_status status = make(service, scene, call->stop, &text);
    double seconds = cpu_seconds() - before;
    bcd_scene_free(scene);
    queue_spend_of(service->queue, call->identity.owner, seconds);
    log_write(LOG_LEVEL_INFO, "theory_computed",
              LOG_FIELDS(log_text("owner", call->identity.owner),
                         log_number("core_seconds", seconds),
                         log_text("end", bcd_status_text(status))));
    if (status == BCD_OK)
        reply_json_take(reply, text);
    else if (status == BCD_STOPPED)
        reply_problem(reply, PROBLEM_BUSY, "the server is stopping");
    else
        reply_bcd(reply, status, NULL);
}

static enum bcd_status make(const struct service *service, const struct bcd_scene *scene,
                            const atomic_int *stop, char **text)
{
    struct bcd_watch watch = {.should_stop = should_stop,
                              .context = (void *)stop,
                              .seconds_max = LIMIT_THEORY_ANSWER_SECONDS_MAX,
                              .bytes_max = queue_limits(service->queue)->run_bytes};
    struct bcd_theory *theory = NULL;
    enum bcd_status status = theory_cache_make(queue_theories(service->queue), scene,
                                               BCD_THEORY_INFINITE, &watch, &theory);
    if (status == BCD_OK)
        status = theory_print(theory, scene, text);
    bcd_theory_free(theory);
    return status;
}

static bool should_stop(void *context)
{
    const atomic_int *stop = context;
    return stop && atomic_load(stop) != 0;
}

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
