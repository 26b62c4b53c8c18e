/* SPDX-License-Identifier: GPL-3.0-or-later
 * walls.c - rods between walls: the chains from both of them (line.h) joined at every rod.
 *
 *   rod i at y:                        w_i A_i(y) B_i(y)
 *   rods i and i + 1 at y and y + g:   w_i A_i(y) f(g) w_{i+1} B_{i+1}(y + g)
 *
 * Integrals over y run over cells that end where panels or bins end. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "line.h"

enum { LEVELS = 9, KEPT_MAX = 40000000 };
#define COST_MAX 3e10
/* Both chains are 1 at their largest; where they meet they are smaller, down to 2^-N. */
#define RAISED 0x1p500

/* Quadrature over one rod's places, with its density and what its right neighbour adds. */
struct places {
    size_t count, edges, edges_most;
    double *edge;
    double *x, *weight;                        /* [count] */
    double *density, *contact, *window, *bond; /* [count], up to a factor */
};

struct walls {
    const struct model *model;
    struct theory_result *result; /* sums, then means */
    struct line_tables tables;
    struct line left, right;
    double *kept; /* [rods][nodes] A_i */
    struct places places;
    struct measure bump;
    double bonds;
    struct scratch scratch;
};

/* -------------------------------------------------------------------- cells */

static void add_edge(struct places *places, double y, double ell)
{
    if (y > 0 && y < ell && places->edges < places->edges_most) {
        places->edge[places->edges++] = y;
    }
}

static void add_bin_edges(struct walls *walls, double first, size_t bins)
{
    const struct model *model = walls->model;
    double width = model->system.length / (double)fmax((double)bins, 1);
    size_t from = (size_t)fmax(floor(first / width), 0);
    for (size_t k = from; k < bins && (double)k * width < first + model->free_length; k++) {
        add_edge(&walls->places, (double)k * width - first, model->free_length);
    }
}

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Where the integrands are not smooth: ends of panels from both walls, of bins; where windows reach
 * such an end. */
static void find_edges(struct walls *walls, int64_t rod)
{
    const struct model *model = walls->model;
    const struct line_tables *tables = &walls->tables;
    struct places *places = &walls->places;
    double ell = model->free_length, gap = model->wanted.contact_gap;
    double first = model->system.diameter * ((double)rod + .5); /* x = first + y */
    places->edges = 0;
    places->edge[places->edges++] = 0;
    for (size_t panel = 0; panel < tables->panels; panel++) {
        double edge = line_edge(tables, panel);
        add_edge(places, edge, ell);
        if (model->reach > 0) {
            add_edge(places, ell - edge, ell);
        }
        if (gap > 0 && (model->reach > 0 || panel == 0)) {
            add_edge(places, ell - edge - gap, ell);
        }
    }
    add_bin_edges(walls, first, model->wanted.density_bins);
    add_bin_edges(walls, first, model->wanted.contact_bins);
    places->edge[places->edges++] = ell;
    qsort(places->edge, places->edges, sizeof *places->edge, rising);
}

static size_t edges_most(const struct model *model, double panels)
{
    double share = model->free_length / model->system.length;
    double bins = (double)(model->wanted.density_bins + model->wanted.contact_bins);
    return (size_t)((model->reach > 0 ? 3 : 1) * panels + share * bins + 8);
}

/* ------------------------------------------------------------------- places */

/* int_0^stretch f(g) w B(y + g) dg of the rod to the right, cut short by the wall. */
static double neighbour_within(struct walls *walls, double y, double stretch)
{
    const struct model *model = walls->model;
    const struct line_tables *tables = &walls->tables;
    const double *product = walls->right.product;
    double room = model->free_length - y, end = fmin(stretch, room), from = 0;
    double sum = model->bond > 0 ? model->bond * line_at(tables, product, room) : 0;
    size_t panel = line_panel(tables, room);
    while (from < end) {
        double to = fmin(room - line_edge(tables, panel), end);
        panel -= panel > 0;
        if (!(to > from)) {
            continue;
        }
        if (from < model->reach) {
            to = fmin(to, model->reach);
            const double gaps[2] = {from, to};
            walls->bump.count = 0;
            measure_add_bump(&walls->bump, model, gaps, 0);
            for (size_t i = 0; i < walls->bump.count; i++) {
                sum += walls->bump.weight[i] *
                       line_at(tables, product, room - walls->bump.gap[i]);
            }
        }
        double half = (to - from) / 2;
        for (size_t i = 0; i < BUMP_RULE; i++) {
            double gap = from + half * (1 + model->node[i]);
            sum += half * model->weight[i] * line_at(tables, product, room - gap);
        }
        from = to;
    }
    return sum;
}

