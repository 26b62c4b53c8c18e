/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * table - U(x) through given values at equal distances over one period, by a periodic cubic
 * spline: energy, force and the slope of the force are continuous.
 */
#include "part.h"
#include "kernels/spline.h"

enum { VALUES_MIN = 4, VALUES_MAX = 4096 };

struct table_par {
    double period;
    struct bcd_numbers values;
    struct spline spline; /* made by complete */
};

static const struct bcd_param table_params[] = {
    {.name = "period",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .above_min = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .doc = "p, period of the potential",
     .offset = offsetof(struct table_par, period)},
    {.name = "values",
     .type = BCD_PARAM_NUMBERS,
     .required = true,
     .unit = "energy",
     .min = -1e6,
     .max = 1e6,
     .least = VALUES_MIN,
     .most = VALUES_MAX,
     .doc = "U at 0, p/n, 2 p/n, .. (n values)",
     .offset = offsetof(struct table_par, values)},
    {0},
};

static void table_complete(struct bcd_group *group, const struct plan *plan,
                           struct bcd_errors *errors)
{
    (void)plan;
    struct table_par *p = group->values;
    size_t count = p->values.count;
    if (!spline_periodic(&p->spline, 0, p->period / (double)count, p->values.at, count))
        group_no_memory(group, "values", errors);
}

static void table_release(void *par)
{
    spline_free(&((struct table_par *)par)->spline);
}

static double table_period(const void *par)
{
    return ((const struct table_par *)par)->period;
}

static bool table_flat(const void *par)
{
    const struct bcd_numbers *values = &((const struct table_par *)par)->values;
    for (size_t i = 1; i < values->count; i++)
        if (values->at[i] != values->at[0])
            return false;
    return true;
}

static double table_curvature_max(const void *par)
{
    return spline_curvature_max(&((const struct table_par *)par)->spline);
}

static bool table_steady(const void *par)
{
    (void)par;
    return true;
}

static bool table_rough(const void *par)
{
    (void)par;
    return true;
}

static void table_add_force(const void *par, const struct rods *rods, double scale, double *out)
{
    const struct table_par *p = par;
    struct spline_points points = {rods->y, rods->count, rods->diameter, rods->offset,
                                   rods->first};
    spline_add_slope(&p->spline, &points, -scale, out);
}

static double table_energy_sum(const void *par, const struct rods *rods)
{
    const struct table_par *p = par;
    struct spline_points points = {.y = rods->y, .count = rods->count, .diameter = rods->diameter};
    return spline_sum(&p->spline, &points);
}

const struct potential_type potential_table = {
    .base = {.part = {.name = "table",
                      .doc = "U(x) through values over one period, by a cubic spline",
                      .params = table_params},
             .par_size = sizeof(struct table_par),
             .complete = table_complete,
             .release = table_release},
    .period = table_period,
    .flat = table_flat,
    .curvature_max = table_curvature_max,
    .add_force = table_add_force,
    .energy_sum = table_energy_sum,
    .steady = table_steady,
    .rough = table_rough,
};
