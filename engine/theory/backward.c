/* SPDX-License-Identifier: GPL-3.0-or-later
 * backward.c - see backward.h. */
#include <math.h>
#include <string.h>

#include "backward.h"

/* Doubles kept in a draw; operations of a draw; rods, whose weights span the range of numbers. */
enum { KEPT_MAX = 16000000, RODS_MAX = 1500 };
#define COST_MAX 4e8

/* Without a potential the bins divide the ring rather than a period: all the same. */
static void fill_density(struct ramp *ramp, const struct theory_result *result, double period)
{
    double width = period / RAMP_POINTS, sum = 0;
    for (size_t i = 0; i < RAMP_POINTS; i++) {
        size_t before = (i + RAMP_POINTS - 1) % RAMP_POINTS;
        ramp->value[i] = sum;
        ramp->slope[i] = (result->density[before] + result->density[i]) / 2;
        sum += result->density[i] * width;
    }
    ramp->value[RAMP_POINTS] = ramp->rise = sum;
    ramp->slope[RAMP_POINTS] = ramp->slope[0];
}

static enum bcd_status init_tables(struct backward *backward, struct bcd_error *error)
{
    const struct model *model = backward->model;
    double nowhere = 0;
    const struct grid grid = {.n = 1, .period = model->period, .x = &nowhere};
    struct chain_args args = {.model = model,
                              .grid = &grid,
                              .points = backward->points,
                              .lambda = 1,
                              .last = model->free_length};
    const double everything[2] = {0, model->reach};
    if (chain_init(&backward->tables, &args, &backward->scratch) ||
        measure_init(&backward->bump, model, &backward->scratch, everything, 0)) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    return BCD_OK;
}

enum bcd_status backward_init(struct backward *backward, const struct model *model,
                              struct bcd_error *error)
{
    *backward = (struct backward){.model = model, .scratch = {.watch = model->system.watch}};
    const struct theory_wanted wanted = {.density_bins = RAMP_POINTS};
    struct theory_result *result = NULL;
    enum bcd_status status = theory_canonical(&result, &model->system, &wanted, error);
    if (status) {
        return status;
    }
    double rods = (double)model->system.particles, ell = model->free_length;
    backward->points = result->points > 53 ? result->points : 53;
    if (rods > RODS_MAX || chain_nodes(model, backward->points, ell) * rods > KEPT_MAX ||
        chain_cost(model, backward->points, ell) * rods > COST_MAX) {
        theory_result_free(result);
        return theory_fail(error, BCD_INVALID,
                           "equilibrium draw: too many rods for so dense or so deep a system");
    }
    fill_density(&backward->density, result, model->period);
    theory_result_free(result);
    status = init_tables(backward, error);
    backward->scratch.watch = NULL; /* borrowed until here */
    return watch_ended(model->system.watch) ? watch_stopped(model->system.watch, error) : status;
}

void backward_fini(struct backward *backward)
{
    scratch_free(&backward->scratch);
}

/* One draw. F_j = E_j(g) w at the place of rod j: arrays of all j. */
struct walk {
    const struct model *model;
    const struct theory_uniforms *uniforms;
    struct chain chain;
    size_t nodes;
    double *kept;              /* [rods - 1][nodes] F_1 .. F_{N-1} */
    double *delta;             /* [rods - 1] weights of the delta functions at g = 0, w included */
    const struct measure *all; /* quadrature over the whole bump */
    struct measure bump;       /* over a part of it */
};

static double uniform(const struct walk *walk)
{
    return walk->uniforms->next(walk->uniforms->ctx);
}

/* F on panel `panel` at t in [-1, 1]. */
static double panel_value(const struct walk *walk, const double *f, size_t panel, double t)
{
    double share[CHAIN_RULE], sum = 0;
    chain_cardinal(&walk->chain, t, share);
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        sum += share[nu] * f[panel * CHAIN_RULE + nu];
    }
    return sum > 0 ? sum : 0;
}

static double value_at(const struct walk *walk, const double *f, double gap)
{
    double place = gap / walk->chain.width;
    size_t panel = place > 0 ? (size_t)place : 0;
    panel = panel < walk->chain.panels ? panel : walk->chain.panels - 1;
    return panel_value(walk, f, panel, 2 * (place - (double)panel) - 1);
}

