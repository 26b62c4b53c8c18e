/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * density - number of rod centres per unit length over one period of the potential (over [0, L]
 * without one and between walls), averaged over all periods and samples: doi
 * 10.1103/PhysRevE.106.054606, Eq. 25. Its mean over the period is N / L. Within half a diameter of
 * a wall there are no centres: bins there count that stretch like any other.
 */
#include "part.h"
#include "counts.h"
#include "table.h"
#include "kernels/histogram.h"

#include <math.h>

struct density_par {
    int64_t bins;
};

static const struct bcd_param density_params[] = {
    {.name = "bins",
     .type = BCD_PARAM_INTEGER,
     .min = 1,
     .max = 1000000,
     .fallback = 50,
     .doc = "bins over one period",
     .offset = offsetof(struct density_par, bins)},
    {0},
};

static size_t density_count(const void *par, const struct plan *plan)
{
    (void)plan;
    return (size_t)((const struct density_par *)par)->bins;
}

static size_t density_memory(const void *par, const struct plan *plan)
{
    return counts_memory(density_count(par, plan));
}

static double density_sample_ns(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return 2;
}

static void density_sample(struct observer *o, const struct sim *sim)
{
    const struct plan *plan = o->plan;
    struct counts *counts = o->memory;
    struct fold fold = {1 / plan->period, (int64_t)o->count, plan->walls};
    histogram_add(counts->bin, &fold, sim->seen, plan->particles, plan->diameter);
    counts->samples++;
}

static void density_end_block(struct observer *o, const struct sim *sim, double *values)
{
    (void)sim;
    const struct plan *plan = o->plan;
    double width = plan->period / (double)o->count;
    counts_end_block(o, 1 / (width * (double)plan->periods), values);
}

static enum bcd_status density_describe(const void *par, const struct plan *plan,
                                        const struct moments *moments, struct bcd_table *table)
{
    (void)moments;
    table_describe(table, "density", density_count(par, plan));
    table_axes(table, "x", "density \xcf\x81(x)");
    return table_add_centres(table, "x", plan->period);
}

static void density_want(const void *par, const struct plan *plan, struct theory_wanted *wanted)
{
    wanted->density_bins = density_count(par, plan);
}

static void density_exact(const void *par, const struct plan *plan, struct exact *exact)
{
    (void)par, (void)plan;
    exact_from(exact, exact->equilibrium ? exact->equilibrium->density : NULL);
}

const struct observable_type observable_density = {
    .base = {.part = {.name = "density",
                      .doc = "density profile over one period",
                      .params = density_params},
             .par_size = sizeof(struct density_par)},
    .sample_ns = density_sample_ns,
    .value = "density",
    .count = density_count,
    .memory = density_memory,
    .begin = counts_begin,
    .sample = density_sample,
    .end_block = density_end_block,
    .describe = density_describe,
    .want = density_want,
    .exact = density_exact,
};
