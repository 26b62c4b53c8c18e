/* SPDX-License-Identifier: GPL-3.0-or-later
 * nominal.c - see nominal.h. */
#include "nominal.h"
#include "equilibrium.h"
#include "theory/cost.h"

#include <math.h>

/* Beyond that of a cosine. */
static double field_ns(const struct plan *plan)
{
    const struct potential_type *type = plan->field ? plan->potential : NULL;
    return type && type->force_ns ? type->force_ns(plan->potential_par, plan) : 0;
}

/* Per rod; as many pairs as are within range on average. */
static double pairs_ns(const struct plan *plan)
{
    const double usual = 12;
    if (!plan->pair)
        return 0;
    double each = plan->pair->force_ns ? plan->pair->force_ns(plan->pair_par) : usual;
    double reach = plan->diameter + plan->pair->range(plan->pair_par);
    double pairs = plan->pair->nearest ? 1 : reach * (double)plan->particles / plan->length;
    return each * fmin(fmax(pairs, 1), (double)plan->particles);
}

/* Per rod: places that it moves by insertion, but no more than sorting by merging takes. */
static double sort_ns(const struct plan *plan)
{
    const double place = 3.2, pass = 12;
    const double rods = (double)plan->particles, gap = plan->free_length / rods;
    if (!plan->method->sorts || !(gap > 0) || rods < 2)
        return 0;
    double gaps = sqrt(2 * plan->diffusion * plan->time_step) / gap;
    return fmin(place * gaps, pass * log2(rods));
}

/* Per step: the rods, what acts on them, a fixed part for calls and loop starts; then the looks.
 * Rough on purpose: whoever wants to know better compares it with what runs have taken. */
static double nominal_ns(const struct bcd_scene *scene, double rod_steps)
{
    const double without_field = 0.6;
    const struct plan *plan = &scene->plan;
    const struct scene_part *part;
    double per_rod = plan->method->step_ns * 1.4 * (plan->field ? 1 : without_field) +
                     field_ns(plan) + pairs_ns(plan) + sort_ns(plan) +
                     60 / (double)plan->particles + plan->sample_ns / (double)plan->sample_steps;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        per_rod += type->step_ns ? type->step_ns(part->group.values, plan) : 0;
    }
    return rod_steps * per_rod;
}

/* Equilibrium starts: finding out how, and draws. */
static double starts_ns(const struct bcd_scene *scene)
{
    const struct plan *plan = &scene->plan;
    if (plan->initial != INITIAL_EQUILIBRIUM)
        return 0;
    struct theory_system system = equilibrium_system(plan);
    double draws = (double)plan->realizations + (double)plan->paired;
    return 1e9 * (theory_cost_sampler(&system).seconds + draws * theory_cost_draw(&system).seconds);
}

double nominal_seconds(const struct bcd_scene *scene, double rod_steps)
{
    return 1e-9 * (nominal_ns(scene, rod_steps) + starts_ns(scene));
}
