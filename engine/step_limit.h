/* SPDX-License-Identifier: GPL-3.0-or-later
 * step_limit.h - what limits a method's time step, and which limit decides. */
#ifndef STEP_LIMIT_H
#define STEP_LIMIT_H

#include "part.h"
#include "kernels/elementary.h"

struct step_limit {
    double step;
    const char *why;
};

static inline void step_limit(struct step_limit *limit, double step, const char *why)
{
    if (step < limit->step)
        *limit = (struct step_limit){step, why};
}

/* Rates that explicit steps must resolve: mu max|U''| and 2 D max|dF/dg|/kT; 0 where nothing acts.
 * */
static inline double curvature_rate(const struct plan *plan)
{
    return plan->field ? plan->mobility * plan->potential->curvature_max(plan->potential_par) : 0;
}

static inline double stiffness_rate(const struct plan *plan)
{
    if (!plan->pair)
        return 0;
    double unit = plan->pair->athermal ? plan->mobility : plan->diffusion;
    return 2 * unit * plan->stiffness;
}

/* Without forces that vary in space, reflection is all there is to a step: a drag shifts all rods
 * of a ring alike, but presses them against a wall. */
static inline bool moves_freely(const struct plan *plan)
{
    return !plan->field && !plan->pair && !(plan->walls && plan->force != 0);
}

/* How much longer than for the tolerance of .005 that shares were measured at, for errors of an
 * order in the step. */
static inline double tolerance_share(const struct plan *plan, double order)
{
    return power(plan->tolerance / 0.005, 1 / order);
}

/* D (F/kT)^2: how often noise crosses the layer kT/F that a force F presses against a wall. */
static inline double wall_rate(const struct plan *plan)
{
    double per_length = plan->temperature > 0 ? plan->press / plan->temperature : 0;
    return plan->diffusion * per_length * per_length;
}

/* The limits all methods have, as shares of the times above. */
static inline void step_limit_rates(struct step_limit *limit, const struct plan *plan,
                                    double curvature_share, double stiffness_share)
{
    const double wall_share = 0.2; /* measured: L1 .005 at D h (F/kT)^2 = .1, elastic .01 */
    double curvature = curvature_rate(plan), stiffness = stiffness_rate(plan);
    if (curvature > 0)
        step_limit(limit, curvature_share / curvature, "curvature of the potential");
    if (stiffness > 0)
        step_limit(limit, stiffness_share / stiffness, "stiffness of the interaction");
    if (wall_rate(plan) > 0)
        step_limit(limit, wall_share * curvature_share / wall_rate(plan), "force at the walls");
}

#endif
