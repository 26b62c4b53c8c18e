/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cost.c - see cost.h: the loops of contour.c, infinite.c, ring.c, walls.c and sampler.c, counted
 * instead of run.
 *
 * The grid that will do: Boltzmann factors of wells of curvature k have the Fourier modes of
 * Gaussians of variance kT/k, down to the tolerance; under pressure a rod's place takes those of
 * the wells of rods beside it. The answer is the first grid that is as fine, confirmed by the next
 * one. */
#include <math.h>

#include "chain.h"
#include "cost.h"
#include "line.h"
#include "pairs.h"
#include "sampler.h"

/* The checked model without a look at the potential. */
static void make_model(struct model *model, const struct theory_system *system,
                       const struct theory_wanted *wanted)
{
    const struct theory_pair *pair = &system->pair;
    double rods = (double)system->particles;
    *model = (struct model){.system = *system, .wanted = *wanted};
    model->system.watch = NULL;
    model->free_length = system->length - rods * system->diameter;
    model->mean_gap = model->free_length / rods;
    model->density = rods / system->length;
    model->bond = pair->kind == THEORY_BAXTER ? pair->strength : 0;
    model->reach = pair->kind == THEORY_STICKY   ? pair->range
                   : pair->kind == THEORY_ENERGY ? pair->cutoff - system->diameter
                                                 : 0;
    model->period = system->energy ? fmin(system->period, system->length) : system->length / rods;
    if (system->walls && !system->energy) {
        model->period = system->length;
    }
}

/* Points per period that resolve it to nine digits. */
static double points_needed(const struct model *model)
{
    const double digits = 41, pressed = .3, contacts = 11; /* 2 ln 1e9; found by comparison */
    const struct theory_system *system = &model->system;
    double pressure = fmax(model->period / model->mean_gap - 2, 0), points = 3;
    if (system->energy) {
        double wave = sqrt(digits * system->curvature / system->temperature);
        points += wave * sqrt(1 + pressed * pressure) * model->period / PI;
        points += model->wanted.contact_bins > 0 && !model->bond ? contacts : 0;
    }
    return system->tolerance > 0 ? 2 * points : points; /* rough: by powers only */
}

/* Levels are gone through up to the one after the first that is fine enough. */
static size_t levels_taken(const size_t *points, size_t count, double needed)
{
    size_t level = 0;
    while (level + 1 < count && (double)points[level] < needed) {
        level++;
    }
    return level + 2 < count ? level + 2 : count;
}

/* --------------------------------------------------------------------- ring */

static double bump_points(const struct model *model, double points)
{
    const double range[2] = {0, model->reach};
    return model->reach > 0 ? (double)measure_capacity(model, range, PI * points / model->period)
                            : 0;
}

/* Columns of a measure of so many points. */
static double column_ns(double n, double count)
{
    return 150 * n + 2 * n * n + count * (100 + 3 * n);
}

static double window_points(const struct model *model)
{
    double gap = model->wanted.contact_bins > 0 ? model->wanted.contact_gap : 0;
    return gap > 0 ? 16 * (1 + 24 * gap / model->period) + 1 : 0;
}

static double transfer_ns(const struct model *model, double n)
{
    const double turns = 5; /* secants */
    double bump = bump_points(model, n);
    return turns * (3 * column_ns(n, bump) + 41 * 1.5 * n * n + 5 * (.25 * n + 5) * n * n);
}

/* Shifts of contacts and windows; then one contribution to all profiles. */
static double functionals_ns(const struct model *model, double n)
{
    return (1 + window_points(model)) * (column_ns(n, 1) + n * model_weight_ns(model));
}

static double profile_ns(const struct model *model, double n)
{
    bool bonds = model->system.pair.kind == THEORY_STICKY || model->bond > 0;
    return (1 + bonds) * (column_ns(n, bump_points(model, n)) + 4 * n * n) +
           (1 + window_points(model)) * (.7 * n * n + 100);
}

static double bins_ns(const struct model *model, double n)
{
    const struct theory_wanted *wanted = &model->wanted;
    double windows = wanted->contact_gap > 0 ? 2 : 1;
    return 20 * n * ((double)wanted->density_bins + windows * (double)wanted->contact_bins);
}

/* The pair distribution's own part: terms of chains, joined in every bin. */
struct pair_cost {
    double terms, steps, join_ns, bytes;
};

