/* SPDX-License-Identifier: GPL-3.0-or-later
 * result.c - results and their refinement to a tolerance (tools.h). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools.h"

static size_t windows(const struct theory_wanted *wanted)
{
    return wanted->contact_gap > 0 ? wanted->contact_bins : 0;
}

static size_t values(const struct theory_wanted *wanted)
{
    return wanted->density_bins + wanted->contact_bins + windows(wanted) + wanted->pair_bins +
           wanted->gap_bins;
}

enum bcd_status result_create(struct theory_result **result, const struct theory_wanted *wanted)
{
    size_t contact = wanted->contact_bins, window = windows(wanted);
    struct theory_result *fresh = calloc(1, sizeof *fresh + values(wanted) * sizeof(double));
    if (!fresh) {
        return BCD_NO_MEMORY;
    }
    double *next = (double *)(fresh + 1);
    fresh->wanted = *wanted;
    fresh->density = next;
    fresh->contact = fresh->density + wanted->density_bins;
    fresh->contact_window = fresh->contact + contact;
    fresh->pair = fresh->contact_window + window;
    fresh->gap = fresh->pair + wanted->pair_bins;
    fresh->contact_window = window ? fresh->contact_window : NULL;
    fresh->pressure = fresh->bonded_fraction = NAN;
    *result = fresh;
    return BCD_OK;
}

size_t theory_result_bytes(const struct theory_result *result)
{
    return result ? sizeof *result + values(&result->wanted) * sizeof(double) : 0;
}

void theory_result_free(struct theory_result *result)
{
    free(result);
}

enum bcd_status theory_result_copy(struct theory_result **copy, const struct theory_result *from)
{
    enum bcd_status status = result_create(copy, &from->wanted);
    if (status) {
        return status;
    }
    struct theory_result *to = *copy;
    memcpy(to + 1, from + 1, values(&from->wanted) * sizeof(double));
    to->energy = from->energy;
    to->pressure = from->pressure;
    to->bonded_fraction = from->bonded_fraction;
    to->error = from->error;
    to->points = from->points;
    to->route = from->route;
    return BCD_OK;
}

/* Largest difference relative to the largest value, or to `floor` if that is more; NaN in either
 * counts as infinite. */
static double profile_distance(const double *a, const double *b, size_t count, double floor)
{
    double difference = 0, largest = floor;
    for (size_t i = 0; i < count; i++) {
        double d = fabs(a[i] - b[i]);
        if (!isfinite(d)) {
            return INFINITY;
        }
        difference = d > difference ? d : difference;
        largest = fabs(b[i]) > largest ? fabs(b[i]) : largest;
    }
    return difference > 0 ? difference / largest : 0;
}

static double scalar_distance(double a, double b, double scale)
{
    if (isnan(a) && isnan(b)) {
        return 0; /* both not given */
    }
    double d = fabs(a - b) / scale;
    return isfinite(d) ? d : INFINITY;
}

double result_distance(const struct theory_result *a, const struct theory_result *b,
                       const struct model *model)
{
    const struct theory_wanted *w = &a->wanted;
    double kT = model->system.temperature;
    /* Pairs near contact may be as rare as exp(-U0/kT): below this no simulation sees them. */
    double floor = 1e-6 * model->density * model->density;
    double distance[] = {
        profile_distance(a->density, b->density, w->density_bins, 0),
        profile_distance(a->contact, b->contact, w->contact_bins, floor),
        a->contact_window
            ? profile_distance(a->contact_window, b->contact_window, w->contact_bins, floor)
            : 0,
        profile_distance(a->pair, b->pair, w->pair_bins, 0),
        profile_distance(a->gap, b->gap, w->gap_bins, 1e-6 / model->mean_gap),
        scalar_distance(a->energy, b->energy, fabs(b->energy) + kT),
        scalar_distance(a->pressure, b->pressure, fabs(b->pressure)),
        scalar_distance(a->bonded_fraction, b->bonded_fraction, 1),
    };
    double largest = 0;
    for (size_t i = 0; i < sizeof distance / sizeof *distance; i++) {
        largest = distance[i] > largest ? distance[i] : largest;
    }
    return largest;
}

enum bcd_status refine(struct theory_result **result, const struct model *model,
                       const struct theory_wanted *wanted, const struct refinement *how,
                       struct bcd_error *error)
{
    struct theory_result *before = NULL, *now = NULL;
    enum bcd_status status = BCD_INVALID;
    double distance = INFINITY, tolerance = model->wanted.tolerance;
    int stalled = 0;
    for (size_t level = 0; level < how->levels && distance > tolerance && stalled < 2; level++) {
        theory_result_free(before);
        before = now;
        now = NULL;
        status = how->compute(&now, model, level, error);
        if (watch_ended(model->system.watch)) {
            status = watch_stopped(model->system.watch, error);
            goto cleanup;
        }
        if (status == BCD_INVALID && level + 1 < how->levels) {
            continue; /* too coarse a grid for anything: the next one may do */
        }
        if (status == BCD_INTERNAL) {
            status = BCD_INVALID;
            if (error) {
                error->code = status;
            }
        }
        if (status) {
            goto cleanup;
        }
        double last = distance;
        distance = before ? result_distance(before, now, model) : INFINITY;
        /* What is far off and hardly nearer than before will not arrive either. */
        bool slow = level >= 5 && isfinite(distance) && distance > .3 * last;
        stalled = slow && distance > 1e3 * tolerance ? stalled + 1 : 0;
    }
    if (!(distance <= tolerance)) {
        status = theory_fail(error, BCD_INVALID,
                             "%s: not exact to %.0e: the last refinement, to %zu points per "
                             "period, still changed it by %.1e",
                             how->what, tolerance, now ? now->points : 0, distance);
        goto cleanup;
    }
    now->error = distance;
    now->wanted = *wanted;
    *result = now;
    now = NULL;
cleanup:
    theory_result_free(before);
    theory_result_free(now);
    return status;
}
