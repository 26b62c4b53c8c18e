/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * table - V(r) through given values at equal distances: a cubic spline, cut and shifted at the last
 * one.
 */
#include "central.h"
#include "kernels/simd.h"
#include "kernels/spline.h"

#include <math.h>

struct table_par {
    struct central central;
    double first, last;
    struct bcd_numbers values;
    struct spline spline; /* made by complete */
};

static const struct bcd_param table_params[] = {
    {.name = "first",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .doc = "distance of centres of the first value, at most the diameter",
     .offset = offsetof(struct table_par, first)},
    {.name = "last",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 1e-100,
     .max = 1e12,
     .doc = "distance of centres of the last value: V, shifted to V(last) = 0, and its force end",
     .offset = offsetof(struct table_par, last)},
    {.name = "values",
     .type = BCD_PARAM_NUMBERS,
     .required = true,
     .unit = "energy",
     .min = -1e6,
     .max = 1e6,
     .least = 4,
     .most = 100000,
     .doc = "V at equal distances from first to last",
     .offset = offsetof(struct table_par, values)},
    {0},
};

static double table_energy(const void *par, double r)
{
    return spline_at(&((const struct table_par *)par)->spline, r, 0);
}

/* F = -(c1 + t (2 c2 + 3 t c3)) / step on piece k at t. */
KERNEL_CLONES
static void table_force(const void *par, const double *r, int64_t count, double *force)
{
    const struct spline *spline = &((const struct table_par *)par)->spline;
    const double from = spline->from, unit = 1 / spline->step;
    const double last = (double)(spline->pieces - 1);
    const double *c = spline->c;
    for (int64_t i = 0; i < count; i++) {
        double place = (r[i] - from) * unit;
        double whole = floor(place);
        double piece = whole < 0 ? 0 : whole < last ? whole : last;
        double t = place - piece;
        const double *at = c + 4 * (int64_t)piece;
        force[i] = -unit * (at[1] + t * (2 * at[2] + 3 * t * at[3]));
    }
}

static const struct central_law table_law = {"last", "values", table_energy, table_force};

static void table_complete(struct bcd_group *group, const struct plan *plan,
                           struct bcd_errors *errors)
{
    struct table_par *p = group->values;
    double step = (p->last - p->first) / (double)(p->values.count - 1);
    /* Distances that positions of this length cannot tell apart are no table. */
    if (!(step > 1e-12 * p->last)) {
        group_fault(group, "last", errors, "must exceed first = %.12g, not %.12g", p->first,
                    p->last);
        return;
    }
    if (p->first > plan->diameter) {
        group_fault(group, "first", errors,
                    "must not exceed the diameter %.12g, for rods come that close; it is %.12g",
                    plan->diameter, p->first);
        return;
    }
    if (!spline_open(&p->spline, p->first, step, p->values.at, p->values.count)) {
        group_no_memory(group, "values", errors);
        return;
    }
    central_complete(group, &table_law, p->last, plan, errors);
}

static void table_release(void *par)
{
    spline_free(&((struct table_par *)par)->spline);
}

const struct pair_type pair_table = {
    .base = {.part = {.name = "table",
                      .doc = "V(r) from a table, cubic spline, shifted to 0 at its end",
                      .params = table_params},
             .par_size = sizeof(struct table_par),
             .complete = table_complete,
             .release = table_release},
    .athermal = true,
    .absent = central_absent,
    .range = central_range,
    .stiffness = central_stiffness,
    .theory = central_theory,
    .add_force = central_add_force,
    .energy = central_energy,
};
