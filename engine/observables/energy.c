/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * energy - mean external energy per particle, <U(x)>. Zero where there is no potential.
 */
#include "part.h"
#include "table.h"

#include <math.h>

struct energy_memory {
    int64_t samples;
    double sum; /* of the mean energy per rod */
};

static const struct bcd_param energy_params[] = {{0}};

static size_t energy_count(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return 1;
}

static size_t energy_memory(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return sizeof(struct energy_memory);
}

static double energy_sample_ns(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return 2.5;
}

static void energy_begin(struct observer *o, const struct sim *sim)
{
    (void)sim;
    *(struct energy_memory *)o->memory = (struct energy_memory){0, 0};
}

static void energy_sample(struct observer *o, const struct sim *sim)
{
    const struct plan *plan = o->plan;
    struct energy_memory *memory = o->memory;
    struct rods rods = {.y = sim->seen,
                        .count = plan->particles,
                        .diameter = plan->diameter,
                        .time = sim_time(sim)};
    if (plan->field)
        memory->sum +=
            plan->potential->energy_sum(plan->potential_par, &rods) / (double)plan->particles;
    memory->samples++;
}

static void energy_end_block(struct observer *o, const struct sim *sim, double *values)
{
    struct energy_memory *memory = o->memory;
    values[0] = memory->samples ? memory->sum / (double)memory->samples : NAN;
    energy_begin(o, sim);
}

static enum bcd_status energy_describe(const void *par, const struct plan *plan,
                                       const struct moments *moments, struct bcd_table *table)
{
    (void)par, (void)plan, (void)moments;
    table_describe(table, "energy", 1);
    table->scalar = true;
    table_axes(table, "", "external energy per particle");
    return BCD_OK;
}

/* The mean energy comes with every equilibrium. */
static void energy_want(const void *par, const struct plan *plan, struct theory_wanted *wanted)
{
    (void)par, (void)plan, (void)wanted;
}

static void energy_exact(const void *par, const struct plan *plan, struct exact *exact)
{
    (void)par, (void)plan;
    exact_from(exact, exact->equilibrium ? &exact->equilibrium->energy : NULL);
}

const struct observable_type observable_energy = {
    .base = {.part = {.name = "energy",
                      .doc = "mean external energy per particle",
                      .params = energy_params}},
    .sample_ns = energy_sample_ns,
    .value = "energy",
    .count = energy_count,
    .memory = energy_memory,
    .begin = energy_begin,
    .sample = energy_sample,
    .end_block = energy_end_block,
    .describe = energy_describe,
    .want = energy_want,
    .exact = energy_exact,
};
