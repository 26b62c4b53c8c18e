/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * step_error.h - how the error from the finite time step is told for an observable: column
 * "time_step_error" of its table.
 */
#ifndef STEP_ERROR_H
#define STEP_ERROR_H

#include "part.h"

enum step_error {
    STEP_ERROR_NONE,
    STEP_ERROR_ZERO,  /* the method is exact in law at any step here */
    STEP_ERROR_VIEWS, /* from two points within a step, which the truth lies between as a rule */
    STEP_ERROR_PAIR,  /* from part of the realizations once more with twice the step */
};
enum step_error step_error_of(const struct observable_type *type, const struct plan *plan);

/* Do static observables look at points within a step? Not where the rods themselves are exact. */
bool step_error_views_used(const struct plan *plan);

/* Values of an observable stand in a tally once, or twice: what the error is told from follows. */
static inline size_t step_error_sections(const struct observable_type *type,
                                         const struct plan *plan)
{
    enum step_error kind = step_error_of(type, plan);
    return kind == STEP_ERROR_VIEWS || (kind == STEP_ERROR_PAIR && plan->paired > 0) ? 2 : 1;
}

/* The error of value i that is beyond doubt, in spite of chance (3 standard errors); 0 where that
 * cannot be told yet. More realizations do not make it smaller. */
double step_error_least(const struct observable_type *type, const struct plan *plan,
                        const struct moments *value, const struct moments *second, size_t i);

/* Adds the column. value and second are the two sections of the tally; second of a pair holds the
 * differences, twice the step minus the step. */
enum bcd_status step_error_add(struct bcd_table *table, const struct observable_type *type,
                               const struct plan *plan, const struct moments *value,
                               const struct moments *second);

#endif
