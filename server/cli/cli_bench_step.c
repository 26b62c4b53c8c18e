/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_bench_step.h"
#include "bcd.h"
#include "scene_json.h"
#include "text.h"

#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const struct bench_scene {
    const char *name, *members;
    int length_per_rod;
    int64_t settling; /* steps in which rods come to rest in the wells, 3 relaxation times */
    double time_step;
} scenes[] = {
    {"free", "\"time_step\":1e-4,\"diameter\":0.5", 2, 300, 1e-4},
    {"sparse",
     "\"time_step\":1e-4,\"diameter\":0.5,\"potential\":{\"type\":\"cosine\",\"amplitude\":6}", 2,
     300, 1e-4},
    {"dense",
     "\"time_step\":1e-4,\"diameter\":0.99,\"potential\":{\"type\":\"cosine\",\"amplitude\":6}", 1,
     300, 1e-4},
    {"sticky",
     "\"time_step\":1e-5,\"diameter\":0.5,"
     "\"potential\":{\"type\":\"cosine\",\"amplitude\":6},\"interaction\":"
     "{\"type\":\"sticky\",\"strength\":1,\"range\":0.05,\"exponent\":3}",
     2, 3000, 1e-5},
};
static const double warm_seconds_max = 0.5;
static const double chunk_rod_steps = 1.9e6; /* a little less than realizations share a chunk of */
enum { CHUNKS = 1000 };

const char *bench_scene_name(size_t index)
{
    return index < sizeof scenes / sizeof *scenes ? scenes[index].name : NULL;
}

static const struct bench_scene *find(const char *name)
{
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++)
        if (strcmp(scenes[i].name, name) == 0)
            return &scenes[i];
    return NULL;
}

char *bench_scene_members(const struct bench_case *which)
{
    const struct bench_scene *scene = find(which->scene);
    struct text job = {0};
    if (!scene)
        return NULL;
    text_add(&job, "{\"particles\":%lld,\"length\":%lld,%s,\"method\":\"%s\"",
             (long long)which->particles, (long long)which->particles * scene->length_per_rod,
             scene->members, which->method);
    return text_take(&job);
}

/* A run far longer than any bench; of several realizations chunks of so many. Looks at nothing
 * before its end. */
static struct bcd_scene *make(const struct bench_case *which, const char *observables)
{
    char *members = bench_scene_members(which);
    const bool several = which->realizations > 1;
    const double rods = (double)(which->particles * which->realizations);
    double time =
        several && members ? floor(chunk_rod_steps / rods) * find(which->scene)->time_step : 1e5;
    struct text job = {0};
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    text_add(&job,
             "%s,\"time\":%.12g,\"sample_every\":%.12g,\"time_step_error\":\"skipped\","
             "\"realizations\":%lld,%s}",
             members ? members : "", time, time,
             (long long)(several ? CHUNKS * which->realizations : 1), observables);
    char *text = text_take(&job);
    if (members && text && scene_json_parse(text, strlen(text), &scene, &errors) != BCD_OK)
        scene = NULL;
    free(members);
    free(text);
    return scene;
}

/* Methods without dynamics measure no currents. */
struct bcd_scene *bench_step_scene(const struct bench_case *which)
{
    struct bcd_scene *scene = make(which, "\"observables\":{\"current\":{}}");
    return scene ? scene : make(which, "\"observables\":{\"cluster_sizes\":{}}");
}

/* ------------------------------------------------------------------ memory */

/* Largest memory of this process since the last call of forget_peak, bytes; NaN = unknown. */
static double peak_bytes(void)
{
    char line[128];
    double kilobytes = NAN;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && isnan(kilobytes) && fgets(line, sizeof line, file))
        if (strncmp(line, "VmHWM:", 6) == 0)
            kilobytes = strtod(line + 6, NULL);
    if (file)
        fclose(file);
    return 1024 * kilobytes;
}

