/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plan.c - from what the job says to what the runs do: periods, method, time step, sampling,
 * chunks. See plan.h and scene.h.
 */
#include "scene.h"
#include "equilibrium.h"
#include "scene_cache.h"
#include "status.h"
#include "plan_step.h"
#include "step_error.h"
#include "step_limit.h"
#include "target.h"
#include "theory/sampler.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const double steps_max = 1e15; /* counts stay exact in doubles */
static const double chunk_rod_steps = 2e6; /* short realizations share a chunk of about this work */
static const double sampling_share = 0.16; /* of the run time goes into static observables */
/* BLOCKS of one realization: few and long, for neighbours in time are to be independent. */
enum { PER_CHUNK_MAX = 64, BLOCKS = 8, SAMPLES_PER_BLOCK = 4, EQUILIBRIUM_PARTICLES_MAX = 20000,
       EQUILIBRIUM_BARRIER_MAX = 2500 };

/* ------------------------------------------------------- geometry and field */

static void plan_geometry(struct bcd_scene *scene, struct bcd_errors *errors)
{
    const struct job_par *job = &scene->job;
    struct plan *plan = &scene->plan;
    plan->particles = job->particles;
    plan->length = job->length;
    plan->diameter = job->diameter;
    plan->mobility = job->mobility;
    plan->temperature = job->temperature;
    plan->diffusion = job->mobility * job->temperature;
    plan->force = job->force;
    plan->tolerance = job->tolerance;
    plan->walls = job->boundary == BOUNDARY_WALLS;
    plan->low = plan->walls ? job->diameter / 2 : 0;
    plan->initial = job->initial;
    plan->seed = (uint64_t)job->seed;
    plan->realizations = job->realizations;

    /* N sigma = L up to rounding is the closed packing: one rigid body. So are gaps that positions
     * of this length cannot tell from none. */
    double occupied = (double)job->particles * job->diameter;
    double rounding = 1e-14 * job->length;
    plan->free_length = job->length - occupied;
    if (plan->free_length < 1e-12 * job->length)
        plan->free_length = 0;
    if (occupied > job->length + rounding)
        bcd_errors_add(errors, "/diameter",
                       "particles * diameter = %.12g must not exceed length = %.12g", occupied,
                       job->length);
}

/* The part of a slot that takes one, completed; NULL = none. */
static struct scene_part *complete_part(struct bcd_scene *scene, enum bcd_slot slot,
                                        struct bcd_scene_cache *cache, struct bcd_errors *errors)
{
    for (size_t i = 0; i < scene->part_count; i++) {
        struct scene_part *part = &scene->parts[i];
        if (part->slot != slot)
            continue;
        scene_cache_complete(cache, scene, part, errors);
        return part;
    }
    return NULL;
}

/* On a ring a whole number of the potential's periods. Forces have the potential's own period,
 * profiles L / periods: 64 L away, where rods are moved back, both must still agree. */
static void plan_period(struct plan *plan, struct bcd_errors *errors)
{
    double period = plan->potential->period(plan->potential_par);
    if (!isfinite(period)) {
        bcd_errors_add(errors, "/potential",
                       "has no period: it needs \"boundary\": \"walls\", or a \"period\"");
        return;
    }
    double periods = rint(plan->length / period);
    double off = fabs(plan->length / period - periods);
    if (periods > 1e9) {
        bcd_errors_add(errors, "/length",
                       "holds %.3g periods of the potential (%.12g); at most 1e9 are possible",
                       periods, period);
        return;
    }
    if (periods < 1 || off > fmin(1e-9 * periods, 1e-6)) {
        double below = fmax(1, floor(plan->length / period)) * period;
        bcd_errors_add(errors, "/length",
                       "must be a whole number of periods of the potential (%.12g): for "
                       "example %.12g or %.12g, not %.12g",
                       period, below, below + period, plan->length);
        return;
    }
    plan->periods = (int64_t)periods;
    plan->period = plan->length / periods;
}

static void plan_field(struct bcd_scene *scene, struct bcd_scene_cache *cache,
                       struct bcd_errors *errors)
{
    struct plan *plan = &scene->plan;
    plan->period = plan->length;
    plan->periods = 1;
    size_t before = errors->count;
    struct scene_part *part = complete_part(scene, BCD_SLOT_POTENTIAL, cache, errors);
    if (!part || errors->count > before)
        return;
    plan->potential = potential_types[part->index];
    plan->potential_par = part->group.values;
    plan->field = !plan->potential->flat(plan->potential_par);
    if (!plan->walls)
        plan_period(plan, errors);
}

