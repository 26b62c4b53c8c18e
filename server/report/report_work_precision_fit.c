/* SPDX-License-Identifier: GPL-3.0-or-later
 * report_work_precision_fit.c - from the entries of a method: orders of its errors in the time step
 * and its cost at the tolerance; see report_work_precision.h. */
#include "report_work_precision.h"

#include <math.h>
#include <stdio.h>

static const double extrapolation_max = 1e3; /* below the finest step */

/* The density's L1 without what noise adds to it, and an error bar that calls it lost in the noise
 * when it is below that. */
static struct report_point density_point(const struct work_precision_entry *entry)
{
    double l1 = entry->value[WORK_PRECISION_DENSITY].error, noise = entry->density_noise;
    return (struct report_point){entry->time_step, sqrt(fmax(l1 * l1 - noise * noise, 0)),
                                 noise / 2};
}

/* The cheapest entry that is within the tolerance, its noise included; NaN = none. */
static double cheapest_within(const struct work_precision_entry *entries, size_t count)
{
    double cost = NAN;
    for (size_t i = 0; i < count; i++) {
        struct report_point point = density_point(&entries[i]);
        if (point.error + 2 * point.stderror <= WORK_PRECISION_TOLERANCE &&
            !(entries[i].cost >= cost))
            cost = entries[i].cost;
    }
    return cost;
}

static void put_how(struct work_precision_method *method, const char *words)
{
    snprintf(method->how, sizeof method->how, "%s", words);
}

/* Of a method that was run with the one step that it chose itself. */
static void take_cost(struct work_precision_method *method,
                      const struct work_precision_entry *entry)
{
    struct work_precision_value l1 = entry->value[WORK_PRECISION_DENSITY];
    method->cost_at_tolerance = NAN;
    if (!isfinite(l1.error)) {
        put_how(method, "it was not measured");
    } else if (l1.error <= WORK_PRECISION_TOLERANCE + 2 * l1.stderror) {
        method->cost_at_tolerance = entry->cost;
        put_how(method, "measured");
    } else {
        snprintf(method->how, sizeof method->how,
                 "L1 = %.4f at the automatic step, where noise alone gives %.4f", l1.error,
                 entry->density_noise);
    }
}

/* Along the fitted law, never to a coarser step than was run. cost * step hardly depends on the
 * step: its mean serves for all. */
static void find_cost(struct work_precision_method *method,
                      const struct work_precision_entry *entries)
{
    const struct report_fit *fit = &method->fit[WORK_PRECISION_DENSITY];
    double coarse = 0, fine = INFINITY, sum = 0;
    size_t timed = 0;
    if (method->count == 1) {
        take_cost(method, entries);
        return;
    }
    method->cost_at_tolerance = cheapest_within(entries, method->count);
    put_how(method, "measured");
    if (!(fit->order > 2 * fit->order_stderror)) {
        if (isnan(method->cost_at_tolerance))
            put_how(method, fit->points < 2
                                ? "errors are within the noise, and the noise above the tolerance"
                            : fit->order > 0
                                ? "the order is too uncertain to tell"
                                : "the error does not fall with the time step");
        return;
    }
    for (size_t i = 0; i < method->count; i++) {
        if (!isfinite(entries[i].cost))
            continue;
        coarse = fmax(coarse, entries[i].time_step);
        fine = fmin(fine, entries[i].time_step);
        sum += entries[i].cost * entries[i].time_step;
        timed++;
    }
    double step = pow(WORK_PRECISION_TOLERANCE / fit->factor, 1 / fit->order);
    if (step < fine / extrapolation_max) {
        method->cost_at_tolerance = NAN;
        put_how(method, "lies more than a thousand times below the finest step measured");
        return;
    }
    put_how(method, step < fine ? "extrapolated" : step > coarse ? "measured" : "interpolated");
    method->cost_at_tolerance = sum / (double)timed / fmin(step, coarse);
}

double work_precision_order(const struct report_fit *fit, const char **reason)
{
    *reason = isnan(fit->order)                   ? "fewer than two errors are beyond the noise"
              : fit->order <= 0                   ? "the error does not fall with the time step"
              : fit->order_stderror > fit->order ? "lost in the noise"
                                                  : NULL;
    return *reason ? NAN : fit->order;
}

void work_precision_fit(struct work_precision_method *method,
                        const struct work_precision_entry *entries)
{
    struct report_point points[WORK_PRECISION_LEVELS_MAX];
    for (int k = 0; k < WORK_PRECISION_KINDS; k++) {
        for (size_t i = 0; i < method->count; i++)
            points[i] = k == WORK_PRECISION_DENSITY
                            ? density_point(&entries[i])
                            : (struct report_point){entries[i].time_step,
                                                    entries[i].value[k].error,
                                                    entries[i].value[k].stderror};
        method->fit[k] = report_fit_power(points, method->count);
    }
    find_cost(method, entries);
}
