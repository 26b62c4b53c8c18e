/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "job_admit.h"
#include "limits.h"
#include "queue.h"
#include "scene_json.h"

#include <stdlib.h>

struct job_limits job_limits_usual(void)
{
    return (struct job_limits){.run_bytes = LIMIT_RUN_BYTES_MAX,
                               .overrun_factor = LIMIT_OVERRUN_FACTOR,
                               .overrun_seconds = LIMIT_OVERRUN_SECONDS};
}

void job_admit_check(const struct job_limits *limits, const struct bcd_estimate *estimate,
                     struct bcd_errors *errors)
{
    const struct {
        const char *what, *limit;
        double value, max;
    } rows[] = {
        {"bytes of memory", "LIMIT_RUN_BYTES_MAX", estimate->run_bytes, limits->run_bytes},
        {"bytes of results", "LIMIT_RESULT_BYTES_MAX", estimate->result_bytes,
         LIMIT_RESULT_BYTES_MAX},
        {"bytes on disk", "LIMIT_DISK_BYTES_MAX", estimate->tally_bytes + estimate->result_bytes,
         LIMIT_DISK_BYTES_MAX},
        {"seconds of one core", "LIMIT_CORE_SECONDS_MAX", estimate->core_seconds,
         LIMIT_CORE_SECONDS_MAX},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
        if (!(rows[i].value <= rows[i].max)) /* NaN is refused too */
            bcd_errors_add(errors, "", "needs about %.3g %s; %s is %g", rows[i].value, rows[i].what,
                           rows[i].limit, rows[i].max);
}

bool job_admit_fill(const struct bcd_scene *scene, const struct bcd_estimate *estimate,
                    struct job_new *job)
{
    char *text = scene_json_job(scene);
    char *derived = scene_json_derived(scene);
    if (!text || !derived || !queue_hash(scene, job->hash)) {
        free(text);
        free(derived);
        return false;
    }
    job->job = text;
    job->derived = derived;
    job->chunks = bcd_scene_chunks(scene);
    job->core_seconds = estimate->core_seconds;
    job->bytes = estimate->tally_bytes + estimate->result_bytes;
    return true;
}