static double force_at(const struct plan *plan, double x)
{
    const struct rods one = {.y = &x, .count = 1};
    double force = plan->force;
    if (plan->field)
        plan->potential->add_force(plan->potential_par, &one, 1, &force);
    return force;
}

/* Largest repulsion of a pair over the distances that rods come to: up to 5 kT, or the mean one
 * where they are pressed closer. */
static double pair_push(const struct plan *plan)
{
    enum { PLACES = 1024 };
    const double energy_max = 5 * plan->temperature, mean = plan->length / (double)plan->particles;
    if (!plan->pair)
        return 0;
    double range = plan->pair->range(plan->pair_par), push = 0;
    double r = plan->diameter + range, before = 0;
    for (int i = PLACES - 1; i > 0; i--) {
        r = plan->diameter + range * i / PLACES;
        double now = plan->pair->energy(plan->pair_par, r, plan->temperature);
        if (now > energy_max && r < mean)
            break;
        push = fmax(push, (now - before) * PLACES / range);
        before = now;
    }
    return isfinite(push) ? push : 0;
}

static void plan_press(struct plan *plan)
{
    if (!plan->walls)
        return;
    double left = -force_at(plan, plan->low),
           right = force_at(plan, plan->length - plan->diameter / 2);
    plan->press = fmax(0, fmax(left, right)) + pair_push(plan);
}

/* Steepest slope and height of the field, from energies at many places. */
static void plan_slope(struct bcd_scene *scene, struct bcd_scene_cache *cache)
{
    struct plan *plan = &scene->plan;
    plan->slope = fabs(plan->force);
    if (!plan->field)
        return;
    double width = plan->walls ? plan->length - plan->diameter : plan->period;
    struct field_scan scan = {.from = plan->low, .width = width};
    scene_cache_scan(cache, scene, &scan);
    plan->slope += scan.steepest;
    plan->barrier = scan.barrier;
}

static void plan_pair(struct bcd_scene *scene, struct bcd_scene_cache *cache,
                      struct bcd_errors *errors)
{
    struct plan *plan = &scene->plan;
    size_t before = errors->count;
    struct scene_part *part = complete_part(scene, BCD_SLOT_INTERACTION, cache, errors);
    if (!part || errors->count > before || plan->particles < 2)
        return;
    const struct pair_type *pair = pair_types[part->index];
    plan->pair = pair->absent(part->group.values) ? NULL : pair;
    plan->pair_par = part->group.values;
    if (plan->pair)
        plan->stiffness = scene_cache_stiffness(cache, scene);
}

/* What the observables ask of the method. */
static void plan_demands(struct bcd_scene *scene)
{
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        scene->plan.asks_dynamics = scene->plan.asks_dynamics || type->dynamic;
        scene->plan.asks_contact_forces = scene->plan.asks_contact_forces || type->contact_forces;
        scene->plan.looks_inside =
            scene->plan.looks_inside || type->sample_ns || type->mid_drift;
    }
}

/* ------------------------------------------------------------------ method */

/* Why a method cannot run the plan; NULL = it can. */
static const char *lacks(const struct method_type *method, const struct plan *plan)
{
    if (plan->asks_contact_forces && !method->contact_forces)
        return "has no clusters whose contact forces could be measured";
    bool contact = plan->pair && plan->pair->contact && plan->pair->contact(plan->pair_par);
    if (contact && !method->bonds)
        return "knows no bonds: an interaction of range 0 needs \"strang_bonds\"";
    return NULL;
}

static const char *why_not(const struct method_type *method, const struct plan *plan)
{
    const char *lacking = lacks(method, plan);
    return lacking ? lacking : method->cannot ? method->cannot(plan) : NULL;
}

/* Of all that cannot: the one that lacks least, for it knows the interaction and its reason is the
 * scene's. */
static void plan_no_method(const struct plan *plan, struct bcd_errors *errors)
{
    for (size_t i = 0; method_types[i]; i++) {
        const struct method_type *method = method_types[i];
        if (method->cannot && method->cannot(plan) && !lacks(method, plan)) {
            bcd_errors_add(errors, "/method", "no method can run this: \"%s\" %s",
                           method->part.name, method->cannot(plan));
            return;
        }
    }
    bcd_errors_add(errors, "/method", "no method can run this");
}

/* Auto: the first registered method that can run the plan, for the list begins with the cheapest.
 * The second, strang, can run all but what the ones after it are there for. */
static void plan_method(struct bcd_scene *scene, struct bcd_errors *errors)
{
    struct plan *plan = &scene->plan;
    if (scene->job.method == 0) {
        size_t i = 0;
        while (method_types[i + 1] && why_not(method_types[i], plan))
            i++;
        plan->method = method_types[i];
    } else {
        plan->method = method_types[scene->job.method - 1];
    }
    const char *reason = why_not(plan->method, plan);
    if (reason && scene->job.method == 0)
        plan_no_method(plan, errors);
    else if (reason)
        bcd_errors_add(errors, "/method", "\"%s\" %s", plan->method->part.name, reason);
}

