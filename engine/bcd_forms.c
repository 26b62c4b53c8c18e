/* SPDX-License-Identifier: GPL-3.0-or-later
 * bcd_forms.c - see bcd_forms.h. */
#include "bcd_forms.h"
#include "step_limit.h"
#include "kernels/contact_forces.h"

#include <math.h>

void bcd_step_layout(struct bcd_step *step, const struct sim *sim, bool start,
                     struct arena *scratch)
{
    const bool ahead = sim->plan->asks_contact_forces;
    proposal_layout(&step->proposal, sim, scratch);
    step->start = start ? sim_take_rods(sim, scratch) : NULL;
    step->ahead = ahead ? sim_take_rods(sim, scratch) : NULL;
    step->resolved = ahead ? sim_take_rods(sim, scratch) : NULL;
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
    for (int64_t t = 0; t < ticks; t++) {
        sim_copy_rods(sim, step->start, sim->y);
        proposal_euler(&step->proposal, sim);
        resolve(sim, step->start, sim->y);
        sim->clock->tick++;
    }
}

/* The next step on copies: its noise is a function of the tick, so that looking ahead leaves the
 * run as it is. */
void bcd_step_contact_forces(const struct sim *sim, struct bcd_step *step, bcd_resolver *resolve,
                             double *force)
{
    const struct plan *plan = sim->plan;
    struct sim next = *sim;
    next.y = step->ahead;
    sim_copy_rods(sim, next.y, sim->y);
    proposal_euler(&step->proposal, &next);
    sim_copy_rods(sim, step->resolved, next.y);
    resolve(&next, sim->y, step->resolved);
    const struct lane lane = bcd_lane(plan);
    contact_forces(&lane, next.y, step->resolved, 1 / (plan->mobility * plan->time_step), force);
}
