/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "job_request.h"
#include "limits.h"
#include "reply.h"
#include "request_check.h"
#include "scene_json.h"

#include <stdlib.h>

enum { LOOK_MS = 60000 }; /* a request that waits is asked again after this in any case */

static bool small_enough(const struct bcd_scene *scene, struct reply *reply);
static void answer(struct theory_keeper *keeper, const struct call *call, struct bcd_scene *scene,
                   struct reply *reply);

/* Computed by a thread of its own; the request rests meanwhile. */
void handle_theory(const struct service *service, const struct call *call, struct reply *reply)
{
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    const struct request *request = call->request;
    struct ticket ticket = {0};
    if (!request_check_json(request, reply))
        return;
    enum bcd_status status =
        scene_json_complete_ticket(request->body, request->body_size, &scene, &ticket, &errors);
    ticket_fini(&ticket);
    if (status != BCD_OK)
        reply_bcd(reply, status, &errors);
    else if (!service->theories)
        reply_problem(reply, PROBLEM_BUSY, "this server computes no theory");
    else if (small_enough(scene, reply))
        answer(service->theories, call, scene, reply);
    bcd_scene_free(scene);
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

static void answer(struct theory_keeper *keeper, const struct call *call, struct bcd_scene *scene,
                   struct reply *reply)
{
    char *text = NULL;
    struct hold hold = {.wait_ms = LOOK_MS};
    switch (theory_keeper_ask(keeper, scene, &text)) {
    case THEORY_READY:
        reply_json_take(reply, text);
        break;
    case THEORY_COMPUTING:
        hold.state = theory_keeper_wait(keeper);
        hold.ready = theory_keeper_moved;
        hold.free = theory_keeper_leave;
        if (hold.state && !call->request->last)
            reply_hold_take(reply, &hold);
        else
            reply_problem(reply, PROBLEM_BUSY, "it is being computed: try again");
        break;
    case THEORY_BUSY:
        reply_problem(reply, PROBLEM_BUSY, "another theory is being computed: try again");
        break;
    case THEORY_FAILED:
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
        break;
    }
}
