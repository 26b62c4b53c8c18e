/* SPDX-License-Identifier: GPL-3.0-or-later
 * walls_draw.c - see walls_draw.h. */
#include <math.h>
#include <string.h>

#include "walls_draw.h"

enum { KEPT_MAX = 16000000, TURNS_MAX = 10000000 };

/* --------------------------------------------------------------------- setup */

/* Panels on which the theory itself is exact to its tolerance. */
static enum bcd_status find_width(double *width, const struct model *model,
                                  struct bcd_error *error)
{
    const struct theory_wanted wanted = {.density_bins = 16};
    struct theory_result *result = NULL;
    enum bcd_status status = theory_walls(&result, &model->system, &wanted, error);
    if (status) {
        return status;
    }
    double panels = (double)result->points / LINE_RULE;
    theory_result_free(result);
    *width = model->free_length / panels * (1 + 1e-9);
    double kept = line_panels(model, *width) * LINE_RULE * (double)model->system.particles;
    if (kept > KEPT_MAX) {
        return theory_fail(error, BCD_INVALID,
                           "equilibrium draw: too many rods between walls for so strong a "
                           "potential or so short a range");
    }
    return BCD_OK;
}

/* Bound of f = 1 + bump of a pair energy. */
static double largest_factor(const struct model *model)
{
    enum { SCAN = 4096 };
    double most = 1;
    for (int i = 0; i < SCAN; i++) {
        most = fmax(most, 1 + model_bump(model, model->reach * i / SCAN));
    }
    return most * 1.001; /* between the points */
}

static enum bcd_status fill(struct walls_draw *draw)
{
    const struct line_tables *tables = &draw->tables;
    size_t rods = (size_t)draw->model->system.particles, nodes = tables->nodes;
    struct line line;
    draw->weight = scratch_doubles(&draw->scratch, rods * nodes);
    draw->sum = scratch_doubles(&draw->scratch, rods * (tables->panels + 1));
    if (line_init(&line, tables, false, &draw->scratch)) {
        return BCD_NO_MEMORY;
    }
    for (size_t i = 0; i < rods && !watch_ended(draw->model->system.watch); i++) {
        double *sum = draw->sum + i * (tables->panels + 1);
        if (i > 0) {
            line_step(&line);
        }
        line_multiply(&line);
        memcpy(draw->weight + i * nodes, line.product, nodes * sizeof(double));
        for (size_t panel = 0; panel < tables->panels; panel++) {
            double half = (line_edge(tables, panel + 1) - line_edge(tables, panel)) / 2, add = 0;
            for (size_t nu = 0; nu < LINE_RULE; nu++) {
                add += half * tables->weight[nu] * line.product[panel * LINE_RULE + nu];
            }
            sum[panel + 1] = sum[panel] + add;
        }
    }
    return BCD_OK;
}

enum bcd_status walls_draw_init(struct walls_draw *draw, const struct model *model,
                                struct bcd_error *error)
{
    *draw = (struct walls_draw){.model = model, .scratch = {.watch = model->system.watch}};
    double width;
    enum bcd_status status = find_width(&width, model, error);
    if (status) {
        return status;
    }
    draw->most = model->system.pair.kind == THEORY_ENERGY ? largest_factor(model) : 1;
    if (line_tables_init(&draw->tables, model, width, &draw->scratch) || fill(draw)) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    draw->scratch.watch = NULL; /* borrowed until here */
    return watch_ended(model->system.watch) ? watch_stopped(model->system.watch, error) : status;
}

void walls_draw_fini(struct walls_draw *draw)
{
    scratch_free(&draw->scratch);
}

/* ---------------------------------------------------------------------- draw */

struct walk {
    const struct walls_draw *draw;
    const struct theory_uniforms *uniforms;
    const double *weight, *sum; /* of the rod to be placed */
    struct measure bump;
};

static double uniform(const struct walk *walk)
{
    return walk->uniforms->next(walk->uniforms->ctx);
}

/* The integral over a panel up to u is (u + 1) times a polynomial: its values at the nodes. */
static void panel_means(const struct walk *walk, size_t panel, double mean[LINE_RULE])
{
    const struct line_tables *tables = &walk->draw->tables;
    double half = (line_edge(tables, panel + 1) - line_edge(tables, panel)) / 2;
    for (size_t tau = 0; tau < LINE_RULE; tau++) {
        double sum = 0;
        for (size_t nu = 0; nu < LINE_RULE; nu++) {
            sum += tables->below[tau][nu] * walk->weight[panel * LINE_RULE + nu];
        }
        mean[tau] = half * sum / (tables->node[tau] + 1);
    }
}

static double panel_integral(const struct walk *walk, const double mean[LINE_RULE], double u)
{
    double share[LINE_RULE], sum = 0;
    line_cardinal(&walk->draw->tables, u, share);
    for (size_t nu = 0; nu < LINE_RULE; nu++) {
        sum += share[nu] * mean[nu];
    }
    return sum * (u + 1);
}

/* u of a place within its panel. */
static double within_panel(const struct line_tables *tables, size_t panel, double y)
{
    double from = line_edge(tables, panel), to = line_edge(tables, panel + 1);
    return 2 * (y - from) / (to - from) - 1;
}

static double integral_to(const struct walk *walk, double end)
{
    const struct line_tables *tables = &walk->draw->tables;
    size_t panel = line_panel(tables, end);
    double mean[LINE_RULE];
    panel_means(walk, panel, mean);
    return walk->sum[panel] + panel_integral(walk, mean, within_panel(tables, panel, end));
}