static void look_at(struct walls *walls, int64_t rod, size_t at, double y)
{
    const struct model *model = walls->model;
    const struct line_tables *tables = &walls->tables;
    struct places *places = &walls->places;
    enum theory_pair_kind kind = model->system.pair.kind;
    double room = model->free_length - y;
    double here = RAISED * line_weight(model, rod, y) *
                  line_at(tables, walls->kept + (size_t)rod * tables->nodes, y);
    places->density[at] = here * line_at(tables, walls->right.value, room);
    places->contact[at] = places->window[at] = places->bond[at] = 0;
    if (rod + 1 == model->system.particles) {
        return;
    }
    here /= walls->right.scale;
    double next = line_at(tables, walls->right.product, room);
    places->contact[at] = here * (1 + model_bump(model, 0)) * next;
    if (model->wanted.contact_bins > 0 && model->wanted.contact_gap > 0) {
        places->window[at] = here * neighbour_within(walls, y, model->wanted.contact_gap);
    }
    if (kind == THEORY_BAXTER) {
        places->bond[at] = here * model->bond * next;
    } else if (kind == THEORY_STICKY) {
        places->bond[at] = here * neighbour_within(walls, y, model->reach);
    }
}

/* Four interpolations; a window is a sum of them. */
static double place_ns(const struct walls *walls)
{
    const struct model *model = walls->model;
    const double each = 55;
    double windows = model->wanted.contact_bins > 0 ? model->wanted.contact_gap : 0;
    bool sticky = model->system.pair.kind == THEORY_STICKY;
    double panels = (windows > 0 ? 1 + windows / walls->tables.width : 0) +
                    (sticky ? 1 + model->reach / walls->tables.width : 0);
    double bumps = model->reach > 0 ? 2 : 1;
    return 4 * each + model_weight_ns(model) + panels * bumps * BUMP_RULE * each;
}

static void visit_places(struct walls *walls, int64_t rod)
{
    const struct model *model = walls->model;
    struct places *places = &walls->places;
    double first = model->system.diameter * ((double)rod + .5);
    places->count = 0;
    find_edges(walls, rod);
    for (size_t cell = 0; cell + 1 < places->edges; cell++) {
        double from = places->edge[cell], half = (places->edge[cell + 1] - from) / 2;
        if (!model_spend(model, LINE_RULE * place_ns(walls))) {
            return;
        }
        for (size_t i = 0; i < LINE_RULE && half > 0; i++) {
            size_t at = places->count++;
            double y = from + half * (1 + walls->tables.node[i]);
            places->x[at] = first + y;
            places->weight[at] = half * walls->tables.weight[i];
            look_at(walls, rod, at, y);
        }
    }
}

/* --------------------------------------------------------------------- sums */

static void add_to_bin(double *bins, size_t count, double share, double value)
{
    if (count > 0) {
        size_t bin = (size_t)(share * (double)count);
        bins[bin < count ? bin : count - 1] += value;
    }
}

/* This rod's share of everything: its density integrates to one. */
static bool add_rod(struct walls *walls)
{
    const struct model *model = walls->model;
    const struct theory_wanted *wanted = &model->wanted;
    const struct places *places = &walls->places;
    struct theory_result *result = walls->result;
    double norm = 0, length = model->system.length;
    for (size_t i = 0; i < places->count; i++) {
        norm += places->weight[i] * places->density[i];
    }
    if (!(norm > 1e-200 && norm < 1e300)) {
        return false;
    }
    for (size_t i = 0; i < places->count; i++) {
        double weight = places->weight[i] / norm, share = places->x[i] / length;
        double density = weight * places->density[i];
        add_to_bin(result->density, wanted->density_bins, share, density);
        add_to_bin(result->contact, wanted->contact_bins, share, weight * places->contact[i]);
        if (result->contact_window) {
            add_to_bin(result->contact_window, wanted->contact_bins, share,
                       weight * places->window[i]);
        }
        result->energy += density * model_energy(model, places->x[i]);
        walls->bonds += weight * places->bond[i];
    }
    return true;
}

static void finish(struct walls *walls)
{
    const struct model *model = walls->model;
    const struct theory_wanted *wanted = &model->wanted;
    struct theory_result *result = walls->result;
    double rods = (double)model->system.particles, length = model->system.length;
    for (size_t bin = 0; bin < wanted->density_bins; bin++) {
        result->density[bin] *= (double)wanted->density_bins / length;
    }
    for (size_t bin = 0; bin < wanted->contact_bins; bin++) {
        double per_length = (double)wanted->contact_bins / length;
        result->contact[bin] *= per_length;
        if (result->contact_window) {
            result->contact_window[bin] *= per_length / wanted->contact_gap;
        }
    }
    result->energy /= rods;
    enum theory_pair_kind kind = model->system.pair.kind;
    if (kind == THEORY_BAXTER || kind == THEORY_STICKY) {
        result->bonded_fraction = rods > 1 ? walls->bonds / (rods - 1) : 0;
    }
    result->points = walls->tables.nodes;
    result->route = "walls";
}