/* false = Linux does not let us; then the peak is that of the whole life of the process. */
static bool forget_peak(void)
{
    FILE *file = fopen("/proc/self/clear_refs", "w");
    bool good = file && fputs("5", file) >= 0;
    return file && fclose(file) == 0 && good;
}

/* --------------------------------------------------------------------- time */

/* Noise and force alone. */
struct floor_work {
    double *y;
    int64_t n;
};

static bool advance_floor(void *context, int64_t ticks)
{
    struct floor_work *work = context;
    bcd_baseline_noise_and_force(work->y, work->n, ticks);
    return true;
}

bool bench_advance_run(void *run, int64_t ticks)
{
    return bcd_run_advance(run, ticks, NULL) == BCD_OK;
}

/* The chunks of a scene one after another, and from the first on again. */
struct chunks {
    const struct bcd_scene *scene;
    struct bcd_run *run;
    int64_t chunk;
};

static bool advance_chunks(void *context, int64_t ticks)
{
    struct chunks *chunks = context;
    bool good = true;
    while (good && ticks > 0) {
        int64_t done = bcd_run_ticks_done(chunks->run), total = bcd_run_ticks_total(chunks->run);
        good = bench_advance_run(chunks->run, ticks < total - done ? ticks : total - done);
        ticks -= bcd_run_ticks_done(chunks->run) - done;
        if (!good || bcd_run_ticks_done(chunks->run) < total)
            continue;
        bcd_run_free(chunks->run);
        chunks->run = NULL;
        chunks->chunk = (chunks->chunk + 1) % bcd_scene_chunks(chunks->scene);
        good = bcd_run_create(&chunks->run, chunks->scene, chunks->chunk, NULL) == BCD_OK;
    }
    return good;
}

/* Lets the rods settle, unless that takes too long. */
static bool warm(struct bcd_run *run, int64_t steps)
{
    const clock_t most = (clock_t)(warm_seconds_max * CLOCKS_PER_SEC), start = clock();
    bool good = true;
    while (good && bcd_run_ticks_done(run) < steps && clock() - start < most)
        good = bench_advance_run(run, 1);
    return good;
}

static enum bench_outcome measure(const struct bcd_scene *scene, const struct bench_case *which,
                                  const struct bench_effort *effort, struct bench_step *result)
{
    const double n = (double)(which->particles * which->realizations);
    struct floor_work least = {.n = which->particles};
    struct chunks chunks = {.scene = scene};
    enum bench_outcome outcome = BENCH_FAILED;
    least.y = calloc((size_t)which->particles + 3, sizeof *least.y); /* bcd.h: room for 3 more */
    if (!least.y)
        return outcome;
    advance_floor(&least, 1); /* its memory is there from now on */
    malloc_trim(0);           /* what earlier runs left must not serve this one unseen */
    bool known = forget_peak();
    double before = peak_bytes();
    if (bcd_run_create(&chunks.run, scene, 0, NULL) == BCD_OK &&
        warm(chunks.run, find(which->scene)->settling * which->realizations)) {
        result->warm_steps = bcd_run_ticks_done(chunks.run);
        outcome =
            bench_turns((struct bench_work[]){{advance_floor, &least}, {advance_chunks, &chunks}},
                        effort, &result->timing);
    }
    result->peak_bytes_per_rod = known ? (peak_bytes() - before) / n : NAN;
    bcd_run_free(chunks.run);
    free(least.y);
    return outcome;
}

enum bench_outcome bench_step_measure(const struct bench_case *which,
                                      const struct bench_effort *effort, struct bench_step *result)
{
    struct bcd_estimate estimate;
    struct bcd_scene *scene = bench_step_scene(which);
    *result = (struct bench_step){.peak_bytes_per_rod = NAN};
    if (!scene)
        return BENCH_REFUSED;
    bcd_scene_estimate(scene, &estimate);
    result->bytes_per_rod = estimate.run_bytes / (double)(which->particles * which->realizations);
    enum bench_outcome outcome = measure(scene, which, effort, result);
    bcd_scene_free(scene);
    return outcome;
}
