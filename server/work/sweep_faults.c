/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_faults.h"
#include "calibration.h"
#include "limits.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { THREADS = 2, POINTS_PER_THREAD = 500 };

/* A part of the points and who looks at them. */
struct part {
    struct sweep_look look;
    struct bcd_errors errors;
    size_t faulty;
    enum bcd_status status;
    pthread_t thread;
    bool running;
};

static bool begin(struct part *part, const struct sweep *sweep, size_t first, size_t end);
static void *run(void *part);
static void tell_faults(struct part *part, size_t number, const struct bcd_errors *faults);
static bool told(const struct bcd_errors *errors, const struct bcd_error *fault);

enum bcd_status sweep_faults_point(const struct sweep_look *look, struct bcd_scene **scene,
                                   struct bcd_estimate *estimate, struct bcd_errors *faults)
{
    enum bcd_status status = sweep_walk_scene(look->walk, look->cache, scene, faults);
    if (status != BCD_OK)
        return status;
    calibration_estimate(NULL, *scene, estimate);
    job_admit_check(look->limits, estimate, faults);
    return faults->count > 0 ? BCD_INVALID : BCD_OK;
}

enum bcd_status sweep_faults(const struct sweep *sweep, const struct job_limits *limits,
                             size_t first, struct bcd_errors *errors)
{
    struct part parts[THREADS] = {{.look = {.walk = NULL}}};
    size_t points = sweep_points(sweep);
    size_t threads = sweep_points_new(sweep) >= THREADS * POINTS_PER_THREAD ? THREADS : 1;
    enum bcd_status status = BCD_OK;
    for (size_t i = 0; i < threads; i++) {
        size_t from = points * i / threads;
        parts[i].look.limits = limits;
        if (!begin(&parts[i], sweep, from > first ? from : first, points * (i + 1) / threads))
            status = BCD_NO_MEMORY;
    }
    for (size_t i = 0; i < threads && status == BCD_OK; i++)
        parts[i].running =
            i + 1 < threads && pthread_create(&parts[i].thread, NULL, run, &parts[i]) == 0;
    for (size_t i = threads; i-- > 0 && status == BCD_OK;)
        if (!parts[i].running)
            run(&parts[i]);
    for (size_t i = 0; i < threads; i++) {
        if (parts[i].running)
            pthread_join(parts[i].thread, NULL);
        status = status ? status : parts[i].status;
        for (size_t e = 0; e < parts[i].errors.count; e++)
            bcd_errors_add(errors, parts[i].errors.items[e].field, "%s",
                           parts[i].errors.items[e].text);
        errors->dropped += parts[i].errors.dropped;
        sweep_walk_free(parts[i].look.walk);
        bcd_scene_cache_free(parts[i].look.cache);
    }
    return status;
}

static bool begin(struct part *part, const struct sweep *sweep, size_t first, size_t end)
{
    part->look.walk = sweep_walk_create(sweep, first, end);
    return part->look.walk && bcd_scene_cache_create(&part->look.cache) == BCD_OK;
}

static void *run(void *context)
{
    struct part *part = context;
    size_t number;
    while (part->faulty < LIMIT_SWEEP_FAULTY_MAX && part->status != BCD_NO_MEMORY &&
           sweep_walk_next(part->look.walk, &number)) {
        struct bcd_errors faults = {.count = 0};
        struct bcd_estimate estimate;
        struct bcd_scene *scene = NULL;
        enum bcd_status status = sweep_faults_point(&part->look, &scene, &estimate, &faults);
        bcd_scene_free(scene);
        if (status == BCD_INVALID)
            tell_faults(part, number, &faults);
        part->faulty += status == BCD_INVALID;
        part->status = status ? status : part->status;
    }
    return NULL;
}

/* What is wrong at many points in the same words is told once. */
static void tell_faults(struct part *part, size_t number, const struct bcd_errors *faults)
{
    struct text values = {0};
    sweep_walk_add_values(part->look.walk, &values);
    char *where = text_take(&values);
    for (size_t i = 0; i < faults->count; i++) {
        const struct bcd_error *fault = &faults->items[i];
        if (told(&part->errors, fault))
            part->errors.dropped++;
        else
            bcd_errors_add(&part->errors, fault->field, "%.150s (point %zu: %.80s)", fault->text,
                           number, where ? where : "");
    }
    part->errors.dropped += faults->dropped;
    free(where);
}

static bool told(const struct bcd_errors *errors, const struct bcd_error *fault)
{
    size_t length = strnlen(fault->text, 150);
    for (size_t i = 0; i < errors->count; i++)
        if (strcmp(errors->items[i].field, fault->field) == 0 &&
            strncmp(errors->items[i].text, fault->text, length) == 0 &&
            strncmp(errors->items[i].text + length, " (point ", 8) == 0)
            return true;
    return false;
}
