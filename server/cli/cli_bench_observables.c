/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_bench_observables.h"
#include "bcd.h"
#include "cli_bench_step.h"
#include "scene_json.h"
#include "text.h"

#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name, *parameters;
} observables[] = {
    {"density", "\"bins\":50"},
    {"energy", ""},
    {"contact_density", "\"bins\":50"},
    {"pair_distribution", "\"bins\":100"},
    {"cluster_sizes", ""},
    {"msd", "\"first\":1e-3,\"last\":10,\"points\":40"},
};

const char *bench_observable_name(size_t index)
{
    return index < sizeof observables / sizeof *observables ? observables[index].name : NULL;
}

/* A run of the scene that measures one observable; NULL = failed. */
static struct bcd_run *begin(const struct bench_case *which, const char *name,
                             const char *parameters, struct bcd_scene **scene)
{
    char *members = bench_scene_members(which);
    struct text job = {0};
    struct bcd_errors errors = {0};
    struct bcd_run *run = NULL;
    text_add(&job, "%s,\"time\":1e5,\"observables\":{\"%s\":{%s}}}", members ? members : "", name,
             parameters);
    char *text = text_take(&job);
    if (!members || !text || scene_json_parse(text, strlen(text), scene, &errors) != BCD_OK)
        *scene = NULL;
    else if (bcd_run_create(&run, *scene, 0, NULL) != BCD_OK)
        run = NULL;
    free(members);
    free(text);
    return run;
}

enum bench_outcome bench_observable_measure(size_t index, const char *method, int64_t particles,
                                            struct bench_timing *timing)
{
    const struct bench_case which = {"sparse", method, particles, 1};
    enum bench_outcome outcome = BENCH_FAILED;
    struct bcd_scene *scenes[2] = {NULL, NULL};
    struct bcd_run *bare = begin(&which, "current", "", &scenes[0]);
    struct bcd_run *full =
        begin(&which, observables[index].name, observables[index].parameters, &scenes[1]);
    if (bare && full)
        outcome = bench_turns(
            (struct bench_work[]){{bench_advance_run, bare}, {bench_advance_run, full}},
            &bench_careful, timing);
    bcd_run_free(bare);
    bcd_run_free(full);
    bcd_scene_free(scenes[0]);
    bcd_scene_free(scenes[1]);
    return outcome;
}
