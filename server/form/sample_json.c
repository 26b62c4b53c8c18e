/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sample_json.h"
#include "scene_json.h"
#include "scene_json_tree.h"

#include <jansson.h>

#include <stdlib.h>
#include <string.h>

static bool put_size(json_t *job, const struct bcd_scene *scene, const struct sample_size *size);
static bool put_lags(json_t *observables, const struct bcd_scene *scene, double lag_max);

enum bcd_status sample_json_shrink(const struct bcd_scene *scene, const struct sample_size *size,
                                   struct bcd_scene **sample)
{
    struct bcd_errors errors = {0};
    enum bcd_status status = BCD_NO_MEMORY;
    char *text = scene_json_job(scene);
    json_t *job = text ? scene_json_load(text, strlen(text), "job", &errors) : NULL;
    json_t *observables = json_object_get(job, "observables");
    json_object_del(observables, "trajectory");
    if (job && put_size(job, scene, size) && put_lags(observables, scene, size->lag_max))
        status = scene_json_read(job, NULL, sample, &errors);
    json_decref(job);
    free(text);
    return status;
}

static const struct bcd_fact *find(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_fact *fact;
    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)) != NULL; i++)
        if (strcmp(fact->name, name) == 0)
            return fact;
    return NULL;
}

static bool put_size(json_t *job, const struct bcd_scene *scene, const struct sample_size *size)
{
    const struct bcd_fact *step = find(scene, "time_step"), *method = find(scene, "method");
    int failed = json_object_set_new(job, "realizations", json_integer(size->realizations));
    failed |= json_object_set_new(job, "time", json_real(size->time));
    failed |= json_object_set_new(job, "equilibration_time", json_real(size->equilibration_time));
    failed |= json_object_set_new(job, "time_step_error", json_string("skipped"));
    failed |= json_object_set_new(job, "target", json_null());
    if (step)
        failed |= json_object_set_new(job, "time_step", json_real(step->number));
    if (method)
        failed |= json_object_set_new(job, "method", json_string(method->text));
    return failed == 0;
}

/* What "auto" means for the longest lag depends on the time. */
static bool put_lags(json_t *observables, const struct bcd_scene *scene, double lag_max)
{
    json_t *msd = json_object_get(observables, "msd"), *last = json_object_get(msd, "last");
    const struct bcd_group *job = bcd_scene_job_view(scene);
    double longest = json_is_number(last) ? json_number_value(last)
                                          : bcd_group_number(job, bcd_group_find(job, "time")) / 10;
    if (!msd)
        return true;
    if (longest > lag_max)
        return json_object_del(observables, "msd") == 0;
    return json_is_number(last) || json_object_set_new(msd, "last", json_real(longest)) == 0;
}
