/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_forecast.h"
#include "limits.h"
#include "report_run.h"
#include "sample_json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { REALIZATIONS = 12, REALIZATIONS_MAX = 64, STEPS_MIN = 40, PATIENCE = 32, LONGER = 2 };
static const double lags_in_time = 2; /* the longest lag within the time of a sample */
static const double error_most = 0.5; /* of the sample: relative to nothing beyond that */
static const double ratio_least = 1.25, ratio_most = 3.5; /* of the errors: 2, and chance */

static bool plan_sample(const struct bcd_scene *scene, struct sample_size *size, bool *whole);
static bool run_sample(struct report_run *run, const struct bcd_scene *scene,
                       const struct sample_size *size, struct forecast *forecast);
static double relative_error(const struct report_run *run, const char *observable);

static double job_number(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_group *job = bcd_scene_job_view(scene);
    return bcd_group_number(job, bcd_group_find(job, name));
}

static int64_t job_realizations(const struct bcd_scene *scene)
{
    const struct bcd_group *job = bcd_scene_job_view(scene);
    return bcd_group_integer(job, bcd_group_find(job, "realizations"));
}

/* The longest lag of its msd; 0 = there is none. "auto" is a tenth of the time. */
static double longest_lag(const struct bcd_scene *scene)
{
    int index = report_run_observable(scene, "msd");
    if (index < 0)
        return 0;
    const struct bcd_group *msd = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, (size_t)index);
    double last = bcd_group_number(msd, bcd_group_find(msd, "last"));
    return isfinite(last) ? last : job_number(scene, "time") / 10;
}

static void list_rows(const struct bcd_scene *scene, struct forecast *forecast)
{
    const struct bcd_group *part;
    *forecast = (struct forecast){0};
    while (forecast->count < FORECAST_ROWS_MAX &&
           (part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, forecast->count)) != NULL)
        forecast->row[forecast->count++] =
            (struct forecast_row){.observable = part->type, .relative = NAN};
}

static void give_reason(struct forecast *forecast, const char *reason)
{
    for (size_t i = 0; i < forecast->count; i++)
        snprintf(forecast->row[i].reason, FORECAST_REASON, "%s", reason);
}

/* One row from the errors of the sample and of the shorter one (not run when the sample is as long
 * as the job). `time`: of the job; `share`: realizations of the sample over those of the job. */
static void foretell(struct forecast_row *row, const struct report_run *run,
                     const struct report_run *shorter, double share, double time)
{
    bool lags = strcmp(row->observable, "msd") == 0;
    double without = lags ? longest_lag(run->scene) : 0;
    double error = relative_error(run, row->observable);
    if (!isfinite(error)) {
        snprintf(row->reason, FORECAST_REASON, "a short sample has no error bars of it");
        return;
    }
    if (error > error_most) {
        snprintf(row->reason, FORECAST_REASON, "in a short sample it is lost in its error");
        return;
    }
    if (shorter->tally && !lags) {
        double ratio = relative_error(shorter, row->observable) / error;
        if (!(ratio >= ratio_least && ratio <= ratio_most)) {
            snprintf(row->reason, FORECAST_REASON,
                     "in a sample its error does not fall with the root of the time (a quarter of "
                     "it: %.2g times the error)",
                     ratio);
            return;
        }
    }
    share *= (job_number(run->scene, "time") - without) / (time - without);
    row->relative = error * sqrt(share);
    row->reason[0] = '\0';
}

void report_forecast(const struct bcd_scene *scene, const atomic_int *stop,
                     struct forecast *forecast)
{
    struct report_run run = {.stop = stop}, shorter = {.stop = stop};
    struct sample_size size;
    bool whole = false;
    list_rows(scene, forecast);
    if (forecast->count == 0)
        return;
    if (!plan_sample(scene, &size, &whole)) {
        give_reason(forecast, "its steps cost too much for a sample");
        return;
    }
    bool good = run_sample(&run, scene, &size, forecast);
    if (good && !whole) {
        struct sample_size quarter = size;
        double step = report_run_fact(run.scene, "time_step");
        quarter.time = fmax(floor(size.time / 4 / step), 1) * step;
        quarter.lag_max = quarter.time;
        good = run_sample(&shorter, scene, &quarter, forecast);
    }
    if (good) {
        double share = (double)size.realizations / (double)job_realizations(scene);
        forecast->realizations = size.realizations;
        forecast->time = size.time;
        for (size_t i = 0; i < forecast->count; i++)
            foretell(&forecast->row[i], &run, &shorter, share, job_number(scene, "time"));
    }
    report_run_fini(&run);
    report_run_fini(&shorter);
}

