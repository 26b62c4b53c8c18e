/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * trajectory - where rods are, x(t) unwrapped, for pictures of space and time: of the first
 * realization alone, at moments `every` apart (rounded to whole steps), from the beginning of the
 * measurement on. One path is no mean: it has neither error bars nor theory.
 *
 * Rows are rod by rod, times rising: the columns time and x with the rod's number beside them,
 * equal for the rows of one path. At most NUMBERS_MAX positions in all.
 */
#include "part.h"
#include "table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS_MAX = 200000, STEPS_ROUNDED = 8 };

struct trajectory_par {
    double every;
    int64_t rods, first;
};

static const struct bcd_param trajectory_params[] = {
    {.name = "every",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .above_min = true,
     .unit = "time",
     .min = 0,
     .max = 1e18,
     .doc = "time between two positions of a rod; beyond 8 steps rounded to whole ones",
     .offset = offsetof(struct trajectory_par, every)},
    {.name = "rods",
     .type = BCD_PARAM_INTEGER,
     .min = 0,
     .max = 1e9,
     .fallback = 0,
     .doc = "how many neighbouring rods; 0 = all from first on, as many as fit into 200000 numbers",
     .offset = offsetof(struct trajectory_par, rods)},
    {.name = "first",
     .type = BCD_PARAM_INTEGER,
     .min = 0,
     .max = 1e9,
     .fallback = 0,
     .doc = "number of the first rod, from 0",
     .offset = offsetof(struct trajectory_par, first)},
    {0},
};

/* What a trajectory holds: moments 0, every, 2 every, ... (in ticks), and rods. */
struct extent {
    int64_t every, points, rods;
};

static struct extent extent_of(const struct trajectory_par *par, const struct plan *plan)
{
    struct extent extent;
    double every = fmin(rint(par->every / plan->time_step), (double)plan->steps);
    extent.every = every < 1 ? 1 : (int64_t)every;
    extent.points = plan->steps / extent.every + 1;
    int64_t left = plan->particles - par->first, fit = NUMBERS_MAX / extent.points;
    extent.rods = par->rods > 0 ? par->rods : left < fit ? left : fit;
    return extent;
}

/* Kept in checkpoints: x[rod][point], filled in for the points below `seen`; those below `told` are
 * in the tally. */
struct trajectory_memory {
    struct extent extent;
    int64_t followed; /* is it the first realization? */
    int64_t seen, told;
    double x[];
};

/* ------------------------------------------------------------------ asking */

/* Between 1 and 8 steps rounding would show. */
static void check_every(const struct bcd_group *group, const struct plan *plan,
                        struct bcd_errors *errors)
{
    const struct trajectory_par *par = group->values;
    double steps = par->every / plan->time_step;
    if (steps < 1 - 1e-9)
        group_fault(group, "every", errors, "%.12g must not be below the time step %.12g",
                    par->every, plan->time_step);
    else if (steps < STEPS_ROUNDED * (1 - 1e-9) && fabs(steps - rint(steps)) > 1e-6 * steps)
        group_fault(group, "every", errors,
                    "%.12g must be a whole multiple of the time step %.12g, or %d of them at least",
                    par->every, plan->time_step, STEPS_ROUNDED);
    else if (rint(steps) > (double)plan->steps)
        group_fault(group, "every", errors, "%.12g must not exceed the measured time %.12g",
                    par->every, (double)plan->steps * plan->time_step);
}

/* The shortest `every` with which this many rods fit, in ticks. */
static int64_t shortest_every(int64_t rods, const struct plan *plan)
{
    int64_t points = NUMBERS_MAX / rods;
    return points > 1 ? plan->steps / points + 1 : plan->steps;
}

static void check_size(const struct bcd_group *group, const struct plan *plan,
                       struct bcd_errors *errors)
{
    const struct trajectory_par *par = group->values;
    struct extent extent = extent_of(par, plan);
    int64_t rods = par->rods > 0 ? par->rods : 1, most = NUMBERS_MAX / extent.points;
    double every = (double)shortest_every(rods, plan) * plan->time_step;
    if (rods <= most)
        return;
    if (most > 0 && par->rods > 0)
        group_fault(group, "rods", errors,
                    "%lld rods at %lld moments are more than %d numbers: at most %lld rods, or "
                    "every at least %.6g",
                    (long long)rods, (long long)extent.points, NUMBERS_MAX, (long long)most, every);
    else
        group_fault(group, "every", errors,
                    "%lld moments of %lld rods are more than %d numbers: at least %.6g",
                    (long long)extent.points, (long long)rods, NUMBERS_MAX, every);
}

