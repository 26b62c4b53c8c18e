/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "calibration.h"

#include "limits.h"
#include "log.h"
#include "store_calibration.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { METHODS_MAX = 32, PROBE_RODS = 1000, PROBE_TICKS = 100, PROBE_TRIES = 5 };

/* What is nominal: noise and force of one rod and step in PROBE_NOMINAL_NS. */
#define PROBE_NOMINAL_NS 4.8
/* Core seconds after which what was known before counts for 1/e. */
#define MEMORY_SECONDS 100.0
/* Chunks shorter than this tell more of the clock than of the method. */
#define SECONDS_MIN 2e-3

/* THREADS  `mutex` guards all of it. */
struct calibration {
    pthread_mutex_t mutex;
    struct calibration_row rows[METHODS_MAX];
    size_t count;
    bool changed;
};

const char *calibration_method(const struct bcd_scene *scene)
{
    const struct bcd_fact *fact;

    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)); i++)
        if (strcmp(fact->name, "method") == 0 && fact->kind == BCD_FACT_TEXT)
            return fact->text;
    return "";
}

struct calibration *calibration_create(void)
{
    struct calibration *calibration = calloc(1, sizeof *calibration);

    if (calibration)
        pthread_mutex_init(&calibration->mutex, NULL);
    return calibration;
}

void calibration_free(struct calibration *calibration)
{
    if (!calibration)
        return;
    pthread_mutex_destroy(&calibration->mutex);
    free(calibration);
}

/* The row of a method, NULL when there is none and no room for one. Mutex held. */
static struct calibration_row *find(struct calibration *calibration, const char *method, bool make)
{
    struct calibration_row *row = calibration->rows;

    for (size_t i = 0; i < calibration->count; i++, row++)
        if (strcmp(row->method, method) == 0)
            return row;
    if (!make || calibration->count == METHODS_MAX)
        return NULL;
    calibration->count++;
    *row = (struct calibration_row){.factor = 1};
    snprintf(row->method, sizeof row->method, "%s", method);
    return row;
}

/* ns of a rod and step, of the fastest of a few tries: others may be working, too. */
static double probe(void)
{
    static const double per_ns = 1.0 / ((double)PROBE_RODS * PROBE_TICKS);
    double *y = calloc(PROBE_RODS, sizeof *y), best = INFINITY;

    for (int i = 0; y && i < PROBE_TRIES; i++) {
        struct timespec before, after;

        for (int rod = 0; rod < PROBE_RODS; rod++)
            y[rod] = rod;
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before);
        bcd_baseline_noise_and_force(y, PROBE_RODS, PROBE_TICKS);
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after);
        best = fmin(best, per_ns * ((double)(after.tv_sec - before.tv_sec) * 1e9 +
                                    (double)(after.tv_nsec - before.tv_nsec)));
    }
    free(y);
    return best;
}

void calibration_probe(struct calibration *calibration)
{
    double factor = probe() / PROBE_NOMINAL_NS;
    struct calibration_row *machine;

    pthread_mutex_lock(&calibration->mutex);
    machine = find(calibration, "", true);
    if (machine && factor > 0.01 && factor < 100)
        machine->factor = factor;
    calibration->changed = true;
    pthread_mutex_unlock(&calibration->mutex);
    log_write(LOG_LEVEL_INFO, "machine_probed", LOG_FIELDS(log_number("factor", factor)));
}

enum store_status calibration_load(struct calibration *calibration, struct store *store)
{
    enum store_status status =
        store_calibration_load(store, calibration->rows, METHODS_MAX, &calibration->count);

    if (status == STORE_OK && calibration->count == 0)
        calibration_probe(calibration);
    return status;
}

enum store_status calibration_save(struct calibration *calibration, struct store *store)
{
    struct calibration_row rows[METHODS_MAX];
    size_t count;
    bool changed;
    enum store_status status = STORE_OK;

    pthread_mutex_lock(&calibration->mutex);
    memcpy(rows, calibration->rows, sizeof rows);
    count = calibration->count;
    changed = calibration->changed;
    calibration->changed = false;
    pthread_mutex_unlock(&calibration->mutex);
    if (changed)
        status = store_calibration_save(store, rows, count);
    if (status) {
        pthread_mutex_lock(&calibration->mutex);
        calibration->changed = true;
        pthread_mutex_unlock(&calibration->mutex);
    }
    return status;
}

/* Logarithms are averaged, so that twice too long and twice too short cancel. */
void calibration_note(struct calibration *calibration, const char *method, double nominal,
                      double seconds)
{
    struct calibration_row *row;

    if (!(nominal > 0) || !(seconds >= SECONDS_MIN))
        return;
    pthread_mutex_lock(&calibration->mutex);
    row = find(calibration, method, true);
    if (row) {
        double share = fmax(seconds / (row->seconds + seconds), -expm1(-seconds / MEMORY_SECONDS));

        row->factor *= pow(seconds / nominal / row->factor, share);
        row->factor = fmin(fmax(row->factor, 1e-3), 1e3);
        row->seconds += seconds;
        calibration->changed = true;
    }
    pthread_mutex_unlock(&calibration->mutex);
}

double calibration_factor(struct calibration *calibration, const char *method,
                          double *measured_seconds)
{
    const struct calibration_row *row;
    double factor, seconds;

    pthread_mutex_lock(&calibration->mutex);
    row = find(calibration, method, false);
    if (!row)
        row = find(calibration, "", false);
    factor = row ? row->factor : 1;
    seconds = row ? row->seconds : 0;
    pthread_mutex_unlock(&calibration->mutex);
    if (measured_seconds)
        *measured_seconds = seconds;
    return factor;
}

void calibration_estimate(struct calibration *calibration, const struct bcd_scene *scene,
                          struct bcd_estimate *estimate)
{
    struct bcd_theory_cost theory;

    bcd_scene_estimate(scene, estimate);
    bcd_theory_estimate(scene, BCD_THEORY_RING, LIMIT_THEORY_SECONDS_MAX, &theory);
    estimate->theory_seconds = theory.seconds;
    estimate->core_seconds += theory.seconds;
    estimate->run_bytes = fmax(estimate->run_bytes, theory.bytes);
    if (calibration)
        calibration_apply(calibration, scene, estimate);
}

void calibration_apply(struct calibration *calibration, const struct bcd_scene *scene,
                       struct bcd_estimate *estimate)
{
    double run = calibration_factor(calibration, calibration_method(scene), NULL);
    double exact = calibration_factor(calibration, CALIBRATION_THEORY, NULL);
    double run_seconds = estimate->core_seconds - estimate->theory_seconds;

    estimate->theory_seconds *= exact;
    estimate->core_seconds = run * run_seconds + estimate->theory_seconds;
}