/* As many realizations as make an error bar, as long as the budget lets them be, in whole steps.
 * False = that is next to nothing. */
static bool plan_sample(const struct bcd_scene *scene, struct sample_size *size, bool *whole)
{
    struct bcd_estimate estimate;
    double time = job_number(scene, "time"), before = job_number(scene, "equilibration_time");
    double step = report_run_fact(scene, "time_step");
    bcd_scene_estimate(scene, &estimate);
    double cost = estimate.core_seconds / ((double)job_realizations(scene) * (time + before));
    double room = FORECAST_CORE_SECONDS / cost; /* time of all realizations together */
    *whole = room >= REALIZATIONS * (time + before);
    *size = (struct sample_size){.realizations = REALIZATIONS,
                                 .time = time,
                                 .equilibration_time = before,
                                 .lag_max = INFINITY};
    if (*whole) {
        size->realizations =
            (int64_t)fmin(fmax(room / (time + before), REALIZATIONS), REALIZATIONS_MAX);
        return true;
    }
    double each = fmin(room / REALIZATIONS / (before > 0 ? 2 : 1), time);
    double lagged = 1.001 * lags_in_time * longest_lag(scene);
    if (lagged > each && lagged <= fmin(LONGER * each, time)) /* worth it */
        each = lagged;
    if (!(step > 0) || !(each >= STEPS_MIN * step))
        return false;
    size->time = floor(each / step) * step;
    size->equilibration_time = floor(fmin(each, before) / step) * step;
    size->lag_max = size->time / lags_in_time;
    return true;
}

static bool run_sample(struct report_run *run, const struct bcd_scene *scene,
                       const struct sample_size *size, struct forecast *forecast)
{
    struct bcd_watch watch = {.seconds_max = LIMIT_PREPARE_SECONDS_MAX};
    struct bcd_errors errors = {0};
    struct bcd_scene *sample = NULL;
    enum bcd_status status = sample_json_shrink(scene, size, &sample);
    if (status == BCD_OK)
        status = bcd_scene_prepare(sample, &watch, &errors);
    if (status != BCD_OK) {
        bcd_scene_free(sample);
        give_reason(forecast, "no sample of it can be made");
        return false;
    }
    run->scene = sample;
    run->core_seconds_max = PATIENCE * FORECAST_CORE_SECONDS;
    bool done = report_run_scene(run) == REPORT_DONE;
    forecast->core_seconds += run->core_ns * 1e-9;
    if (!done)
        give_reason(forecast, "a sample of it does not end in time");
    return done;
}

/* ---------------------------------------------------------------- one table */

static double relative_error(const struct report_run *run, const char *observable)
{
    struct bcd_table *table = report_run_table(run, NULL, observable);
    const struct bcd_column *value = table ? bcd_table_column(table, BCD_ROLE_VALUE) : NULL;
    const struct bcd_column *error = table ? bcd_table_column(table, BCD_ROLE_STDERR) : NULL;
    bool decades = strcmp(observable, "msd") == 0 || strcmp(observable, "cluster_sizes") == 0 ||
                   strcmp(observable, "contact_force") == 0;
    double errors = 0, values = 0;
    for (size_t i = 0; value && error && value->values && error->values && i < table->rows; i++) {
        double v = value->values[i], e = error->values[i];
        if (!isfinite(e) || !isfinite(v) || (decades && v == 0))
            continue;
        errors += decades ? e * e / (v * v) : e * e;
        values += decades ? 1 : v * v;
    }
    bcd_table_free(table);
    return values > 0 && errors > 0 ? sqrt(errors / values) : NAN;
}