static void trajectory_check(const struct bcd_group *group, const struct plan *plan,
                             struct bcd_errors *errors)
{
    const struct trajectory_par *par = group->values;
    check_every(group, plan, errors);
    if (par->first >= plan->particles)
        group_fault(group, "first", errors, "%lld must be below particles = %lld",
                    (long long)par->first, (long long)plan->particles);
    else if (par->rods > plan->particles - par->first)
        group_fault(group, "rods", errors, "%lld must not exceed particles - first = %lld",
                    (long long)par->rods, (long long)(plan->particles - par->first));
    else if (par->rods > NUMBERS_MAX / 2)
        group_fault(group, "rods", errors, "%lld must not exceed %d: two moments of each fit",
                    (long long)par->rods, NUMBERS_MAX / 2);
    else
        check_size(group, plan, errors);
}

/* So many steps between two positions that the automatic step need not divide `every`. */
static double trajectory_time_step_max(const void *par, const struct plan *plan)
{
    (void)plan;
    return ((const struct trajectory_par *)par)->every / STEPS_ROUNDED;
}

static size_t trajectory_count(const void *par, const struct plan *plan)
{
    struct extent extent = extent_of(par, plan);
    return (size_t)(extent.points * extent.rods);
}

static size_t trajectory_memory(const void *par, const struct plan *plan)
{
    return sizeof(struct trajectory_memory) + trajectory_count(par, plan) * sizeof(double);
}

/* --------------------------------------------------------------- in motion */

static void trajectory_sample(struct observer *o, const struct sim *sim)
{
    struct trajectory_memory *memory = o->memory;
    const struct trajectory_par *par = o->par;
    const struct plan *plan = o->plan;
    double turned = (double)sim->clock->turns * plan->length;
    for (int64_t r = 0; r < memory->extent.rods; r++) {
        int64_t i = par->first + r;
        memory->x[r * memory->extent.points + memory->seen] =
            sim->seen[i] + (double)i * plan->diameter + turned;
    }
    memory->seen++;
}

static void trajectory_begin(struct observer *o, const struct sim *sim)
{
    struct trajectory_memory *memory = o->memory;
    memset(memory, 0, trajectory_memory(o->par, o->plan));
    memory->extent = extent_of(o->par, o->plan);
    memory->followed = sim->noise.realization == 0;
    if (memory->followed)
        trajectory_sample(o, sim);
}

static int64_t trajectory_next(const struct observer *o, int64_t after)
{
    const struct trajectory_memory *memory = o->memory;
    return memory->followed ? (after / memory->extent.every + 1) * memory->extent.every
                            : INT64_MAX;
}

static void trajectory_end_block(struct observer *o, const struct sim *sim, double *values)
{
    (void)sim;
    struct trajectory_memory *memory = o->memory;
    const int64_t points = memory->extent.points;
    for (size_t i = 0; i < o->count; i++) {
        int64_t point = (int64_t)i % points;
        values[i] = point >= memory->told && point < memory->seen ? memory->x[i] : NAN;
    }
    memory->told = memory->seen;
}

/* ------------------------------------------------------------------ result */

static enum bcd_status trajectory_describe(const void *par, const struct plan *plan,
                                           const struct moments *moments, struct bcd_table *table)
{
    (void)moments;
    struct extent extent = extent_of(par, plan);
    table_describe(table, "trajectory", (size_t)(extent.points * extent.rods));
    table_axes(table, "time t", "position x(t), unwrapped");
    double *time = table_add(table, "time", BCD_ROLE_X);
    double *rod = table_add(table, "rod", BCD_ROLE_SERIES);
    if (!time || !rod)
        return BCD_NO_MEMORY;
    for (size_t i = 0; i < table->rows; i++) {
        int64_t row = (int64_t)i;
        time[i] = (double)(row % extent.points * extent.every) * plan->time_step;
        rod[i] = (double)(((const struct trajectory_par *)par)->first + row / extent.points);
    }
    return BCD_OK;
}

static enum bcd_status trajectory_extend(const void *par, const struct plan *plan,
                                         struct bcd_table *table)
{
    struct extent extent = extent_of(par, plan);
    table_make_absent(table, BCD_ROLE_STDERR, "one path of each rod: no mean, no error bar");
    table_note_text(table, "of", "the first realization");
    table_note_number(table, "rods", (double)extent.rods);
    table_note_number(table, "every", (double)extent.every * plan->time_step);
    return BCD_OK;
}

const struct observable_type observable_trajectory = {
    .base = {.part = {.name = "trajectory",
                      .doc = "positions of rods in the course of the first realization",
                      .params = trajectory_params},
             .par_size = sizeof(struct trajectory_par)},
    .check = trajectory_check,
    .time_step_max = trajectory_time_step_max,
    .value = "x",
    .no_time_step_error = "one path, not a mean",
    .no_error_bar = "one path, not a mean",
    .dynamic = true,
    .mid_drift = true,
    .count = trajectory_count,
    .memory = trajectory_memory,
    .begin = trajectory_begin,
    .next = trajectory_next,
    .sample = trajectory_sample,
    .end_block = trajectory_end_block,
    .describe = trajectory_describe,
    .extend = trajectory_extend,
};
