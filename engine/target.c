/* SPDX-License-Identifier: GPL-3.0-or-later
 * target.c - see target.h and bcd.h. */
#include "target.h"
#include "plan_step.h"
#include "step_error.h"
#include "table.h"
#include "tally.h"

#include <assert.h>
#include <math.h>

/* REALIZATIONS a target may use where the job gives no number. The first milestone has BEGIN of
 * them: error bars from fewer are no ground to stop on. */
enum { REALIZATIONS = 1000, BEGIN = 8 };

struct target_par {
    int64_t observable; /* index of the choice: that of the observable's type */
    double relative_error, rod_steps;
};

static const char *observable_word(size_t i)
{
    return observable_types[i] ? observable_types[i]->base.part.name : NULL;
}

static const struct bcd_param target_params[] = {
    {.name = "observable", .type = BCD_PARAM_CHOICE, .required = true, .choice = observable_word,
     .doc = "which of the job's observables", .offset = offsetof(struct target_par, observable)},
    {.name = "relative_error", .type = BCD_PARAM_NUMBER, .required = true, .above_min = true,
     .min = 0, .max = 1, .doc = "standard error and time-step error of it together, as a share",
     .offset = offsetof(struct target_par, relative_error)},
    {.name = "rod_steps", .type = BCD_PARAM_AUTO, .above_min = true, .min = 0, .max = 1e30,
     .fallback = NAN,
     .doc = "what it may cost: time steps of all rods and realizations together",
     .offset = offsetof(struct target_par, rod_steps)},
    {0},
};

const struct part_type target_type = {
    .part = {.name = "target",
             .doc = "realizations are added until an observable is known this well; the job's "
                    "realizations are the most there may be",
             .params = target_params},
    .par_size = sizeof(struct target_par),
};

static const struct bcd_group *group_of(const struct bcd_scene *scene)
{
    return bcd_scene_part(scene, BCD_SLOT_TARGET, 0);
}

/* ---------------------------------------------------------------- planning */

/* Which of the scene's observables it is about; its index, or -1. */
static int64_t observable_of(const struct bcd_scene *scene, const struct target_par *par)
{
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++)
        if (part->index == par->observable)
            return (int64_t)i;
    return -1;
}

void target_complete(struct bcd_scene *scene, struct bcd_errors *errors)
{
    const struct bcd_group *group = group_of(scene);
    if (!group)
        return;
    const struct target_par *par = group->values;
    const struct bcd_param *row = bcd_group_find(&scene->group, "realizations");
    if (!(scene->group.given >> (row - scene->group.rows) & 1))
        bcd_group_set_integer(&scene->group, row, REALIZATIONS, errors);
    if (scene->job.realizations < 2)
        bcd_errors_add(errors, "/realizations",
                       "a target needs 2 at least: they are the most there may be");
    if (observable_of(scene, par) < 0)
        group_fault(group, "observable", errors, "is not among the job's observables");
    else if (observable_types[par->observable]->no_error_bar)
        group_fault(group, "observable", errors, "has no error bar: %s",
                    observable_types[par->observable]->no_error_bar);
}

void target_limit(struct bcd_scene *scene, struct bcd_errors *errors)
{
    const struct bcd_group *group = group_of(scene);
    const struct target_par *par = group ? group->values : NULL;
    if (!group || isnan(par->rod_steps) || plan_rod_steps(scene, scene->plan.realizations) <=
                                               par->rod_steps)
        return;
    double two = plan_rod_steps(scene, 2);
    if (!(two <= par->rod_steps)) {
        group_fault(group, "rod_steps", errors,
                    "must be at least %.6g, what two realizations take, not %.6g", two,
                    par->rod_steps);
        return;
    }
    int64_t enough = 2, many = scene->plan.realizations; /* affordable, not affordable */
    while (many - enough > 1) {
        int64_t middle = enough + (many - enough) / 2;
        if (plan_rod_steps(scene, middle) <= par->rod_steps)
            enough = middle;
        else
            many = middle;
    }
    scene->plan.realizations = enough;
}

/* -------------------------------------------------------------- milestones */

int64_t bcd_scene_goal(const struct bcd_scene *scene, int64_t chunks)
{
    return group_of(scene) ? bcd_scene_milestone(scene, chunks) : scene->plan.chunks;
}

int64_t bcd_scene_milestone(const struct bcd_scene *scene, int64_t chunks)
{
    const struct plan *plan = &scene->plan;
    int64_t goal = (BEGIN + plan->per_chunk - 1) / plan->per_chunk;
    while (goal <= chunks && goal < plan->chunks)
        goal += goal > 1 ? goal / 2 : 1;
    return goal < plan->chunks ? goal : plan->chunks;
}