static struct pair_cost pair_cost(const struct model *model, double n)
{
    struct pair_cost cost = {0};
    double last = model->wanted.pair_last, bins = (double)model->wanted.pair_bins;
    if (!(bins > 0) || !(last > 0)) {
        return cost;
    }
    double fit = (double)model->system.particles - 1, sigma = model->system.diameter;
    fit = sigma > 0 ? fmin(fit, floor(last / sigma * (1 + 1e-12))) : fit;
    double expected = model->density * (last + model->period);
    cost.terms = fmin(fit, ceil(2 * expected + 12 * sqrt(expected) + 16));
    cost.steps = last / model->period * n + 2 + 2 * PAIRS_MARGIN;
    if (cost.steps * n * cost.terms > PAIRS_TABLE_MAX ||
        bins * 16 * n * cost.terms > PAIRS_JOINS_MAX) {
        return (struct pair_cost){.terms = -1}; /* refused */
    }
    double width = last / bins, parts = 1 + floor(8 * width / model->period);
    double contact = fmin(sigma * (cost.terms + 1) / 2, last); /* of the mean term */
    double point_ns = 500 + (24 + model_weight_ns(model)) * n;
    double places = bins * (1 - contact / last) * 16 * parts;
    double chain_ns = .5 * chain_cost(model, (size_t)n, fmax(last - sigma, 0)) * n;
    cost.join_ns = cost.terms * (places * point_ns + chain_ns);
    cost.bytes =
        8 * n *
        (cost.terms * cost.steps + 2 * chain_nodes(model, (size_t)n, fmax(last - sigma, 0)));
    return cost;
}

static double products(int64_t exponent)
{
    double count = 0;
    for (int64_t rest = exponent; rest > 0; rest >>= 1) {
        count += 1 + (double)(rest & 1);
    }
    return count > 0 ? count - 1 : 0;
}

/* Thetas that are summed, all attempts with more and more of them together; of gaps of an ideal
 * gas. */
static double thetas_summed(const struct model *model)
{
    double rods = (double)model->system.particles, per_gap = model->period / model->mean_gap;
    double deviation = sqrt(rods) / per_gap, summed = 0;
    double thetas = 2 * ceil(8 * deviation + 3);
    double dead = per_gap * sqrt(expm1(120 / rods)); /* the theta from which on */
    for (int doubling = 0; doubling < 3; doubling++, thetas *= 2) {
        double reached = rods + thetas / 2 * per_gap; /* where the weight is to have vanished */
        summed += fmin(thetas / 2, dead * thetas / (2 * PI) + 3 + fmin(thetas, 256) / 16);
        if ((rods - 1) * log(reached / (rods - 1)) - (reached - rods + 1) < log(1e-7)) {
            break;
        }
    }
    return summed;
}

static struct theory_cost contour_at(const struct model *model, double n)
{
    struct pair_cost pairs = pair_cost(model, n);
    int64_t rods = model->system.particles, terms = pairs.terms > 1 ? (int64_t)pairs.terms : 1;
    double product_ns = n * n * n, all = products(rods - terms) + (double)(terms - 1);
    double theta_ns = all * product_ns + column_ns(n, bump_points(model, n)) + 2 * n * n +
                      pairs.terms * pairs.steps * (60 + 2 * n) + profile_ns(model, n);
    double ns = transfer_ns(model, n) + functionals_ns(model, n) + bins_ns(model, n) +
                thetas_summed(model) * theta_ns + pairs.join_ns;
    return (struct theory_cost){1e-9 * ns,
                                80 * n * n + 24 * n * window_points(model) + pairs.bytes};
}

static struct theory_cost chain_at(const struct model *model, double n)
{
    double rods = (double)model->system.particles, ell = model->free_length;
    double nodes = chain_nodes(model, (size_t)n, ell);
    double weights = model->reach > 0 ? nodes : fmin(nodes, 2.7 * n);
    double step_ns = n * (.35 * chain_cost(model, (size_t)n, ell) + 2 * nodes +
                          weights * model_weight_ns(model));
    double contact_ns = (1 + window_points(model)) * (column_ns(n, 1) + 50 * n);
    return (struct theory_cost){1e-9 * ((rods - 1) * step_ns + 2 * contact_ns + bins_ns(model, n)),
                                8 * n * (2 * nodes + 3 * n)};
}

typedef struct theory_cost cost_at(const struct model *model, double n);

static struct theory_cost add_levels(const struct model *model, const size_t *points, size_t count,
                                     cost_at *at)
{
    struct theory_cost sum = {0};
    size_t levels = levels_taken(points, count, points_needed(model));
    for (size_t level = 0; level < levels; level++) {
        if (pair_cost(model, (double)points[level]).terms < 0) {
            break;
        }
        struct theory_cost cost = at(model, (double)points[level]);
        sum.seconds += cost.seconds;
        sum.bytes = fmax(sum.bytes, cost.bytes);
    }
    return sum;
}

/* -------------------------------------------------------------------- walls */

static struct theory_cost walls_at(const struct model *model, double width)
{
    const struct theory_wanted *wanted = &model->wanted;
    double rods = (double)model->system.particles, panels = line_panels(model, width);
    double bins = (double)wanted->density_bins + (double)wanted->contact_bins;
    double cells =
        (model->reach > 0 ? 3 : 1) * panels + bins * model->free_length / model->system.length + 2;
    double wide = model->free_length / panels;
    double gap = wanted->contact_bins > 0 ? wanted->contact_gap : 0;
    double stretches = (gap > 0 ? 1 + gap / wide : 0) +
                       (model->system.pair.kind == THEORY_STICKY ? 1 + model->reach / wide : 0);
    double place_ns =
        4 * 55 + model_weight_ns(model) + stretches * (model->reach > 0 ? 2 : 1) * BUMP_RULE * 55;
    double sources = model->reach > 0 ? 2 + model->reach / wide : 1;
    double step_ns =
        panels * (LINE_RULE * LINE_RULE * sources + LINE_RULE * model_weight_ns(model));
    return (struct theory_cost){1e-9 * rods * (2 * step_ns + cells * LINE_RULE * place_ns),
                                8 * LINE_RULE * (rods * panels + 6 * cells)};
}