/* ------------------------------------------------------------------ compute */

/* Panels of a first grid resolve mean gaps, over which the chains change, and the potential. */
static double panel_width(const struct model *model, size_t level)
{
    double width = fmin(fmin(6 * model->mean_gap, model->free_length / 2), model->period);
    return width / pow(1.5, (double)level);
}

static enum bcd_status check_cost(const struct model *model, double width, struct bcd_error *error)
{
    double rods = (double)model->system.particles, panels = line_panels(model, width);
    double window = model->wanted.contact_gap / panel_width(model, 0);
    double each = 500 + (model->wanted.contact_bins ? 1500 * (1 + window) : 0);
    each += model->reach > 0 ? 3000 : 0;
    double places = panels > 1e8 ? 1e9 : (double)edges_most(model, panels) * LINE_RULE;
    double cost = rods * (2 * line_cost(model, width) + places * each);
    if (!(cost < COST_MAX) || rods * panels * LINE_RULE > KEPT_MAX || places > KEPT_MAX) {
        return theory_fail(error, BCD_INTERNAL,
                           "between walls: too long a computation for %lld rods on %.3g panels",
                           (long long)model->system.particles, panels);
    }
    return BCD_OK;
}

static enum bcd_status prepare(struct walls *walls, double width, struct bcd_error *error)
{
    const struct model *model = walls->model;
    struct scratch *scratch = &walls->scratch;
    struct places *places = &walls->places;
    size_t rods = (size_t)model->system.particles;
    places->edges_most = edges_most(model, line_panels(model, width));
    size_t most = places->edges_most * LINE_RULE;
    const double everything[2] = {0, model->reach};
    walls->bump.capacity = 4 * measure_capacity(model, everything, 0);
    double **arrays[] = {&places->x,      &places->weight, &places->density,
                         &places->contact, &places->window, &places->bond};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = scratch_doubles(scratch, most);
    }
    places->edge = scratch_doubles(scratch, places->edges_most + 2);
    walls->bump.gap = scratch_doubles(scratch, walls->bump.capacity);
    walls->bump.weight = scratch_doubles(scratch, walls->bump.capacity);
    if (line_tables_init(&walls->tables, model, width, scratch) == BCD_OK) {
        walls->kept = scratch_doubles(scratch, rods * walls->tables.nodes);
        line_init(&walls->left, &walls->tables, false, scratch);
        line_init(&walls->right, &walls->tables, true, scratch);
    }
    return scratch->failed || result_create(&walls->result, &model->wanted)
               ? theory_fail(error, BCD_NO_MEMORY, "out of memory")
               : BCD_OK;
}

static enum bcd_status recur(struct walls *walls, struct bcd_error *error)
{
    int64_t rods = walls->model->system.particles;
    size_t nodes = walls->tables.nodes;
    struct bcd_watch *watch = walls->model->system.watch;
    for (int64_t i = 0; i < rods && !watch_ended(watch); i++) {
        if (i > 0) {
            line_step(&walls->left);
        }
        memcpy(walls->kept + (size_t)i * nodes, walls->left.value, nodes * sizeof(double));
    }
    for (int64_t i = rods - 1; i >= 0 && !watch_ended(watch); i--) {
        if (i + 1 < rods) {
            line_step(&walls->right);
        }
        visit_places(walls, i);
        if (!add_rod(walls)) {
            return theory_fail(error, BCD_INVALID,
                               "between walls: weights out of range of the numbers (too many "
                               "rods, or too strong a potential)");
        }
    }
    finish(walls);
    return BCD_OK;
}

static enum bcd_status compute(struct theory_result **result, const struct model *model,
                               size_t level, struct bcd_error *error)
{
    struct walls walls = {.model = model, .scratch = {.watch = model->system.watch}};
    double width = panel_width(model, level);
    enum bcd_status status = check_cost(model, width, error);
    status = status ? status : prepare(&walls, width, error);
    status = status ? status : recur(&walls, error);
    if (status == BCD_OK) {
        *result = walls.result;
        walls.result = NULL;
    }
    theory_result_free(walls.result);
    scratch_free(&walls.scratch);
    return status;
}

enum bcd_status theory_walls(struct theory_result **result, const struct theory_system *system,
                             const struct theory_wanted *wanted, struct bcd_error *error)
{
    struct model model;
    enum bcd_status status = model_init_walls(&model, system, wanted, error);
    if (status) {
        return status;
    }
    if (wanted->pair_bins > 0 && system->particles > 1) {
        return theory_fail(error, BCD_INVALID, "no exact pair distribution between walls");
    }
    struct refinement how = {.compute = compute, .levels = LEVELS, .what = "between walls"};
    return refine(result, &model, wanted, &how, error);
}