/* int of F over its panel from -1 to t is (t + 1) times a polynomial that the rule's points
 * determine: mean[nu] = its values there. */
static void panel_means(const struct walk *walk, const double *f, size_t panel,
                        double mean[CHAIN_RULE])
{
    const struct chain *chain = &walk->chain;
    for (size_t tau = 0; tau < CHAIN_RULE; tau++) {
        double sum = 0;
        for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
            sum += chain->below[tau][nu] * f[panel * CHAIN_RULE + nu];
        }
        mean[tau] = sum / (chain->node[tau] + 1);
    }
}

static double panel_integral(const struct walk *walk, const double mean[CHAIN_RULE], double t)
{
    double share[CHAIN_RULE], sum = 0;
    chain_cardinal(&walk->chain, t, share);
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        sum += share[nu] * mean[nu];
    }
    return sum * (t + 1);
}

/* int of F over [0, end]. */
static double integral_to(const struct walk *walk, const double *f, double end)
{
    const struct chain *chain = &walk->chain;
    size_t last = (size_t)fmin(end / chain->width, (double)chain->panels - 1);
    double sum = 0;
    for (size_t panel = 0; panel < last; panel++) {
        for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
            sum += chain->weight[nu] * f[panel * CHAIN_RULE + nu] * chain->width / 2;
        }
    }
    double mean[CHAIN_RULE];
    panel_means(walk, f, last, mean);
    return sum + panel_integral(walk, mean, 2 * (end / chain->width - (double)last) - 1);
}

/* g with int_0^g F = target, 0 <= g <= end. */
static double invert_integral(const struct walk *walk, const double *f, double target, double end)
{
    const struct chain *chain = &walk->chain;
    for (size_t panel = 0; panel < chain->panels; panel++) {
        double whole = 0;
        for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
            whole += chain->weight[nu] * f[panel * CHAIN_RULE + nu] * chain->width / 2;
        }
        bool last = panel + 1 == chain->panels || (double)(panel + 1) * chain->width >= end;
        if (target > whole && !last) {
            target -= whole;
            continue;
        }
        double a = -1, b = 1, fa = -target, fb = whole - target, mean[CHAIN_RULE];
        panel_means(walk, f, panel, mean);
        for (int turn = 0; turn < 60 && b - a > 1e-11; turn++) {
            double t = turn % 3 == 2 || !(fb > fa) ? (a + b) / 2 : a - fa * (b - a) / (fb - fa);
            double here = panel_integral(walk, mean, t) - target;
            if (here < 0) {
                a = t;
                fa = here;
            } else {
                b = t;
                fb = here;
            }
        }
        return fmin(((double)panel + (a + 1) / 2) * chain->width, end);
    }
    return end;
}

/* A gap u from bump(u) F(end - u), u <= end. */
static double bump_gap(struct walk *walk, const double *f, double end)
{
    const struct theory_pair *pair = &walk->model->system.pair;
    const struct chain *chain = &walk->chain;
    double from = fmax((end - pair->range) / chain->width, 0), most = 0;
    size_t to = (size_t)fmin(end / chain->width, (double)chain->panels - 1);
    for (size_t node = (size_t)from * CHAIN_RULE; node < (to + 1) * CHAIN_RULE; node++) {
        most = fmax(most, f[node]);
    }
    most *= 1.1; /* between the nodes */
    for (int turn = 0; turn < 10000000; turn++) {
        double gap = pair->range * (1 - pow(uniform(walk), 1 / (pair->exponent + 1)));
        if (gap <= end && uniform(walk) * most < value_at(walk, f, end - gap)) {
            return gap;
        }
    }
    return 0; /* F vanishes on all of the range: not reached, as the bump then has no weight */
}

/* int of bump(u) F(end - u) over u in [0, end]. */
static double bump_integral(struct walk *walk, const double *f, double end)
{
    const struct measure *points = walk->all;
    if (end < walk->model->reach) { /* cut short */
        const double range[2] = {0, end};
        walk->bump.count = 0;
        measure_add_bump(&walk->bump, walk->model, range, 0);
        points = &walk->bump;
    }
    double sum = 0;
    for (size_t i = 0; i < points->count; i++) {
        sum += points->weight[i] * value_at(walk, f, end - points->gap[i]);
    }
    return sum;
}