static struct theory_cost walls_cost(const struct model *model)
{
    struct theory_cost sum = {0};
    int levels = !model->system.energy || model->reach > 0 ? 2
                 : model->wanted.contact_bins > 0          ? 4
                                                           : 3;
    for (int level = 0; level < levels; level++) {
        double width = fmin(fmin(6 * model->mean_gap, model->free_length / 2), model->period);
        struct theory_cost cost = walls_at(model, width / pow(1.5, level));
        sum.seconds += cost.seconds;
        sum.bytes = fmax(sum.bytes, cost.bytes);
    }
    return sum;
}

/* ------------------------------------------------------------------- public */

static const size_t contour_points[] = {15, 23, 35, 45, 57, 71, 89, 111, 139, 175, 219, 271};
static const size_t other_points[] = {15, 23, 35, 53, 79, 119, 179, 269, 405};

struct theory_cost theory_cost_canonical(const struct theory_system *system,
                                         const struct theory_wanted *wanted)
{
    struct model model;
    make_model(&model, system, wanted);
    if (model_refuses(system) || (system->walls && wanted->pair_bins > 0)) {
        return (struct theory_cost){0};
    }
    if (system->walls) {
        return walls_cost(&model);
    }
    const enum theory_pair_kind kind = system->pair.kind;
    bool few = system->particles <= (kind == THEORY_BAXTER ? 200 : 4) && wanted->pair_bins == 0;
    if (few || system->particles < 2) {
        return add_levels(&model, other_points, 7, chain_at);
    }
    return add_levels(&model, contour_points, sizeof contour_points / sizeof *contour_points,
                      contour_at);
}

static struct theory_cost infinite_at(const struct model *model, double n)
{
    struct pair_cost pairs = pair_cost(model, n);
    double ns = 2 * transfer_ns(model, n) + functionals_ns(model, n) + profile_ns(model, n) +
                bins_ns(model, n) + pairs.terms * pairs.steps * (60 + 2 * n) + pairs.join_ns;
    return (struct theory_cost){1e-9 * ns, 60 * n * n + pairs.bytes};
}

struct theory_cost theory_cost_infinite(const struct theory_system *system,
                                        const struct theory_wanted *wanted)
{
    struct model model;
    make_model(&model, system, wanted);
    if (model_refuses(system) || system->walls) {
        return (struct theory_cost){0};
    }
    return add_levels(&model, other_points, sizeof other_points / sizeof *other_points,
                      infinite_at);
}

/* Rods placed until a ring closes; until that is given up (sampler.c). */
#define RODS_TRIED 3e6
static double rods_placed(double rods)
{
    return 3 * rods * sqrt(rods);
}

/* Where rings do not close by themselves. */
static bool by_recursion(const struct model *model)
{
    return rods_placed((double)model->system.particles) > RODS_TRIED ||
           (model->system.energy && model->mean_gap < .07 * model->period);
}

struct theory_cost theory_cost_sampler(const struct theory_system *system)
{
    const struct theory_wanted nothing = {0}, density = {.density_bins = 8192};
    struct model model;
    make_model(&model, system, &nothing);
    if (model_refuses(system)) {
        return (struct theory_cost){0};
    }
    if (system->walls) {
        return theory_cost_canonical(system, &(struct theory_wanted){.density_bins = 16});
    }
    double n = fmax(35, points_needed(&model)), tables = 8 * 8192. * (50 + 6 * n);
    double bounds = 4 * 8192. * fmin(8192 * model.reach / model.period, 8192);
    double placed = by_recursion(&model) ? RODS_TRIED : rods_placed((double)system->particles);
    double trials = 3 * placed * THEORY_PLACED_NS;
    struct theory_cost cost = {1e-9 * (transfer_ns(&model, n) + tables + bounds + trials),
                               60 * n * n};
    if (by_recursion(&model)) {
        struct theory_cost more = theory_cost_canonical(system, &density);
        cost.seconds += more.seconds;
        cost.bytes += more.bytes;
    }
    return cost;
}

struct theory_cost theory_cost_draw(const struct theory_system *system)
{
    const struct theory_wanted nothing = {0};
    struct model model;
    double rods = (double)system->particles;
    make_model(&model, system, &nothing);
    if (model_refuses(system)) {
        return (struct theory_cost){0};
    }
    if (system->walls) {
        return (struct theory_cost){1e-9 * 1000 * rods, 0};
    }
    if (!by_recursion(&model)) {
        return (struct theory_cost){1e-9 * THEORY_PLACED_NS * rods_placed(rods), 0};
    }
    double ell = model.free_length, nodes = chain_nodes(&model, 53, ell);
    return (struct theory_cost){
        1e-9 * rods * (.5 * chain_cost(&model, 53, ell) + nodes * model_weight_ns(&model)),
        8 * nodes * rods};
}
