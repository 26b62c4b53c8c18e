/* SPDX-License-Identifier: GPL-3.0-or-later
 * bcd_forms.c - see bcd_forms.h. */
#include "bcd_forms.h"
#include "step_limit.h"
#include "kernels/contact_forces.h"

#include <math.h>
#include <string.h>

void bcd_step_layout(struct bcd_step *step, const struct plan *plan, bool start,
                     struct arena *scratch)
{
    size_t rods = (size_t)plan->particles * sizeof(double);
    proposal_layout(&step->proposal, plan, scratch);
    step->start = start ? arena_take(scratch, rods) : NULL;
    step->ahead = plan->asks_contact_forces ? arena_take(scratch, 2 * rods) : NULL;
}

struct step_limit bcd_time_step(const struct plan *plan)
{
    const double gap_share = 0.25;
    struct step_limit limit = {INFINITY, "nothing"};
    double scale = tolerance_share(plan, 1), stable = 0.5; /* twice the step is, too */
    step_limit_rates(&limit, plan, fmin(0.018 * scale, stable), fmin(0.1 * scale, stable));
    double gap = plan->free_length / (double)plan->particles;
    if (plan->press > 0) /* the layer that a force presses against a wall */
        gap = fmin(gap, plan->temperature / plan->press);
    double reach = plan->tolerance * gap / gap_share;
    if ((plan->particles > 1 || plan->walls) && plan->diffusion > 0 && gap > 0)
        step_limit(&limit, reach * reach / (4 * plan->diffusion), "mean gap between rods");
    return limit;
}

void bcd_step_advance(struct sim *sim, struct bcd_step *step, bcd_resolver *resolve, int64_t ticks)
{
    size_t rods = (size_t)sim->plan->particles * sizeof(double);
    for (int64_t t = 0; t < ticks; t++) {
        memcpy(step->start, sim->y, rods);
        double *z = proposal_euler(&step->proposal, sim);
        resolve(sim, step->start, z);
        proposal_accept(sim, z);
    }
}

/* The next step on copies: its noise is a function of the tick, so that looking ahead leaves the
 * run as it is. */
void bcd_step_contact_forces(const struct sim *sim, struct bcd_step *step, bcd_resolver *resolve,
                             double *force)
{
    const struct plan *plan = sim->plan;
    size_t rods = (size_t)plan->particles * sizeof(double);
    double *resolved = step->ahead, *alone = step->ahead + plan->particles;
    struct sim next = *sim;
    next.y = alone; /* displaced in place where the proposal has no memory of its own for it */
    memcpy(alone, sim->y, rods);
    double *z = proposal_euler(&step->proposal, &next);
    memcpy(resolved, z, rods);
    resolve(&next, sim->y, resolved);
    const struct lane lane = bcd_lane(plan);
    contact_forces(&lane, z, resolved, 1 / (plan->mobility * plan->time_step), force);
}