/* ---------------------------------------------------------------- sampling */

static double sample_cost(const struct bcd_scene *scene)
{
    double cost = 0;
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        cost += type->sample_ns ? type->sample_ns(part->group.values, &scene->plan) : 0;
    }
    if (cost == 0)
        return 0;
    /* What a look costs whatever the number of rods: noise of its own for views comes in bulk. */
    const double look_ns = 100, view_ns = 1000, rods = (double)scene->plan.particles;
    bool views = step_error_views_used(&scene->plan);
    return cost + (views ? scene->plan.method->view_ns + view_ns / rods : look_ns / rods);
}

/* Auto: static observables take at most a fifth of the run time, counted in the parts' own rough
 * costs so that it depends on the job alone; and every block gets a few samples. */
static int64_t sampling_auto(const struct plan *plan)
{
    double step_ns = plan->method->step_ns + 60 / (double)plan->particles;
    double steps = ceil(plan->sample_ns / (sampling_share * step_ns));
    double most = floor((double)plan->steps / (double)(plan->blocks * SAMPLES_PER_BLOCK));
    return (int64_t)fmax(1, fmin(steps, most));
}

static void plan_sampling(struct bcd_scene *scene, struct bcd_errors *errors)
{
    const struct job_par *job = &scene->job;
    struct plan *plan = &scene->plan;
    plan->blocks = plan->realizations > 1 || plan->steps < BLOCKS ? 1 : BLOCKS;
    plan->sample_ns = sample_cost(scene);
    if (isnan(job->sample_every)) {
        plan->sample_steps = sampling_auto(plan);
        return;
    }
    double steps = rint(job->sample_every / plan->time_step);
    double off = fabs(job->sample_every / plan->time_step - steps);
    if (steps < 1 || off > 1e-6 * steps)
        bcd_errors_add(errors, "/sample_every",
                       "%.12g must be a whole multiple of the time step %.12g", job->sample_every,
                       plan->time_step);
    else if (steps > (double)plan->steps)
        bcd_errors_add(errors, "/sample_every", "%.12g must not exceed time = %.12g",
                       job->sample_every, job->time);
    plan->sample_steps = steps >= 1 && steps <= steps_max ? (int64_t)steps : 1;
}

/* Whether starts can be drawn, as far as that is cheap to tell: plan_prepare does the rest. Draws
 * cost about N^(3/2) steps of a microsecond each. */
static void plan_initial(struct bcd_scene *scene, struct bcd_errors *errors)
{
    struct plan *plan = &scene->plan;
    if (plan->initial != INITIAL_EQUILIBRIUM)
        return;
    const char *missing = equilibrium_missing(plan);
    if (missing) {
        bcd_errors_add(errors, "/initial", "\"equilibrium\" is not possible: %s", missing);
        return;
    }
    if (plan->particles > EQUILIBRIUM_PARTICLES_MAX) {
        bcd_errors_add(errors, "/initial",
                       "\"equilibrium\" is drawn for at most %d particles, not %lld",
                       EQUILIBRIUM_PARTICLES_MAX, (long long)plan->particles);
        return;
    }
    if (plan->barrier > EQUILIBRIUM_BARRIER_MAX * plan->temperature) {
        bcd_errors_add(errors, "/initial",
                       "\"equilibrium\" is drawn where the potential spans at most %d kT, not %.4g",
                       EQUILIBRIUM_BARRIER_MAX, plan->barrier / plan->temperature);
    }
}

enum bcd_status plan_prepare(struct bcd_scene *scene, struct bcd_watch *watch,
                             struct bcd_errors *errors)
{
    struct plan *plan = &scene->plan;
    if (plan->initial != INITIAL_EQUILIBRIUM || plan->sampler)
        return BCD_OK;
    struct theory_system system = equilibrium_system(plan);
    struct bcd_error error = {0};
    system.watch = watch;
    enum bcd_status status = theory_sampler_create(&plan->sampler, &system, &error);
    if (status == BCD_STOPPED)
        bcd_errors_add(errors, "/initial", "finding out how to draw \"equilibrium\" %s",
                       error.text);
    else if (status)
        bcd_errors_add(errors, "/initial", "\"equilibrium\" is not possible: %.180s", error.text);
    scene->coarse.sampler = plan->sampler;
    return status;
}

