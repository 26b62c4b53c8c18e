/* SPDX-License-Identifier: GPL-3.0-or-later
 * step_error.c - see step_error.h. */
#include "step_error.h"
#include "step_limit.h"
#include "table.h"

#include <math.h>

static const char name[] = "time_step_error";
static const double order_max = 1.5;
static const double views_share = 0.3; /* of 1 / max|U''|: up to there views are trusted */

bool step_error_views_used(const struct plan *plan)
{
    const struct method_type *method = plan->method;
    bool exact = method->exact && method->exact(plan, false);
    return method->view && plan->diffusion > 0 && !exact;
}

enum step_error step_error_of(const struct observable_type *type, const struct plan *plan)
{
    const struct method_type *method = plan->method;
    if (type->no_time_step_error)
        return STEP_ERROR_NONE;
    if (method->exact && method->exact(plan, type->dynamic))
        return STEP_ERROR_ZERO;
    /* Where steps are coarse, interactions stiff or rods pressed to walls, both views may miss on
     * the same side. */
    bool fine = !plan->pair && wall_rate(plan) == 0 &&
                curvature_rate(plan) * plan->time_step <= views_share;
    if (step_error_views_used(plan) && type->sample_ns && !type->one_view && fine)
        return STEP_ERROR_VIEWS;
    return STEP_ERROR_PAIR;
}

/* Richardson: with errors as h^p the difference between 2h and h is 2^p - 1 times the error at h.
 * Its own standard error is added, for it may have come out too small by chance; orders above
 * order_max are not trusted. */
static double of_pair(const struct moments *difference, size_t i, double order)
{
    double n = difference->samples[i];
    if (n < 1)
        return NAN;
    double chance = n > 1 ? sqrt(difference->square[i] / (n * (n - 1))) : 0;
    return (fabs(difference->mean[i]) + chance) / (exp2(fmin(order, order_max)) - 1);
}

static double of_views(const struct moments *one, const struct moments *other, size_t i)
{
    return one->samples[i] > 0 ? fabs(one->mean[i] - other->mean[i]) : NAN;
}

static double variance_of_mean(const struct moments *m, size_t i)
{
    double n = m->samples[i];
    return n > 1 ? m->square[i] / (n * (n - 1)) : INFINITY;
}

static double order_of(const struct observable_type *type, const struct plan *plan)
{
    return type->at_contact ? fmin(plan->method->order, 0.5) : plan->method->order;
}

double step_error_least(const struct observable_type *type, const struct plan *plan,
                        const struct moments *value, const struct moments *second, size_t i)
{
    const double sure = 3, few = 4;
    enum step_error kind = step_error_of(type, plan);
    if (kind == STEP_ERROR_PAIR && plan->paired > 0 && second->samples[i] >= few)
        return fmax(0, fabs(second->mean[i]) - sure * sqrt(variance_of_mean(second, i))) /
               (exp2(fmin(order_of(type, plan), order_max)) - 1);
    if (kind == STEP_ERROR_VIEWS && value->samples[i] >= few)
        return fmax(0, of_views(value, second, i) -
                           sure * sqrt(variance_of_mean(value, i) + variance_of_mean(second, i)));
    return 0;
}

static double share_of(const double *error, const double *value, size_t i)
{
    return error[i] > 0 ? error[i] / fabs(value[i]) : error[i];
}

static double larger_share(const double *error, const double *value, size_t a, size_t b)
{
    return fmax(share_of(error, value, a), share_of(error, value, b));
}

/* Lags of odd numbers of steps have no partner at twice the step: they take the larger relative
 * error of their neighbours. */
static void fill_gaps(double *error, const double *value, size_t rows)
{
    for (size_t i = 0; i < rows; i++) {
        if (!isnan(error[i]))
            continue;
        size_t end = i, before = i > 0 ? i - 1 : i;
        while (end < rows && isnan(error[end]))
            end++;
        size_t after = end < rows ? end : before;
        before = i > 0 ? before : after;
        for (; i < end; i++)
            error[i] = larger_share(error, value, before, after) * fabs(value[i]);
    }
}

enum bcd_status step_error_add(struct bcd_table *table, const struct observable_type *type,
                               const struct plan *plan, const struct moments *value,
                               const struct moments *second)
{
    enum step_error kind = step_error_of(type, plan);
    if (kind == STEP_ERROR_NONE || (kind == STEP_ERROR_PAIR && plan->paired == 0)) {
        table_add_absent(table, name, BCD_ROLE_TIME_STEP_ERROR,
                         kind == STEP_ERROR_NONE ? type->no_time_step_error : plan->no_pair);
        return BCD_OK;
    }
    double *error = table_add(table, name, BCD_ROLE_TIME_STEP_ERROR);
    if (!error)
        return BCD_NO_MEMORY;
    const double order = order_of(type, plan);
    for (size_t i = 0; i < table->rows; i++)
        error[i] = kind == STEP_ERROR_PAIR    ? of_pair(second, i, order)
                   : kind == STEP_ERROR_VIEWS ? of_views(value, second, i)
                                              : 0;
    if (kind == STEP_ERROR_PAIR)
        fill_gaps(error, value->mean, table->rows);
    static const char *const from[] = {[STEP_ERROR_ZERO] = "exact at any time step",
                                       [STEP_ERROR_VIEWS] = "mid-noise and mid-drift",
                                       [STEP_ERROR_PAIR] = "twice the time step"};
    table_note_text(table, "time_step_error_from", from[kind]);
    return BCD_OK;
}
