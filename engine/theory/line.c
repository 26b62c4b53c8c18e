/* SPDX-License-Identifier: GPL-3.0-or-later
 * line.c - see line.h. */
#include <math.h>
#include <string.h>

#include "line.h"

/* ------------------------------------------------------------------ panels */

static double panel_width(const struct model *model, double wanted)
{
    double ell = model->free_length;
    double whole = model->reach > 0 && model->reach < ell ? model->reach : ell;
    return whole / fmax(ceil(whole / wanted), 1);
}

double line_panels(const struct model *model, double width)
{
    return fmax(ceil(model->free_length / panel_width(model, width) - 1e-9), 1);
}

double line_cost(const struct model *model, double width)
{
    double sources = model->reach > 0 ? 2 + model->reach / panel_width(model, width) : 1;
    return line_panels(model, width) * LINE_RULE * (2 * LINE_RULE * sources + 60);
}

double line_edge(const struct line_tables *tables, size_t panel)
{
    return panel < tables->panels ? (double)panel * tables->width : tables->model->free_length;
}

size_t line_panel(const struct line_tables *tables, double t)
{
    double panel = t / tables->width;
    size_t last = tables->panels - 1;
    return panel >= (double)last ? last : panel > 0 ? (size_t)panel : 0;
}

static double panel_half(const struct line_tables *tables, size_t panel)
{
    return (line_edge(tables, panel + 1) - line_edge(tables, panel)) / 2;
}

void line_cardinal(const struct line_tables *tables, double u, double share[LINE_RULE])
{
    double sum = 0;
    for (size_t nu = 0; nu < LINE_RULE; nu++) {
        double distance = u - tables->node[nu];
        if (distance == 0) {
            memset(share, 0, LINE_RULE * sizeof *share);
            share[nu] = 1;
            return;
        }
        share[nu] = tables->barycentric[nu] / distance;
        sum += share[nu];
    }
    for (size_t nu = 0; nu < LINE_RULE; nu++) {
        share[nu] /= sum;
    }
}

double line_at(const struct line_tables *tables, const double *values, double t)
{
    size_t panel = line_panel(tables, t);
    const double *at = values + panel * LINE_RULE;
    double u = (t - line_edge(tables, panel)) / panel_half(tables, panel) - 1;
    double above = 0, below = 0;
    for (size_t nu = 0; nu < LINE_RULE; nu++) {
        double distance = u - tables->node[nu];
        if (distance == 0) {
            return at[nu];
        }
        double share = tables->barycentric[nu] / distance;
        above += share * at[nu];
        below += share;
    }
    return above / below;
}

/* ------------------------------------------------------------------ tables */

static void init_rule(struct line_tables *tables)
{
    gauss_legendre(LINE_RULE, tables->node, tables->weight);
    for (size_t nu = 0; nu < LINE_RULE; nu++) {
        double x = tables->node[nu], size = sqrt((1 - x * x) * tables->weight[nu]);
        tables->barycentric[nu] = nu % 2 ? -size : size;
    }
    for (size_t tau = 0; tau < LINE_RULE; tau++) {
        double half = (tables->node[tau] + 1) / 2, share[LINE_RULE];
        for (size_t i = 0; i < LINE_RULE; i++) {
            line_cardinal(tables, -1 + half * (tables->node[i] + 1), share);
            for (size_t nu = 0; nu < LINE_RULE; nu++) {
                tables->below[tau][nu] += half * tables->weight[i] * share[nu];
            }
        }
    }
}

/* table[d][tau][nu]: what node nu of the d-th panel before gives to node tau of a panel of this
 * width, through the bump. */
static void fill_bump(const struct line_tables *tables, double width, struct measure *points,
                      double *table)
{
    for (size_t d = 0; d <= tables->reach_panels; d++) {
        double from = -(double)d * tables->width, size = d ? tables->width : width;
        for (size_t tau = 0; tau < LINE_RULE; tau++) {
            double target = (tables->node[tau] + 1) / 2 * width, share[LINE_RULE];
            if (!model_spend(tables->model, 60 * (double)points->capacity)) {
                return;
            }
            const double gaps[2] = {target - (from + size), target - from};
            double *row = table + (d * LINE_RULE + tau) * LINE_RULE;
            points->count = 0;
            measure_add_bump(points, tables->model, gaps, 0);
            for (size_t i = 0; i < points->count; i++) {
                line_cardinal(tables, 2 * (target - points->gap[i] - from) / size - 1, share);
                for (size_t nu = 0; nu < LINE_RULE; nu++) {
                    row[nu] += points->weight[i] * share[nu];
                }
            }
        }
    }
}