/* y with int_0^y weight = target, at most `end`: bisection over panels, then within. */
static double invert_integral(const struct walk *walk, double target, double end)
{
    const struct line_tables *tables = &walk->draw->tables;
    size_t low = 0, high = line_panel(tables, end) + 1;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (walk->sum[middle] <= target) {
            low = middle;
        } else {
            high = middle;
        }
    }
    double mean[LINE_RULE], rest = target - walk->sum[low];
    double a = -1, b = 1, fa = -rest, fb = walk->sum[low + 1] - walk->sum[low] - rest;
    panel_means(walk, low, mean);
    for (int turn = 0; turn < 60 && b - a > 1e-11; turn++) {
        double u = turn % 3 == 2 || !(fb > fa) ? (a + b) / 2 : a - fa * (b - a) / (fb - fa);
        double here = panel_integral(walk, mean, u) - rest;
        if (here < 0) {
            a = u;
            fa = here;
        } else {
            b = u;
            fb = here;
        }
    }
    double from = line_edge(tables, low), to = line_edge(tables, low + 1);
    return fmin(from + (a + 1) / 2 * (to - from), end);
}

/* int of bump(u) weight(end - u) over u >= 0, panel by panel. */
static double bump_integral(struct walk *walk, double end)
{
    const struct line_tables *tables = &walk->draw->tables;
    const struct model *model = walk->draw->model;
    double most = fmin(end, model->reach), from = 0, sum = 0;
    for (size_t panel = line_panel(tables, end) + 1; panel-- > 0 && from < most;) {
        const double gaps[2] = {from, fmin(end - line_edge(tables, panel), most)};
        walk->bump.count = 0;
        measure_add_bump(&walk->bump, model, gaps, 0);
        for (size_t i = 0; i < walk->bump.count; i++) {
            sum += walk->bump.weight[i] *
                   line_at(tables, walk->weight, end - walk->bump.gap[i]);
        }
        from = fmax(from, gaps[1]);
    }
    return fmax(sum, 0);
}

/* A gap u from bump(u) weight(end - u), u <= end; negative when none is found. */
static double bump_gap(const struct walk *walk, double end)
{
    const struct line_tables *tables = &walk->draw->tables;
    const struct theory_pair *pair = &walk->draw->model->system.pair;
    size_t from = line_panel(tables, fmax(end - pair->range, 0)), to = line_panel(tables, end);
    double most = 0;
    for (size_t node = from * LINE_RULE; node < (to + 1) * LINE_RULE; node++) {
        most = fmax(most, walk->weight[node]);
    }
    most *= 1.1; /* between the nodes */
    for (int turn = 0; turn < TURNS_MAX; turn++) {
        double gap = pair->range * (1 - pow(uniform(walk), 1 / (pair->exponent + 1)));
        if (gap <= end && uniform(walk) * most < line_at(tables, walk->weight, end - gap)) {
            return gap;
        }
    }
    return -1;
}

/* Place of a rod whose right neighbour is at `end`; negative when none is found. */
static double step_back(struct walk *walk, double end)
{
    const struct walls_draw *draw = walk->draw;
    const struct model *model = draw->model;
    double open = integral_to(walk, end), bond = 0;
    if (model->system.pair.kind == THEORY_ENERGY) {
        for (int turn = 0; turn < TURNS_MAX; turn++) {
            double y = invert_integral(walk, uniform(walk) * open, end);
            if (uniform(walk) * draw->most < 1 + model_bump(model, end - y)) {
                return y;
            }
        }
        return -1;
    }
    if (model->bond > 0) {
        bond = model->bond * fmax(line_at(&draw->tables, walk->weight, end), 0);
    } else if (model->reach > 0) {
        bond = bump_integral(walk, end);
    }
    double pick = uniform(walk) * (open + bond);
    if (pick >= bond) {
        return invert_integral(walk, pick - bond, end);
    }
    if (model->bond > 0) {
        return end;
    }
    double gap = bump_gap(walk, end);
    return gap < 0 ? -1 : end - gap;
}

enum bcd_status walls_draw(const struct walls_draw *draw, double *y,
                           const struct theory_uniforms *uniforms, struct bcd_error *error)
{
    const struct model *model = draw->model;
    size_t rods = (size_t)model->system.particles, panels = draw->tables.panels;
    struct scratch scratch = {0};
    struct walk walk = {.draw = draw, .uniforms = uniforms};
    const double everything[2] = {0, model->reach};
    walk.bump.capacity = 4 * measure_capacity(model, everything, 0);
    walk.bump.gap = scratch_doubles(&scratch, walk.bump.capacity);
    walk.bump.weight = scratch_doubles(&scratch, walk.bump.capacity);
    enum bcd_status status =
        scratch.failed ? theory_fail(error, BCD_NO_MEMORY, "out of memory") : BCD_OK;
    double end = model->free_length;
    for (size_t i = rods; !status && i-- > 0;) {
        walk.weight = draw->weight + i * draw->tables.nodes;
        walk.sum = draw->sum + i * (panels + 1);
        end = i + 1 == rods ? invert_integral(&walk, uniform(&walk) * walk.sum[panels], end)
                            : step_back(&walk, end);
        y[i] = end;
        if (!(end >= 0)) {
            status = theory_fail(error, BCD_INVALID,
                                 "equilibrium draw: no place for a rod within %d trials",
                                 TURNS_MAX);
        }
    }
    scratch_free(&scratch);
    return status;
}
