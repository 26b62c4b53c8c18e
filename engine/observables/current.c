/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * current - particles per unit time through a point, J = rho <v>: the displacement of all rods over
 * the measured time, per length and time. Costs two sums a block, nothing per step.
 */
#include "part.h"
#include "table.h"
#include "kernels/sums.h"
#include "theory/closed_forms.h"

#include <math.h>

struct current_memory {
    int64_t tick; /* measured tick at which the block began */
    int64_t turns;
    double sum; /* of y */
};

static const struct bcd_param current_params[] = {{0}};

static size_t current_count(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return 1;
}

static size_t current_memory(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return sizeof(struct current_memory);
}

static void current_begin(struct observer *o, const struct sim *sim)
{
    *(struct current_memory *)o->memory = (struct current_memory){
        sim_measured(sim), sim->clock->turns, sum_plain(sim->y, o->plan->particles)};
}

static void current_end_block(struct observer *o, const struct sim *sim, double *values)
{
    const struct plan *plan = o->plan;
    const struct current_memory before = *(struct current_memory *)o->memory;
    current_begin(o, sim);
    const struct current_memory *now = o->memory;
    double time = (double)(now->tick - before.tick) * plan->time_step;
    double turned = (double)(now->turns - before.turns) * (double)plan->particles * plan->length;
    values[0] = time > 0 ? (now->sum - before.sum + turned) / (plan->length * time) : NAN;
}

static enum bcd_status current_describe(const void *par, const struct plan *plan,
                                        const struct moments *moments, struct bcd_table *table)
{
    (void)par, (void)plan, (void)moments;
    table_describe(table, "current", 1);
    table->scalar = true;
    table_axes(table, "", "current J = \xcf\x81\xe2\x9f\xa8v\xe2\x9f\xa9");
    return BCD_OK;
}

/* Without a potential every rod drifts at mu f; at rest in one, and between walls, there is no
 * current; one driven rod follows Stratonovich's formula. */
static void current_exact(const void *par, const struct plan *plan, struct exact *exact)
{
    (void)par;
    double velocity = plan->walls ? 0 : plan->mobility * plan->force;
    exact->reason = "driven rods in a potential: no closed form";
    bool still = plan->walls || plan->force == 0;
    if (plan->field && !(plan_field_steady(plan) && still)) {
        struct one_rod rod = {.energy = plan_energy,
                              .ctx = plan,
                              .period = plan->period,
                              .kT = plan->temperature,
                              .D = plan->diffusion,
                              .force = plan->force,
                              .energy_ns = plan_energy_ns(plan),
                              .watch = exact->watch};
        double diffusion;
        if (plan->particles > 1 || plan->walls || !plan_field_steady(plan) ||
            plan->temperature == 0 || tilted_drift(&velocity, &diffusion, &rod, NULL))
            return;
    }
    exact->values[0] = (double)plan->particles / plan->length * velocity;
    exact->reference = "canonical";
}

const struct observable_type observable_current = {
    .base = {.part = {.name = "current",
                      .doc = "particles per unit time through a point",
                      .params = current_params}},
    .value = "current",
    .dynamic = true,
    .count = current_count,
    .memory = current_memory,
    .begin = current_begin,
    .end_block = current_end_block,
    .describe = current_describe,
    .exact = current_exact,
};
