/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_make.h"
#include "job_admit.h"
#include "limits.h"

#include <pthread.h>
#include <sha2.h>
#include <stdlib.h>
#include <string.h>

enum { THREADS = 2, POINTS_PER_THREAD = 500 };

/* A part of the points and who makes them. */
struct part {
    const struct sweep *sweep;
    struct calibration *calibration;
    struct sweep_walk *walk;
    struct bcd_scene_cache *cache;
    struct sweep_made made;
    struct bcd_errors errors;
    size_t faulty;
    enum bcd_status status;
    pthread_t thread;
    bool running;
};

static bool begin(struct part *part, const struct sweep *sweep, size_t first, size_t end);
static void *run(void *part);
static enum bcd_status make_point(struct part *part, size_t number);
static void tell_faults(struct part *part, size_t number, const struct bcd_errors *faults);
static bool told(const struct bcd_errors *errors, const struct bcd_error *fault);
static bool join(struct part *parts, size_t count, struct sweep_made *made);
static void fini(struct part *part);

enum bcd_status sweep_make(const struct sweep *sweep, struct calibration *calibration,
                           struct sweep_made *made, struct bcd_errors *errors)
{
    struct part parts[THREADS] = {{.calibration = calibration}, {.calibration = calibration}};
    size_t points = sweep_points(sweep);
    size_t threads = sweep_points_new(sweep) >= THREADS * POINTS_PER_THREAD ? THREADS : 1;
    enum bcd_status status = BCD_OK;
    for (size_t i = 0; i < threads; i++)
        if (!begin(&parts[i], sweep, points * i / threads, points * (i + 1) / threads))
            status = BCD_NO_MEMORY;
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
    }
    if (status == BCD_OK && !join(parts, threads, made))
        status = BCD_NO_MEMORY;
    for (size_t i = 0; i < threads; i++)
        fini(&parts[i]);
    return status;
}

void sweep_made_fini(struct sweep_made *made)
{
    for (size_t i = 0; i < made->count; i++) {
        free((char *)made->points[i].job.job);
        free((char *)made->points[i].job.derived);
        free((char *)made->points[i].place);
    }
    free(made->points);
    *made = (struct sweep_made){0};
}

bool sweep_made_hash(const struct sweep *sweep, const struct sweep_made *made, const char *owner,
                     unsigned char hash[JOB_HASH_SIZE])
{
    SHA2_CTX context;
    SHA256Init(&context);
    SHA256Update(&context, (const uint8_t *)owner, strlen(owner) + 1);
    for (size_t a = 0; sweep_axis(sweep, a); a++)
        SHA256Update(&context, (const uint8_t *)sweep_axis(sweep, a),
                     strlen(sweep_axis(sweep, a)) + 1);
    for (size_t i = 0; i < made->count; i++)
        SHA256Update(&context, made->points[i].job.hash, JOB_HASH_SIZE);
    SHA256Final(hash, &context);
    return true;
}

static bool begin(struct part *part, const struct sweep *sweep, size_t first, size_t end)
{
    part->sweep = sweep;
    part->walk = sweep_walk_create(sweep, first, end);
    part->made.points = calloc(end - first + 1, sizeof(*part->made.points));
    return part->walk && part->made.points && bcd_scene_cache_create(&part->cache) == BCD_OK;
}

static void *run(void *context)
{
    struct part *part = context;
    size_t number;
    while (part->faulty < LIMIT_SWEEP_FAULTY_MAX && part->status != BCD_NO_MEMORY &&
           sweep_walk_next(part->walk, &number)) {
        enum bcd_status status = make_point(part, number);
        part->faulty += status == BCD_INVALID;
        part->status = status ? status : part->status;
    }
    return NULL;
}

static enum bcd_status make_point(struct part *part, size_t number)
{
    struct bcd_errors faults = {.count = 0};
    struct bcd_estimate estimate;
    struct bcd_scene *scene = NULL;
    struct sweep_point_new *point = &part->made.points[part->made.count];
    struct text place = {0};
    enum bcd_status status = sweep_walk_scene(part->walk, part->cache, &scene, &faults);
    if (status == BCD_OK) {
        bcd_scene_estimate(scene, &estimate);
        job_admit_check(&estimate, &faults);
        status = faults.count > 0 ? BCD_INVALID : BCD_OK;
    }
    if (status == BCD_INVALID)
        tell_faults(part, number, &faults);
    /* Once something is wrong the rest is looked at for its faults alone. */
    if (status != BCD_OK || part->faulty > 0)
        goto cleanup;
    estimate.core_seconds *= calibration_factor(part->calibration, calibration_method(scene), NULL);
    sweep_walk_add_place(part->walk, &place);
    point->place = text_take(&place);
    if (point->place && job_admit_fill(scene, &estimate, &point->job)) {
        part->made.count++;
    } else {
        free((char *)point->place);
        status = BCD_NO_MEMORY;
    }
cleanup:
    bcd_scene_free(scene);
    return status;
}

/* What is wrong at many points in the same words is told once. */
static void tell_faults(struct part *part, size_t number, const struct bcd_errors *faults)
{
    struct text values = {0};
    sweep_walk_add_values(part->walk, &values);
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

/* The parts' points in one list. */
static bool join(struct part *parts, size_t count, struct sweep_made *made)
{
    size_t points = 0;
    for (size_t i = 0; i < count; i++)
        points += parts[i].made.count;
    struct sweep_point_new *list = malloc((points + 1) * sizeof(*list));
    if (!list)
        return false;
    *made = (struct sweep_made){.points = list};
    for (size_t i = 0; i < count; i++) {
        memcpy(list + made->count, parts[i].made.points, parts[i].made.count * sizeof(*list));
        made->count += parts[i].made.count;
        parts[i].made.count = 0;
    }
    return true;
}

static void fini(struct part *part)
{
    sweep_made_fini(&part->made);
    sweep_walk_free(part->walk);
    bcd_scene_cache_free(part->cache);
}
