/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_run.h"
#include "limits.h"
#include "scene_json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { SLICE_GROWTH_MAX = 8 };

static enum report_outcome run_chunk(struct report_run *run, int64_t chunk);
static enum report_outcome advance(struct report_run *run, struct bcd_run *motion);

enum report_outcome report_run_job(struct report_run *run, const char *job)
{
    struct bcd_errors errors = {0};
    enum bcd_status status =
        job ? scene_json_parse(job, strlen(job), &run->scene, &errors) : BCD_NO_MEMORY;
    run->core_ns = 0;
    if (status != BCD_OK) {
        if (errors.count > 0)
            run->error = errors.items[0];
        run->error.code = status;
        return status == BCD_INVALID ? REPORT_REFUSED : REPORT_FAILED;
    }
    return report_run_scene(run);
}

enum report_outcome report_run_scene(struct report_run *run)
{
    enum report_outcome outcome = REPORT_DONE;
    run->core_ns = 0;
    run->error.code = bcd_tally_create(&run->tally, run->scene);
    if (run->error.code != BCD_OK)
        return REPORT_FAILED;
    for (int64_t i = 0; outcome == REPORT_DONE && i < bcd_scene_chunks(run->scene); i++)
        outcome = run_chunk(run, i);
    if (outcome != REPORT_DONE) {
        bcd_tally_free(run->tally);
        run->tally = NULL;
    }
    return outcome;
}

void report_run_fini(struct report_run *run)
{
    bcd_tally_free(run->tally);
    bcd_scene_free(run->scene);
    run->tally = NULL;
    run->scene = NULL;
}

static enum report_outcome run_chunk(struct report_run *run, int64_t chunk)
{
    struct bcd_run *motion = NULL;
    enum report_outcome outcome = REPORT_FAILED;
    run->error.code = bcd_run_create(&motion, run->scene, chunk, &run->error);
    if (run->error.code == BCD_OK)
        outcome = advance(run, motion);
    if (outcome == REPORT_DONE)
        bcd_tally_merge(run->tally, bcd_run_tally(motion));
    bcd_run_free(motion);
    return outcome;
}

static double clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

/* To the run's end in slices of about LIMIT_SLICE_MS by the clock on the wall: a thread that yields
 * to others has little processor time in it, and must hear of a stop all the same. */
static enum report_outcome advance(struct report_run *run, struct bcd_run *motion)
{
    const double target_ns = LIMIT_SLICE_MS * 1e6;
    double slice = 1;
    while (bcd_run_ticks_done(motion) < bcd_run_ticks_total(motion)) {
        if (run->stop && atomic_load(run->stop))
            return REPORT_STOPPED;
        double wall = clock_ns(CLOCK_MONOTONIC), before = clock_ns(CLOCK_THREAD_CPUTIME_ID);
        run->error.code = bcd_run_advance(motion, (int64_t)slice, &run->error);
        run->core_ns += clock_ns(CLOCK_THREAD_CPUTIME_ID) - before;
        wall = clock_ns(CLOCK_MONOTONIC) - wall;
        if (run->error.code != BCD_OK)
            return REPORT_FAILED;
        if (run->core_seconds_max > 0 && run->core_ns > 1e9 * run->core_seconds_max) {
            snprintf(run->error.text, sizeof run->error.text,
                     "stopped after %.3g s of one core, at tick %lld of %lld", run->core_ns * 1e-9,
                     (long long)bcd_run_ticks_done(motion),
                     (long long)bcd_run_ticks_total(motion));
            return REPORT_FAILED;
        }
        slice *= fmin(target_ns / fmax(wall, 1), SLICE_GROWTH_MAX);
        slice = fmin(fmax(slice, 1), 1e15);
    }
    return REPORT_DONE;
}

void report_add_member(struct text *json, const char *name, double value)
{
    text_add(json, ",\"%s\":", name);
    text_add_number(json, value);
}

/* ------------------------------------------------------------ what is in a scene */

double report_run_fact(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_fact *fact;
    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)) != NULL; i++)
        if (strcmp(fact->name, name) == 0)
            return fact->kind == BCD_FACT_INTEGER ? (double)fact->integer : fact->number;
    return NAN;
}

int report_run_observable(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_group *part;
    for (int i = 0; (part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, (size_t)i)) != NULL; i++)
        if (strcmp(part->type, name) == 0)
            return i;
    return -1;
}

struct bcd_table *report_run_table(const struct report_run *run, const struct bcd_theory *theory,
                                   const char *observable)
{
    struct bcd_table *table = NULL;
    int index = report_run_observable(run->scene, observable);
    if (index < 0 ||
        bcd_tally_table(run->tally, run->scene, theory, (size_t)index, &table) != BCD_OK)
        return NULL;
    return table;
}

const char *report_run_method(size_t index)
{
    for (const struct bcd_param *row = bcd_job_params(); row->name; row++)
        if (strcmp(row->name, "method") == 0)
            return row->choice(index);
    return NULL;
}
