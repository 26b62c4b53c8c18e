/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "calibration.h"
#include "handle.h"
#include "job_admit.h"
#include "job_request.h"
#include "reply.h"
#include "report_forecast.h"
#include "text.h"

#include <inttypes.h>

static char *print(const struct forecast *forecast);

void handle_forecast(const struct service *service, const struct call *call, struct reply *reply)
{
    struct forecast forecast;
    struct bcd_scene *scene = NULL;
    struct bcd_estimate estimate;
    struct bcd_errors errors = {0};
    if (!job_request_read(call->request, &scene, NULL, reply))
        return;
    calibration_estimate(NULL, scene, &estimate);
    job_admit_check(queue_limits(service->queue), &estimate, &errors); /* as when submitted */
    if (errors.count > 0) {
        reply_faults(reply, PROBLEM_TOO_COSTLY, &errors, NULL);
    } else {
        report_forecast(scene, call->stop, &forecast);
        reply_json_take(reply, print(&forecast));
    }
    bcd_scene_free(scene);
}

static char *print(const struct forecast *forecast)
{
    struct text json = {0};
    text_add(&json, "{\"observables\":{");
    for (size_t i = 0; i < forecast->count; i++) {
        const struct forecast_row *row = &forecast->row[i];
        text_add(&json, "%s\"%s\":{\"relative_error\":", i ? "," : "", row->observable);
        text_add_number(&json, row->relative);
        text_add(&json, ",\"reason\":");
        if (row->reason[0])
            text_add_json_string(&json, row->reason);
        else
            text_add(&json, "null");
        text_add(&json, "}");
    }
    if (forecast->realizations > 0) {
        text_add(&json,
                 "},\"sample\":{\"realizations\":%" PRId64 ",\"time\":", forecast->realizations);
        text_add_number(&json, forecast->time);
        text_add(&json, ",\"core_seconds\":");
        text_add_number(&json, forecast->core_seconds);
        text_add(&json, "}}\n");
    } else {
        text_add(&json, "},\"sample\":null}\n");
    }
    return text_take(&json);
}
