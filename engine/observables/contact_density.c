/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * contact_density - density of pairs of neighbours in contact, rho2(x, x + sigma), x the centre of
 * the left rod: doi 10.1103/PhysRevE.106.054606, Eq. 26. Pairs whose gap is at most `gap` are
 * counted and divided by it, so the number is the mean of rho2(x, x + sigma + g) over 0 <= g <=
 * gap. Between walls the last rod has no right neighbour; a rod that touches a wall is no pair.
 *
 * A projected Euler step keeps rods in exact contact too often: as if they were shorter by
 * 1.165 sqrt(D h), which adds the share 1.165 sqrt(D h) / gap to what is counted: 29 % at the
 * longest step that the rule below allows.
 */
#include "part.h"
#include "step_limit.h"
#include "counts.h"
#include "table.h"
#include "kernels/histogram.h"

#include <math.h>

struct contact_par {
    int64_t bins;
    double gap;
};

static const struct bcd_param contact_params[] = {
    {.name = "bins",
     .type = BCD_PARAM_INTEGER,
     .min = 1,
     .max = 1000000,
     .fallback = 50,
     .doc = "bins over one period",
     .offset = offsetof(struct contact_par, bins)},
    {.name = "gap",
     .type = BCD_PARAM_NUMBER,
     .above_min = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .fallback = 1e-3,
     .doc = "rods closer than this count as in contact",
     .offset = offsetof(struct contact_par, gap)},
    {0},
};

static size_t contact_count(const void *par, const struct plan *plan)
{
    (void)plan;
    return (size_t)((const struct contact_par *)par)->bins;
}

static size_t contact_memory(const void *par, const struct plan *plan)
{
    return counts_memory(contact_count(par, plan));
}

static void contact_check(const struct bcd_group *group, const struct plan *plan,
                          struct bcd_errors *errors)
{
    const struct contact_par *par = group->values;
    if (plan->free_length > 0 && par->gap > plan->free_length)
        group_fault(group, "gap", errors, "must not exceed the free length L - N sigma = %.12g",
                    plan->free_length);
}

/* What noise crosses in a step must be small against the window: half of it where noise ends in
 * exact contacts; all of it where only the drift does (measured: 1 % off then); no limit without a
 * drift. Windows may be as fine as one likes: the density at contact itself is off by about .3
 * sqrt(h mu max|U''|) (measured), and steps need not be finer than for six
 * times the tolerance. */
static double contact_time_step_max(const void *par, const struct plan *plan)
{
    double gap = ((const struct contact_par *)par)->gap;
    bool keeps = plan->method->keeps_contacts, limited = keeps || plan->field || plan->pair;
    if (plan->particles < 2 || !limited || plan->diffusion == 0)
        return INFINITY;
    double reach = keeps ? gap / 2 : gap, window = reach * reach / (4 * plan->diffusion);
    double rate = curvature_rate(plan) + stiffness_rate(plan), share = 6 * plan->tolerance / 0.3;
    return keeps || rate == 0 ? window : fmax(window, share * share / rate);
}

static double contact_sample_ns(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return 1.5;
}

static void contact_sample(struct observer *o, const struct sim *sim)
{
    const struct plan *plan = o->plan;
    struct counts *counts = o->memory;
    const double gap = ((const struct contact_par *)o->par)->gap;
    const struct fold fold = {1 / plan->period, (int64_t)o->count, plan->walls};
    const double *y = sim->seen;
    int64_t n = plan->particles, pairs = n > 1 ? n : 0; /* one rod is no neighbour of itself */
    pairs = plan->walls ? n - 1 : pairs;
    for (int64_t i = 0; i < pairs; i++) {
        double next = i + 1 < n ? y[i + 1] : y[0] + plan->free_length;
        if (next - y[i] <= gap)
            counts->bin[fold_bin(&fold, y[i] + (double)i * plan->diameter)]++;
    }
    counts->samples++;
}

static void contact_end_block(struct observer *o, const struct sim *sim, double *values)
{
    (void)sim;
    const struct plan *plan = o->plan;
    const struct contact_par *par = o->par;
    double width = plan->period / (double)o->count;
    counts_end_block(o, 1 / (width * (double)plan->periods * par->gap), values);
}

static enum bcd_status contact_describe(const void *par, const struct plan *plan,
                                        const struct moments *moments, struct bcd_table *table)
{
    (void)moments;
    table_describe(table, "contact_density", contact_count(par, plan));
    table_axes(table, "x", "contact density \xcf\x81\xe2\x82\x82(x, x+\xcf\x83)");
    return table_add_centres(table, "x", plan->period);
}

static enum bcd_status contact_extend(const void *par, const struct plan *plan,
                                      struct bcd_table *table)
{
    (void)plan;
    table_note_number(table, "gap", ((const struct contact_par *)par)->gap);
    return BCD_OK;
}

static void contact_want(const void *par, const struct plan *plan, struct theory_wanted *wanted)
{
    wanted->contact_bins = contact_count(par, plan);
    wanted->contact_gap = ((const struct contact_par *)par)->gap;
}

/* The window is part of what is measured: compared with the window's exact mean. */
static void contact_exact(const void *par, const struct plan *plan, struct exact *exact)
{
    (void)par, (void)plan;
    exact_from(exact, exact->equilibrium ? exact->equilibrium->contact_window : NULL);
}

const struct observable_type observable_contact_density = {
    .base = {.part = {.name = "contact_density",
                      .doc = "density of neighbours in contact over one period",
                      .params = contact_params},
             .par_size = sizeof(struct contact_par)},
    .check = contact_check,
    .time_step_max = contact_time_step_max,
    .sample_ns = contact_sample_ns,
    .value = "contact_density",
    .at_contact = true,
    .one_view = true, /* a drift ends in exact contacts: the other view says nothing */
    .count = contact_count,
    .memory = contact_memory,
    .begin = counts_begin,
    .sample = contact_sample,
    .end_block = contact_end_block,
    .describe = contact_describe,
    .extend = contact_extend,
    .want = contact_want,
    .exact = contact_exact,
};
