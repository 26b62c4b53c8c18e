/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * pair_distribution - g(r): density of pairs of rods at distance r between centres, r counted in
 * one direction round the ring, over the square of the mean density; both rods anywhere. All pairs
 * count, not only neighbours: g tends to 1 - 1/N.
 *
 * Between walls long distances have less room: g is the number of pairs per dr over N^2 (A - r) /
 * A^2, A = L - sigma the stretch open to centres. N independent points there have 1 - 1/N at all r.
 */
#include "part.h"
#include "counts.h"
#include "table.h"

#include <math.h>

struct pair_par {
    int64_t bins;
    double last;
};

static const struct bcd_param pair_params[] = {
    {.name = "bins",
     .type = BCD_PARAM_INTEGER,
     .min = 1,
     .max = 100000,
     .fallback = 100,
     .doc = "bins over [0, last]",
     .offset = offsetof(struct pair_par, bins)},
    {.name = "last",
     .type = BCD_PARAM_AUTO,
     .above_min = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .fallback = NAN,
     .doc = "largest distance; auto = five mean distances, at most half of the ring",
     .offset = offsetof(struct pair_par, last)},
    {0},
};

static double pair_last(const void *par, const struct plan *plan)
{
    double last = ((const struct pair_par *)par)->last;
    double usual = fmin(5 * plan->length / (double)plan->particles, plan->length / 2);
    return isnan(last) ? usual : last;
}

static size_t pair_count(const void *par, const struct plan *plan)
{
    (void)plan;
    return (size_t)((const struct pair_par *)par)->bins;
}

static size_t pair_memory(const void *par, const struct plan *plan)
{
    return counts_memory(pair_count(par, plan));
}

static void pair_check(const struct bcd_group *group, const struct plan *plan,
                       struct bcd_errors *errors)
{
    const double last = ((const struct pair_par *)group->values)->last;
    double most = plan->length - plan->diameter;
    if (last > most) /* auto never is, but for a single rod, which has no pairs */
        group_fault(group, "last", errors, "must not exceed length - diameter = %.12g", most);
}

/* Next to contact, what noise crosses in a step must be small against a bin, or against the mean
 * gap where bins are finer still: half of it (1 % off then; 5 % where all of it is crossed). */
static double pair_time_step_max(const void *par, const struct plan *plan)
{
    double bin = pair_last(par, plan) / (double)pair_count(par, plan);
    double reach = fmax(bin, 0.1 * plan->free_length / (double)plan->particles) / 2;
    bool limited = plan->particles > 1 && plan->diffusion > 0 && reach > 0;
    return limited ? reach * reach / (4 * plan->diffusion) : INFINITY;
}

/* Looking at a rod is looking at all rods within reach. */
static double pair_sample_ns(const void *par, const struct plan *plan)
{
    return 2.5 + 7 * pair_last(par, plan) * (double)plan->particles / plan->length;
}

static void pair_sample(struct observer *o, const struct sim *sim)
{
    const struct plan *plan = o->plan;
    struct counts *counts = o->memory;
    const double last = pair_last(o->par, plan), unit = (double)o->count / last;
    const double *y = sim->seen;
    int64_t n = plan->particles;
    for (int64_t i = 0; i < n; i++) {
        for (int64_t d = 1; d < (plan->walls ? n - i : n); d++) {
            int64_t j = i + d < n ? i + d : i + d - n;
            double turned = i + d < n ? 0 : plan->free_length;
            double r = (y[j] - y[i]) + turned + (double)d * plan->diameter;
            if (r >= last)
                break;
            size_t bin = (size_t)(r * unit);
            counts->bin[bin < o->count ? bin : o->count - 1]++;
        }
    }
    counts->samples++;
}

static void pair_end_block(struct observer *o, const struct sim *sim, double *values)
{
    (void)sim;
    const struct plan *plan = o->plan;
    double n = (double)plan->particles, width = pair_last(o->par, plan) / (double)o->count;
    if (!plan->walls) {
        counts_end_block(o, plan->length / (n * n * width), values);
        return;
    }
    double room = plan->length - plan->diameter;
    counts_end_block(o, room / (n * n * width), values);
    for (size_t i = 0; i < o->count && n > 1; i++) /* A - r is linear: its mean is in the middle */
        values[i] *= room / (room - ((double)i + 0.5) * width);
}

static enum bcd_status pair_describe(const void *par, const struct plan *plan,
                                     const struct moments *moments, struct bcd_table *table)
{
    (void)moments;
    table_describe(table, "pair_distribution", pair_count(par, plan));
    table_axes(table, "distance r", "pair distribution g(r)");
    return table_add_centres(table, "r", pair_last(par, plan));
}

static void pair_want(const void *par, const struct plan *plan, struct theory_wanted *wanted)
{
    wanted->pair_bins = pair_count(par, plan);
    wanted->pair_last = pair_last(par, plan);
}

static void pair_exact(const void *par, const struct plan *plan, struct exact *exact)
{
    (void)par, (void)plan;
    /* A theory without pairs: they were refused, the rest was not (reference.c). */
    bool given = exact->equilibrium && exact->equilibrium->wanted.pair_bins == exact->rows;
    exact_from(exact, given ? exact->equilibrium->pair : NULL);
}

const struct observable_type observable_pair_distribution = {
    .base = {.part = {.name = "pair_distribution",
                      .doc = "density of pairs at a distance, g(r)",
                      .params = pair_params},
             .par_size = sizeof(struct pair_par)},
    .check = pair_check,
    .time_step_max = pair_time_step_max,
    .value = "pair_distribution",
    .at_contact = true,
    .sample_ns = pair_sample_ns,
    .count = pair_count,
    .memory = pair_memory,
    .begin = counts_begin,
    .sample = pair_sample,
    .end_block = pair_end_block,
    .describe = pair_describe,
    .want = pair_want,
    .exact = pair_exact,
};
