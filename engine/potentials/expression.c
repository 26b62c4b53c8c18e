/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * expression - U(x) as a formula. With a period p it is used on [0, p) and repeated; without one it
 * acts where it is, between walls. Energy and force must go on without jumps, across the seam at p
 * as well: a jump is a force without bounds, a kink a curvature without bounds, and no time step
 * resolves either.
 */
#include "part.h"
#include "kernels/formula.h"

#include <math.h>
#include <string.h>

enum { TILE = 64, LANES = 8 };

struct expression_par {
    char *energy;
    double period; /* 0 = none */
    /* made by complete: */
    struct formula *formula;
    double low, high; /* where x comes to: [0, p], or between the walls */
    double curvature_max;
    bool flat;
};

static const struct bcd_param expression_params[] = {
    {.name = "energy",
     .type = BCD_PARAM_TEXT,
     .required = true,
     .unit = "energy",
     .least = 1,
     .most = FORMULA_LENGTH_MAX,
     .doc = "U as a formula in x: + - * / ^ ( ) pi e sin cos tan asin acos atan sinh cosh tanh exp "
            "log sqrt abs min max",
     .offset = offsetof(struct expression_par, energy)},
    {.name = "period",
     .type = BCD_PARAM_NUMBER,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .doc = "p: the formula holds on [0, p) and is repeated; 0 = not periodic, needs walls",
     .offset = offsetof(struct expression_par, period)},
    {0},
};

/* ------------------------------------------------------------------- check */
/* The formula over its range at SCAN + 1 points. Features narrower than their distance that do not
 * show at them go unseen. */

enum { SCAN = 4096, ZOOM = 64 };
static const double jump_share = 1e-6; /* of max U - min U, of max |U'|: smaller ones pass */
static const double rounding = 1e-12;  /* of max |U| */
static const double narrowest = 1e-10; /* of the range: whatever changes within is a jump */

struct point {
    double x, u, slope, curvature;
};

struct scan {
    const struct formula *formula;
    double range;                   /* high - low */
    double steepest;                /* max |U'| */
    double energy_jump, slope_jump; /* what is no rounding any more */
    double curvature_max, sharpest; /* max |U''| and where */
};

static struct point look(struct scan *scan, double x)
{
    struct point at = {.x = x};
    formula_values(scan->formula, &x, 1, &at.u, &at.slope, &at.curvature);
    if (fabs(at.curvature) > scan->curvature_max) {
        scan->curvature_max = fabs(at.curvature);
        scan->sharpest = x;
    }
    return at;
}

static bool is_finite(const struct point *at)
{
    return isfinite(at->u) && isfinite(at->slope) && isfinite(at->curvature);
}

/* By how many jumps energy or slope change from a to b beyond what slope and curvature account
 * for. */
static double excess(const struct scan *scan, const struct point *a, const struct point *b)
{
    double half = (b->x - a->x) / 2;
    double energy = fabs((b->u - a->u) - half * (a->slope + b->slope));
    double slope = fabs((b->slope - a->slope) - half * (a->curvature + b->curvature));
    double energy_jumps = energy > 0 ? energy / scan->energy_jump : 0;
    double slope_jumps = slope > 0 ? slope / scan->slope_jump : 0;
    return isfinite(energy + slope) ? fmax(energy_jumps, slope_jumps) : INFINITY;
}

/* Follows the larger excess into ever smaller intervals. True: it stays, there is a jump at *x. */
static bool finds_jump(struct scan *scan, struct point a, struct point b, double *x)
{
    while (excess(scan, &a, &b) > 1) {
        *x = (a.x + b.x) / 2;
        if (b.x - a.x <= narrowest * scan->range || *x <= a.x || *x >= b.x)
            return true; /* doubles have an end too: nothing lies between neighbours */
        struct point middle = look(scan, *x);
        if (!is_finite(&middle))
            return true;
        if (excess(scan, &a, &middle) > excess(scan, &middle, &b))
            b = middle;
        else
            a = middle;
    }
    return false;
}

static double scan_place(const struct expression_par *p, int i)
{
    return p->low + (p->high - p->low) * ((double)i / SCAN);
}

/* First pass: is it finite, and what are its scales? */
static bool scan_scales(struct scan *scan, const struct expression_par *p,
                        const struct bcd_group *group, struct bcd_errors *errors)
{
    double least = INFINITY, most = -INFINITY, largest = 0;
    for (int i = 0; i <= SCAN; i++) {
        struct point at = look(scan, scan_place(p, i));
        if (!is_finite(&at)) {
            group_fault(group, "energy", errors,
                        "must be finite with its first two derivatives from x = %.6g to %.6g: at "
                        "x = %.6g energy, slope and curvature are %g, %g, %g",
                        p->low, p->high, at.x, at.u, at.slope, at.curvature);
            return false;
        }
        least = fmin(least, at.u);
        most = fmax(most, at.u);
        largest = fmax(largest, fabs(at.u));
        scan->steepest = fmax(scan->steepest, fabs(at.slope));
    }
    double span = most - least, mean_slope = scan->range > 0 ? span / scan->range : 0;
    double unit_slope = scan->range > 0 ? largest / scan->range : 0;
    scan->energy_jump = fmax(jump_share * span, rounding * largest);
    scan->slope_jump = fmax(jump_share * fmax(scan->steepest, mean_slope), rounding * unit_slope);
    return true;
}

