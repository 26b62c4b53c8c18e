/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_bench_leave_out.h"
#include "bcd.h"
#include "scene_json.h"
#include "text.h"

#include <stdlib.h>
#include <string.h>

char *leave_out_job(size_t which, bool strang, int64_t n, const char *more)
{
    struct text job = {0};
    unsigned features = 0;
    bcd_baseline_name(which, &features);
    text_add(&job,
             "{\"particles\":%lld,\"length\":%lld,\"diameter\":0.5,\"initial\":\"lattice\","
             "\"method\":\"%s\",\"time_step\":%s,\"time_step_error\":\"skipped\"",
             (long long)n, 2 * (long long)n, strang ? "strang" : "bcd",
             features & BCD_BASELINE_STICKY ? "1e-5" : "1e-4");
    if (features & BCD_BASELINE_FIELD)
        text_add(&job, ",\"potential\":{\"type\":\"cosine\",\"amplitude\":6}");
    if (features & BCD_BASELINE_DRAG)
        text_add(&job, ",\"force\":1");
    if (features & BCD_BASELINE_STICKY)
        text_add(&job, ",\"interaction\":{\"type\":\"sticky\",\"strength\":1,\"range\":0.05,"
                       "\"exponent\":3}");
    if (features & BCD_BASELINE_DENSITY)
        text_add(&job, ",\"sample_every\":%s",
                 features & BCD_BASELINE_STICKY ? "2e-4" : "2e-3");
    text_add(&job, "%s}", more);
    return text_take(&job);
}

static bool advance_loop(void *context, int64_t ticks)
{
    bcd_baseline_advance(context, ticks);
    return true;
}

static bool advance_run(void *context, int64_t ticks)
{
    return bcd_run_advance(context, ticks, NULL) == BCD_OK;
}

static struct bcd_scene *make(size_t which, bool strang, int64_t n, unsigned features)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    char *job = leave_out_job(which, strang, n,
                              features & BCD_BASELINE_DENSITY
                                  ? ",\"time\":1e7,\"observables\":{\"density\":{\"bins\":50}}"
                                  : ",\"time\":1e7,\"observables\":{\"current\":{}}");
    if (job && scene_json_parse(job, strlen(job), &scene, &errors) != BCD_OK)
        scene = NULL;
    free(job);
    return scene;
}

enum bench_outcome leave_out_measure(size_t which, bool strang, int64_t n,
                                     struct leave_out *result)
{
    unsigned features = 0;
    *result = (struct leave_out){.scene = bcd_baseline_name(which, &features),
                                 .method = strang ? "strang" : "bcd",
                                 .particles = n};
    enum bench_outcome outcome = BENCH_FAILED;
    struct bcd_scene *scene = make(which, strang, n, features);
    struct bcd_baseline *loop = NULL;
    struct bcd_run *run = NULL;
    if (scene &&
        bcd_baseline_create(&loop, features, strang ? BCD_BASELINE_STRANG : BCD_BASELINE_BCD, n) ==
            BCD_OK &&
        bcd_run_create(&run, scene, 0, NULL) == BCD_OK) {
        struct bcd_estimate estimate;
        bcd_scene_estimate(scene, &estimate);
        double moving = estimate.run_bytes - (double)bcd_run_checkpoint_size(run);
        result->bytes[0] = (double)bcd_baseline_bytes(loop) / (double)n;
        result->bytes[1] = moving / (double)n;
        outcome = bench_turns((struct bench_work[]){{advance_loop, loop}, {advance_run, run}},
                              &bench_careful, &result->timing);
    }
    bcd_run_free(run);
    bcd_baseline_free(loop);
    bcd_scene_free(scene);
    return outcome;
}