static void plan_chunks(struct plan *plan)
{
    double work = (double)plan->particles * (double)(plan->steps + plan->equilibration_steps);
    double fit = floor(chunk_rod_steps / work);
    plan->per_chunk = fit < 1 ? 1 : fit > PER_CHUNK_MAX ? PER_CHUNK_MAX : (int64_t)fit;
    plan->chunks = (plan->realizations + plan->per_chunk - 1) / plan->per_chunk;
}

void plan_make(struct bcd_scene *scene, struct bcd_scene_cache *cache, struct bcd_errors *errors)
{
    target_complete(scene, errors);
    plan_geometry(scene, errors);
    plan_field(scene, cache, errors);
    plan_pair(scene, cache, errors);
    plan_slope(scene, cache);
    plan_press(&scene->plan);
    plan_demands(scene);
    plan_method(scene, errors);
    if (errors->count > 0)
        return;
    plan_time_step(scene, errors);
    if (errors->count > 0)
        return;
    plan_sampling(scene, errors);
    plan_initial(scene, errors);
    plan_pairs(scene);
    target_limit(scene, errors);
    plan_chunks(&scene->plan);
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++)
        if (scene_observable_type(part)->check)
            scene_observable_type(part)->check(&part->group, &scene->plan, errors);
}

/* ------------------------------------------------------------------- facts */

static struct bcd_fact *next_fact(struct bcd_scene *scene, const char *name, const char *unit)
{
    struct bcd_fact *fact = &scene->facts[scene->fact_count++];
    *fact = (struct bcd_fact){.name = name, .unit = unit};
    return fact;
}

static void fact_number(struct bcd_scene *scene, const char *name, const char *unit, double value)
{
    struct bcd_fact *fact = next_fact(scene, name, unit);
    fact->kind = BCD_FACT_NUMBER;
    fact->number = value;
}

static void fact_integer(struct bcd_scene *scene, const char *name, int64_t value)
{
    struct bcd_fact *fact = next_fact(scene, name, "");
    fact->kind = BCD_FACT_INTEGER;
    fact->integer = value;
}

static void fact_text(struct bcd_scene *scene, const char *name, const char *text)
{
    struct bcd_fact *fact = next_fact(scene, name, "");
    fact->kind = BCD_FACT_TEXT;
    snprintf(fact->text, sizeof fact->text, "%s", text);
}

/* A rod leaves a well of curvature k at a rate of about mu k/(2 pi) exp(-barrier/kT) (Kramers). */
static bool rods_stay_in_wells(const struct plan *plan)
{
    if (plan->walls || !plan_field_steady(plan) || !(plan->temperature > 0) || plan->force != 0)
        return false;
    double rate = curvature_rate(plan) / (2 * M_PI) * exp(-plan->barrier / plan->temperature);
    return rate * (double)plan->steps * plan->time_step < 1;
}

void plan_list_facts(struct bcd_scene *scene)
{
    const struct plan *plan = &scene->plan;
    double h = plan->time_step;
    fact_number(scene, "diffusion", "length^2/time", plan->diffusion);
    fact_number(scene, "density", "1/length", (double)plan->particles / plan->length);
    fact_number(scene, "free_length", "length", plan->free_length);
    fact_text(scene, "method", plan->method->part.name);
    fact_number(scene, "time_step", "time", h);
    fact_text(scene, "time_step_limited_by", scene->time_step_why);
    if (scene->unstable[0])
        fact_text(scene, "time_step_warning", scene->unstable);
    if (plan->field)
        fact_number(scene, "curvature_time_step", "", h * curvature_rate(plan));
    if (rods_stay_in_wells(plan))
        fact_text(scene, "ergodicity_warning",
                  "rods hardly leave their wells in this time: averages over time keep what the "
                  "start was; take \"initial\": \"equilibrium\" and many realizations");
    if (plan->pair)
        fact_number(scene, "stiffness_time_step", "", h * stiffness_rate(plan));
    if (plan->diffusion > 0 && plan->particles > 1 && plan->free_length > 0)
        fact_number(scene, "noise_per_gap", "",
                    sqrt(2 * plan->diffusion * h) * (double)plan->particles / plan->free_length);
    fact_integer(scene, "steps", plan->steps);
    fact_integer(scene, "equilibration_steps", plan->equilibration_steps);
    fact_number(scene, "time", "time", (double)plan->steps * h);
    fact_number(scene, "sample_every", "time", (double)plan->sample_steps * h);
    if (bcd_scene_part(scene, BCD_SLOT_TARGET, 0))
        fact_integer(scene, "realizations_at_most", plan->realizations);
    else if (plan->paired > 0)
        fact_integer(scene, "paired_realizations", plan->paired);
    fact_integer(scene, "chunks", plan->chunks);
    fact_integer(scene, "result_version", BCD_RESULT_VERSION);
}