static enum bcd_status init_bump(struct line_tables *tables, struct scratch *scratch)
{
    const struct model *model = tables->model;
    const double everything[2] = {0, model->reach};
    struct measure points = {.capacity = 4 * measure_capacity(model, everything, 0)};
    tables->reach_panels = (size_t)fmin(ceil(model->reach / tables->width - 1e-9),
                                        (double)tables->panels);
    size_t count = (tables->reach_panels + 1) * LINE_RULE * LINE_RULE;
    points.gap = scratch_doubles(scratch, points.capacity);
    points.weight = scratch_doubles(scratch, points.capacity);
    tables->bump = scratch_doubles(scratch, count);
    tables->bump_end = scratch_doubles(scratch, count);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    fill_bump(tables, tables->width, &points, tables->bump);
    fill_bump(tables, 2 * panel_half(tables, tables->panels - 1), &points, tables->bump_end);
    return BCD_OK;
}

enum bcd_status line_tables_init(struct line_tables *tables, const struct model *model,
                                 double width, struct scratch *scratch)
{
    *tables = (struct line_tables){.model = model};
    tables->width = panel_width(model, width);
    tables->panels = (size_t)line_panels(model, width);
    tables->nodes = tables->panels * LINE_RULE;
    tables->place = scratch_doubles(scratch, tables->nodes);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    init_rule(tables);
    for (size_t node = 0; node < tables->nodes; node++) {
        size_t panel = node / LINE_RULE;
        tables->place[node] = line_edge(tables, panel) + panel_half(tables, panel) *
                                                             (1 + tables->node[node % LINE_RULE]);
    }
    return model->reach > 0 ? init_bump(tables, scratch) : BCD_OK;
}

/* -------------------------------------------------------------------- chain */

double line_weight(const struct model *model, int64_t rod, double y)
{
    return model_weight(model, model->system.diameter * ((double)rod + .5) + y);
}

enum bcd_status line_init(struct line *line, const struct line_tables *tables, bool mirrored,
                          struct scratch *scratch)
{
    *line = (struct line){.tables = tables, .mirrored = mirrored, .scale = 1};
    line->value = scratch_doubles(scratch, tables->nodes);
    line->product = scratch_doubles(scratch, tables->nodes);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    for (size_t node = 0; node < tables->nodes; node++) {
        line->value[node] = 1;
    }
    return BCD_OK;
}

void line_multiply(struct line *line)
{
    const struct line_tables *tables = line->tables;
    const struct model *model = tables->model;
    int64_t rod = line->mirrored ? model->system.particles - 1 - line->rod : line->rod;
    double weight_ns = model_weight_ns(model);
    for (size_t node = 0; node < tables->nodes && model_spend(model, weight_ns); node++) {
        double t = tables->place[node], y = line->mirrored ? model->free_length - t : t;
        line->product[node] = line->value[node] * line_weight(model, rod, y);
    }
}

/* What the bump adds at the nodes of a panel. */
static void add_bump(const struct line *line, size_t panel, double *out)
{
    const struct line_tables *tables = line->tables;
    const double *table = panel + 1 == tables->panels ? tables->bump_end : tables->bump;
    for (size_t d = 0; d <= tables->reach_panels && d <= panel; d++) {
        const double *source = line->product + (panel - d) * LINE_RULE;
        const double *rows = table + d * LINE_RULE * LINE_RULE;
        for (size_t tau = 0; tau < LINE_RULE; tau++) {
            double sum = 0;
            for (size_t nu = 0; nu < LINE_RULE; nu++) {
                sum += rows[tau * LINE_RULE + nu] * source[nu];
            }
            out[tau] += sum;
        }
    }
}

/* Integral over the uniform part of f up to each node, and what comes on top. */
static double integrate_panel(const struct line *line, size_t panel, double running)
{
    const struct line_tables *tables = line->tables;
    const double *source = line->product + panel * LINE_RULE;
    double *out = line->value + panel * LINE_RULE;
    double half = panel_half(tables, panel), whole = 0;
    for (size_t tau = 0; tau < LINE_RULE; tau++) {
        double sum = 0;
        for (size_t nu = 0; nu < LINE_RULE; nu++) {
            sum += tables->below[tau][nu] * source[nu];
        }
        out[tau] = running + half * sum + tables->model->bond * source[tau];
        whole += tables->weight[tau] * source[tau];
    }
    if (tables->bump) {
        add_bump(line, panel, out);
    }
    return running + half * whole;
}

void line_step(struct line *line)
{
    const struct line_tables *tables = line->tables;
    line_multiply(line);
    double running = 0, largest = 0;
    double sources = tables->bump ? 2 + (double)tables->reach_panels : 1;
    double panel_ns = LINE_RULE * LINE_RULE * sources;
    for (size_t panel = 0; panel < tables->panels && model_spend(tables->model, panel_ns);
         panel++) {
        running = integrate_panel(line, panel, running);
    }
    for (size_t node = 0; node < tables->nodes; node++) {
        largest = fmax(largest, line->value[node]);
    }
    line->scale = largest > 0 ? largest : 1;
    for (size_t node = 0; node < tables->nodes; node++) {
        line->value[node] /= line->scale;
    }
    line->rod++;
}
