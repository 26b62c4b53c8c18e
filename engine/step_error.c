/* SPDX-License-Identifier: GPL-3.0-or-later
 * step_error.c - see step_error.h. */
#include "step_error.h"
#include "table.h"

#include <math.h>

static const char name[] = "time_step_error";

bool step_error_views_used(const struct plan *plan)
{
    const struct method_type *method = plan->method;
    return method->view && !(method->exact && method->exact(plan, false));
}

enum step_error step_error_of(const struct observable_type *type, const struct plan *plan)
{
    const struct method_type *method = plan->method;
    if (type->no_time_step_error)
        return STEP_ERROR_NONE;
    if (method->exact && method->exact(plan, type->dynamic))
        return STEP_ERROR_ZERO;
    /* Interactions are stiff where they are strong: both views may miss on the same side. */
    if (step_error_views_used(plan) && type->sample_ns && !type->one_view && !plan->pair)
        return STEP_ERROR_VIEWS;
    return STEP_ERROR_PAIR;
}

/* Richardson: with errors as h^p the difference between 2h and h is 2^p - 1 times the error at h.
 * Its own standard error is added, for it may have come out too small by chance; orders above 1 are
 * not trusted. */
static double of_pair(const struct moments *difference, size_t i, double order)
{
    double n = difference->samples[i];
    if (n < 1)
        return NAN;
    double chance = n > 1 ? sqrt(difference->square[i] / (n * (n - 1))) : 0;
    return (fabs(difference->mean[i]) + chance) / (exp2(fmin(order, 1.5)) - 1);
}

static double of_views(const struct moments *one, const struct moments *other, size_t i)
{
    return one->samples[i] > 0 ? fabs(one->mean[i] - other->mean[i]) : NAN;
}

/* Lags of odd numbers of steps have no partner at twice the step: they take the larger error of
 * their neighbours. */
static void fill_gaps(double *error, size_t rows)
{
    double before = NAN;
    for (size_t i = 0; i < rows; i++) {
        if (!isnan(error[i])) {
            before = error[i];
            continue;
        }
        size_t next = i + 1;
        while (next < rows && isnan(error[next]))
            next++;
        double after = next < rows ? error[next] : NAN;
        for (; i < next; i++)
            error[i] = fmax(before, after); /* of the one there is, if only one */
        i--;
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
    for (size_t i = 0; i < table->rows; i++)
        error[i] = kind == STEP_ERROR_PAIR    ? of_pair(second, i, plan->method->order)
                   : kind == STEP_ERROR_VIEWS ? of_views(value, second, i)
                                              : 0;
    if (kind == STEP_ERROR_PAIR)
        fill_gaps(error, table->rows);
    static const char *const from[] = {[STEP_ERROR_ZERO] = "exact at any time step",
                                       [STEP_ERROR_VIEWS] = "mid-noise and mid-drift",
                                       [STEP_ERROR_PAIR] = "twice the time step"};
    table_note_text(table, "time_step_error_from", from[kind]);
    return BCD_OK;
}
