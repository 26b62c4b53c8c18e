/* SPDX-License-Identifier: GPL-3.0-or-later
 * plan_step.c - see plan_step.h. */
#include "plan_step.h"
#include "step_error.h"
#include "step_limit.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static const double stability_max = 1; /* mu h max|U''|: beyond, profiles melt without a sign */
static const double steps_max = 1e15; /* counts stay exact in doubles and far from overflow */
static const double jump_max = 0.5; /* periods a step past the potential: beyond, it is missed */
static const double reach_max = 500; /* lengths L that drag or noise may carry a rod in a step: y
                                      * keeps its digits until it is moved back */

/* Length over which the potential repeats. */
static double field_period(const struct plan *plan)
{
    return plan->field ? plan->potential->period(plan->potential_par) : INFINITY;
}

/* How fast rods are dragged past the potential. */
static double speed_past_field(const struct plan *plan)
{
    const struct potential_type *type = plan->potential;
    if (!plan->field)
        return 0;
    double velocity = type->velocity ? type->velocity(plan->potential_par) : 0;
    return fabs(plan->mobility * plan->force - velocity);
}

/* The longest step within reach of drag and noise (normals end before 7 standard deviations). */
static double step_in_reach(const struct plan *plan)
{
    double reach = reach_max * plan->length, deviation = reach / 7;
    double by_drag = reach / (plan->mobility * fabs(plan->force));
    double by_noise = deviation * deviation / (2 * plan->diffusion);
    return fmin(by_drag, by_noise);
}

double plan_step_resolving(const struct bcd_scene *scene, const struct observable_type *type,
                           const void *par)
{
    const struct plan *plan = &scene->plan;
    bool any = !type->dynamic && step_error_of(type, plan) == STEP_ERROR_ZERO;
    return type->time_step_max && !any ? type->time_step_max(par, plan) : INFINITY;
}

/* The largest step that method, drag and observables allow. */
static struct step_limit step_allowed(const struct bcd_scene *scene)
{
    const struct plan *plan = &scene->plan;
    struct step_limit limit = plan->method->time_step(plan);
    step_limit(&limit, 0.1 * field_period(plan) / speed_past_field(plan),
               "drag past the potential: a tenth of a period a step");
    step_limit(&limit, step_in_reach(plan), "drag and noise over the whole ring");
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        step_limit(&limit, plan_step_resolving(scene, type, part->group.values),
                   type->base.part.name);
    }
    return limit;
}

/* A step no longer than allowed that divides the time which has to come out even. */
static double step_that_divides(const struct bcd_scene *scene, double allowed, const char **why)
{
    const struct job_par *job = &scene->job;
    double whole = isnan(job->sample_every) ? job->time : job->sample_every;
    if (allowed > whole) { /* nothing limits it: still show the run's course */
        allowed = isnan(job->sample_every) ? whole / 1024 : whole;
        *why = isnan(job->sample_every) ? "a 1024th of the time" : "sample_every";
    }
    return whole / ceil(whole / allowed * (1 - 1e-12));
}

/* A way in which too long a step goes wrong without a sign, and the longest step that does not. */
struct hazard {
    double longest;
    const char *what;
};

/* All of them for a plan; the number. */
enum { HAZARDS = 6 };
static void list_hazards(const struct plan *plan, struct hazard hazards[HAZARDS])
{
    double share = plan->method->any_step ? INFINITY : stability_max;
    hazards[0] = (struct hazard){share / curvature_rate(plan),
                                 "melts the profile: mobility * time_step * max|U''|"};
    hazards[1] = (struct hazard){share / stiffness_rate(plan),
                                 "silences the interaction: 2 * mobility * time_step * max|f'|"};
    hazards[2] = (struct hazard){jump_max * field_period(plan) / speed_past_field(plan),
                                 "drags rods past the potential: half periods a step"};
    hazards[3] = (struct hazard){step_in_reach(plan),
                                 "carries rods too far: steps of 500 lengths of the system"};
    hazards[4] = (struct hazard){share / (4 * wall_rate(plan)),
                                 "misses the layer at the walls: 4 D time_step (force / kT)^2"};
    double gap = plan->free_length / (double)plan->particles, far = 10 * gap;
    bool crowds = plan->method->bonds && plan->diffusion > 0 && gap > 0;
    hazards[5] = (struct hazard){crowds ? far * far / (4 * plan->diffusion) : INFINITY,
                                 "crowds collisions into a step: 4 D time_step / (10 gaps)^2"};
}

double plan_longest_step(const struct plan *plan)
{
    struct hazard hazards[HAZARDS];
    list_hazards(plan, hazards);
    double longest = INFINITY;
    for (int i = 0; i < HAZARDS; i++)
        longest = fmin(longest, hazards[i].longest);
    return longest;
}