/* --------------------------------------------------------------- judgement */

/* Errors of a table as shares of its values: sums of squares over all rows that have both. */
struct shares {
    double statistical, time_step, least; /* least: what the time step does beyond doubt */
    double values;                        /* that they are shares of */
};

/* Where values spread over decades every row counts for itself, else every row for what it adds. */
static void add_row(struct shares *shares, bool each, double value, const double errors[3])
{
    double scale = each ? value * value : 1;
    if (each && value == 0)
        return;
    shares->statistical += errors[0] * errors[0] / scale;
    shares->time_step += errors[1] * errors[1] / scale;
    shares->least += errors[2] * errors[2] / scale;
    shares->values += each ? 1 : value * value;
}

static double share(double sum, const struct shares *shares)
{
    return sum > 0 ? sqrt(sum / shares->values) : shares->values > 0 ? 0 : NAN;
}

static struct shares sum_up(const struct bcd_tally *tally, const struct bcd_scene *scene,
                            size_t index, const struct bcd_table *table)
{
    const struct observable_type *type = scene_observable_type(scene_observable(scene, index));
    const double *value = bcd_table_column(table, BCD_ROLE_VALUE)->values,
                 *error = bcd_table_column(table, BCD_ROLE_STDERR)->values;
    const struct bcd_column *step = bcd_table_column(table, BCD_ROLE_TIME_STEP_ERROR);
    struct moments one = tally_moments(tally, scene, index, 0),
                   other = tally_moments(tally, scene, index, 1);
    struct shares shares = {0};
    for (size_t i = 0; i < table->rows; i++) {
        double off = step && step->values && !isnan(step->values[i]) ? step->values[i] : 0;
        double least = step_error_least(type, &scene->plan, &one, &other, i);
        if (!isnan(value[i]) && !isnan(error[i]))
            add_row(&shares, table->log_y, value[i], (double[3]){error[i], off, least});
    }
    return shares;
}

/* How many realizations it will take, if errors go on falling as they do. */
static double expected(const struct bcd_verdict *verdict, double target, double most)
{
    double room = target * target - verdict->time_step * verdict->time_step;
    double needed = verdict->statistical * verdict->statistical / room;
    needed *= (double)verdict->realizations;
    return room > 0 && needed < most ? needed : most;
}

static void decide(const struct bcd_scene *scene, double least, struct bcd_verdict *verdict)
{
    const struct target_par *par = group_of(scene)->values;
    const struct plan *plan = &scene->plan;
    verdict->expected = expected(verdict, par->relative_error, (double)plan->realizations);
    verdict->stop = verdict->error <= par->relative_error       ? BCD_STOP_TARGET
                    : least > par->relative_error               ? BCD_STOP_TIME_STEP
                    : verdict->realizations < plan->realizations ? BCD_STOP_NOT
                    : plan->realizations < scene->job.realizations ? BCD_STOP_ROD_STEPS
                                                                 : BCD_STOP_REALIZATIONS;
}

enum bcd_status bcd_tally_judge(const struct bcd_tally *tally, const struct bcd_scene *scene,
                                struct bcd_verdict *verdict)
{
    struct bcd_verdict found = {.stop = BCD_STOP_ALL, .error = NAN, .statistical = NAN,
                                .time_step = NAN};
    found.realizations = bcd_tally_realizations(tally);
    found.expected = (double)scene->plan.realizations;
    if (group_of(scene)) {
        struct bcd_table *table = NULL;
        size_t index = (size_t)observable_of(scene, group_of(scene)->values);
        enum bcd_status status = bcd_tally_table(tally, scene, NULL, index, &table);
        if (status)
            return status;
        struct shares shares = sum_up(tally, scene, index, table);
        found.statistical = share(shares.statistical, &shares);
        found.time_step = share(shares.time_step, &shares);
        found.error = share(shares.statistical + shares.time_step, &shares);
        decide(scene, share(shares.least, &shares), &found);
        bcd_table_free(table);
    }
    *verdict = found;
    return BCD_OK;
}

const char *bcd_stop_name(enum bcd_stop stop)
{
    static const char *const names[] = {
        [BCD_STOP_NOT] = "not",           [BCD_STOP_ALL] = "all",
        [BCD_STOP_TARGET] = "target",     [BCD_STOP_REALIZATIONS] = "realizations",
        [BCD_STOP_ROD_STEPS] = "rod_steps", [BCD_STOP_TIME_STEP] = "time_step_error",
    };
    return names[stop];
}