/* Place of rod j, given that of the next one, `end`. */
static double step_back(struct walk *walk, size_t j, double end)
{
    const struct model *model = walk->model;
    const double *f = walk->kept + (j - 1) * walk->nodes;
    double together = walk->delta[j - 1]; /* all rods up to j bonded to rod 0 */
    double open = integral_to(walk, f, end), bond = 0;
    if (model->bond > 0) {
        bond = model->bond * value_at(walk, f, end);
    } else if (model->reach > 0) {
        bond = bump_integral(walk, f, end);
    }
    double pick = uniform(walk) * (together + open + bond);
    if (pick < together) {
        return 0;
    }
    if (pick < together + bond) {
        return model->bond > 0 ? end : end - bump_gap(walk, f, end);
    }
    return invert_integral(walk, f, pick - together - bond, end);
}

static enum bcd_status walk_init(struct walk *walk, const struct backward *backward,
                                 const struct grid *grid, struct scratch *scratch)
{
    const struct model *model = backward->model;
    struct chain_args args = {.model = model,
                              .grid = grid,
                              .points = backward->points,
                              .lambda = 1,
                              .last = model->free_length,
                              .like = &backward->tables};
    if (chain_init(&walk->chain, &args, scratch)) {
        return BCD_NO_MEMORY;
    }
    size_t rods = (size_t)model->system.particles;
    const double everything[2] = {0, model->reach};
    walk->nodes = walk->chain.panels * CHAIN_RULE;
    walk->kept = scratch_doubles(scratch, (rods - 1) * walk->nodes);
    walk->delta = scratch_doubles(scratch, rods - 1);
    walk->bump.capacity = 4 * measure_capacity(model, everything, 0);
    walk->bump.gap = scratch_doubles(scratch, walk->bump.capacity);
    walk->bump.weight = scratch_doubles(scratch, walk->bump.capacity);
    return scratch->failed ? BCD_NO_MEMORY : BCD_OK;
}

/* All F_j; each scaled to a largest value of 1, which its own draw does not notice. */
static void compute_chain(struct walk *walk)
{
    struct chain *chain = &walk->chain;
    size_t rods = (size_t)walk->model->system.particles;
    double x = chain->grid->x[0], sigma = walk->model->system.diameter;
    double reach = chain->bump ? 1 + (double)chain->reach_panels : 0;
    double rod_ns = (double)walk->nodes *
                    (.7 * CHAIN_RULE * (1 + reach) + model_weight_ns(walk->model) + 3);
    for (size_t j = 1; j < rods && watch_spend(walk->uniforms->watch, rod_ns); j++) {
        walk->delta[j - 1] = chain->delta[0] * model_weight(walk->model, x + (double)j * sigma);
        chain_step(chain);
        memcpy(walk->kept + (j - 1) * walk->nodes, chain->product, walk->nodes * sizeof(double));
        double largest = chain->delta[0];
        for (size_t node = 0; node < walk->nodes; node++) {
            largest = fmax(largest, chain->value[node]);
        }
        for (size_t node = 0; node < walk->nodes && largest > 0; node++) {
            chain->value[node] /= largest;
        }
        chain->delta[0] /= largest > 0 ? largest : 1;
    }
}

enum bcd_status backward_draw(const struct backward *backward, double *y, double *first,
                              const struct theory_uniforms *uniforms)
{
    const struct model *model = backward->model;
    size_t rods = (size_t)model->system.particles;
    struct scratch scratch = {.watch = uniforms->watch};
    struct walk walk = {.model = model, .uniforms = uniforms, .all = &backward->bump};
    const struct ramp *ramp = &backward->density;
    *first = ramp_inverse(ramp, model->period, uniform(&walk) * ramp->rise);
    const struct grid grid = {.n = 1, .period = model->period, .x = first};
    enum bcd_status status = walk_init(&walk, backward, &grid, &scratch);
    if (status == BCD_OK) {
        compute_chain(&walk);
        double end = model->free_length;
        for (size_t j = rods - 1; j >= 1 && !watch_ended(uniforms->watch); j--) {
            y[j] = end = step_back(&walk, j, end);
        }
        y[0] = 0;
    }
    scratch_free(&scratch);
    return status;
}