/* Too long a step never fails: it melts the profile, jumps over wells or silences the stickiness.
 * Refused here, unless the job wants to see it. */
static void check_stability(struct bcd_scene *scene, struct bcd_errors *errors)
{
    const double h = scene->plan.time_step;
    struct hazard hazards[HAZARDS];
    list_hazards(&scene->plan, hazards);
    for (int i = 0; i < HAZARDS; i++) {
        const struct hazard *hazard = &hazards[i];
        if (!(h > hazard->longest))
            continue;
        char text[sizeof scene->unstable];
        snprintf(text, sizeof text, "%.6g %s = %.3g must not exceed 1", h, hazard->what,
                 h / hazard->longest);
        if (scene->job.stability == STABILITY_IGNORED)
            memcpy(scene->unstable, text, sizeof text);
        else
            bcd_errors_add(errors, "/time_step", "%s; the largest step that works is %.6g", text,
                           hazard->longest);
    }
}

void plan_time_step(struct bcd_scene *scene, struct bcd_errors *errors)
{
    const struct job_par *job = &scene->job;
    struct plan *plan = &scene->plan;
    if (isnan(job->time_step)) {
        struct step_limit limit = step_allowed(scene);
        plan->time_step = step_that_divides(scene, limit.step, &limit.why);
        scene->time_step_why = limit.why;
    } else {
        plan->time_step = job->time_step;
        scene->time_step_why = "given";
    }
    double h = plan->time_step;
    double steps = ceil(job->time / h * (1 - 1e-12));
    double before = ceil(job->equilibration_time / h * (1 - 1e-12));
    if (!(h > 0)) {
        bcd_errors_add(errors, "/time", "no time step is short enough: %s", scene->time_step_why);
        return;
    }
    if (!(steps + before <= steps_max)) {
        bcd_errors_add(errors, "/time",
                       "%.3g steps of %.3g are too many: time / time_step must not exceed %.0e",
                       steps + before, h, steps_max);
        return;
    }
    plan->steps = steps < 1 ? 1 : (int64_t)steps;
    plan->equilibration_steps = (int64_t)before;
    if (job->time < h * (1 - 1e-9))
        bcd_errors_add(errors, "/time_step", "%.12g must not exceed time = %.12g", h, job->time);
    check_stability(scene, errors);
}

/* ------------------------------------------------------- twice the time step */

/* How many plan_is_paired chooses: a quarter of the realizations, two at least; of a single one
 * half its blocks: at most half as much work again. */
static int64_t realizations_to_pair(int64_t realizations)
{
    int64_t quarter = (realizations + 3) / 4;
    return quarter > 2 ? quarter : realizations < 2 ? realizations : 2;
}

double plan_rod_steps(const struct bcd_scene *scene, int64_t realizations)
{
    const struct plan *plan = &scene->plan, *coarse = &scene->coarse;
    double steps = (double)(plan->equilibration_steps + plan->steps) * (double)realizations;
    if (plan->paired > 0)
        steps += (double)(coarse->equilibration_steps + coarse->steps) *
                 (double)realizations_to_pair(realizations);
    return steps * (double)plan->particles;
}

static bool wants_pairs(const struct bcd_scene *scene)
{
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++)
        if (step_error_of(scene_observable_type(part), &scene->plan) == STEP_ERROR_PAIR)
            return true;
    return false;
}

void plan_pairs(struct bcd_scene *scene)
{
    struct plan *plan = &scene->plan, *coarse = &scene->coarse;
    plan->fine = plan;
    plan->paired = realizations_to_pair(plan->realizations);
    if (scene->job.step_error == STEP_ERROR_SKIPPED)
        plan->no_pair = "not asked for (\"time_step_error\": \"skipped\")";
    else if (plan->steps < 2 * plan->blocks)
        plan->no_pair = "too few steps to run them at twice the length";
    else if (2 * plan->time_step > plan_longest_step(plan))
        plan->no_pair = "steps of twice the length would not be stable: repeat the job with half "
                        "the time_step";
    if (plan->no_pair || !wants_pairs(scene)) {
        plan->paired = 0;
        return;
    }
    *coarse = *plan;
    coarse->time_step = 2 * plan->time_step;
    coarse->blocks = plan->blocks > 1 ? plan->blocks / 2 : 1;
    coarse->steps = plan_block_end(plan, coarse->blocks - 1) / 2;
    coarse->equilibration_steps = plan->equilibration_steps / 2;
    coarse->sample_steps = plan->sample_steps > 1 ? plan->sample_steps / 2 : 1;
}