/* Second pass: jumps within, and at the seam. */
static void scan_jumps(struct scan *scan, const struct expression_par *p,
                       const struct bcd_group *group, struct bcd_errors *errors)
{
    const struct point first = look(scan, p->low);
    struct point before = first;
    double x;
    for (int i = 1; i <= SCAN; i++) {
        struct point at = look(scan, scan_place(p, i));
        if (finds_jump(scan, before, at, &x)) {
            group_fault(
                group, "energy", errors,
                "energy and force must be continuous, but jump at x = %.9g, within %.3g: no "
                "time step resolves that; round it off over a finite length",
                x, narrowest * scan->range);
            return;
        }
        before = at;
    }
    bool energy_jumps = fabs(before.u - first.u) > scan->energy_jump;
    bool slope_jumps = fabs(before.slope - first.slope) > scan->slope_jump;
    if (p->period > 0 && (energy_jumps || slope_jumps))
        group_fault(group, "period", errors,
                    "energy and force must go on at the seam: U(0) = %.9g, U(%.9g) = %.9g; "
                    "U'(0) = %.9g, U'(%.9g) = %.9g",
                    first.u, p->period, before.u, first.slope, p->period, before.slope);
}

/* Third pass: ever closer round the sharpest place. */
static void scan_sharpest(struct scan *scan, const struct expression_par *p)
{
    double reach = scan->range / SCAN;
    for (int pass = 0; pass < 3; pass++) {
        double middle = scan->sharpest;
        for (int i = -ZOOM; i <= ZOOM; i++)
            look(scan, fmin(fmax(middle + reach * i / ZOOM, p->low), p->high));
        reach /= ZOOM;
    }
}

static void expression_complete(struct bcd_group *group, const struct plan *plan,
                                struct bcd_errors *errors)
{
    struct expression_par *p = group->values;
    char complaint[160];
    p->formula = formula_create(p->energy, "x", complaint);
    if (!p->formula) {
        if (complaint[0])
            group_fault(group, "energy", errors, "%s", complaint);
        else
            group_no_memory(group, "energy", errors);
        return;
    }
    p->low = p->period > 0 ? 0 : plan->low;
    p->high = p->period > 0 ? p->period : fmax(plan->length - plan->low, plan->low);
    struct scan scan = {.formula = p->formula, .range = p->high - p->low};
    size_t before = errors->count;
    if (!scan_scales(&scan, p, group, errors))
        return;
    scan_jumps(&scan, p, group, errors);
    if (errors->count > before)
        return;
    scan_sharpest(&scan, p);
    p->curvature_max = scan.curvature_max;
    p->flat = scan.steepest == 0;
}

static void expression_release(void *par)
{
    formula_free(((struct expression_par *)par)->formula);
}

/* ---------------------------------------------------------------- the table */

static double expression_period(const void *par)
{
    const struct expression_par *p = par;
    return p->period > 0 ? p->period : INFINITY;
}

static bool expression_flat(const void *par)
{
    return ((const struct expression_par *)par)->flat;
}

static double expression_curvature_max(const void *par)
{
    return ((const struct expression_par *)par)->curvature_max;
}

static bool expression_steady(const void *par)
{
    (void)par;
    return true;
}

/* Kinks of the force come from these; the names may stand in others, which does no harm. */
static bool expression_rough(const void *par)
{
    const char *text = ((const struct expression_par *)par)->energy;
    return strstr(text, "abs") || strstr(text, "min") || strstr(text, "max");
}

/* Places of rods start .. start + n - 1: folded into the period, or, against rounding, held between
 * the walls. */
static void places_of(const struct expression_par *p, const struct rods *rods, int64_t start, int n,
                      double *x)
{
    const double inverse = 1 / p->period;
    rods_places(rods, start, n, x);
    if (p->period > 0)
        for (int j = 0; j < n; j++)
            x[j] = (x[j] * inverse - floor(x[j] * inverse)) * p->period;
    else
        for (int j = 0; j < n; j++)
            x[j] = x[j] < p->low ? p->low : x[j] > p->high ? p->high : x[j];
}

static void expression_add_force(const void *par, const struct rods *rods, double scale,
                                 double *out)
{
    const struct expression_par *p = par;
    double x[TILE], energy[TILE], slope[TILE];
    for (int64_t start = 0; start < rods->count; start += TILE) {
        int n = rods->count - start < TILE ? (int)(rods->count - start) : TILE;
        places_of(p, rods, start, n, x);
        formula_values(p->formula, x, (size_t)n, energy, slope, NULL);
        for (int j = 0; j < n; j++)
            out[start + j] -= scale * slope[j];
    }
}

static double expression_energy_sum(const void *par, const struct rods *rods)
{
    const struct expression_par *p = par;
    double x[TILE], energy[TILE], sum[LANES] = {0};
    for (int64_t start = 0; start < rods->count; start += TILE) {
        int n = rods->count - start < TILE ? (int)(rods->count - start) : TILE;
        places_of(p, rods, start, n, x);
        formula_values(p->formula, x, (size_t)n, energy, NULL, NULL);
        for (int j = 0; j < n; j++)
            sum[j % LANES] += energy[j];
    }
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

static double expression_force_ns(const void *par, const struct plan *plan)
{
    return formula_ns(((const struct expression_par *)par)->formula, (double)plan->particles);
}

static double expression_energy_ns(const void *par)
{
    return formula_ns(((const struct expression_par *)par)->formula, 1);
}

const struct potential_type potential_expression = {
    .base = {.part = {.name = "expression",
                      .doc = "U(x) as a formula, \"3*cos(2*pi*x)+0.1*cos(4*pi*x)\"",
                      .params = expression_params},
             .par_size = sizeof(struct expression_par),
             .complete = expression_complete,
             .release = expression_release},
    .period = expression_period,
    .flat = expression_flat,
    .curvature_max = expression_curvature_max,
    .add_force = expression_add_force,
    .energy_sum = expression_energy_sum,
    .steady = expression_steady,
    .rough = expression_rough,
    .force_ns = expression_force_ns,
    .energy_ns = expression_energy_ns,
};
