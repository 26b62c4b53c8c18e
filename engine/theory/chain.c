/* SPDX-License-Identifier: GPL-3.0-or-later
 * chain.c - see chain.h. */
#include <math.h>
#include <string.h>

#include "chain.h"

/* Panels refine together with the grid: about 2.7 of their points for one of the grid. */
static double panel_width(const struct model *model, size_t n, size_t *per_period)
{
    double wanted = 6 * model->period / (double)n;
    if (model->reach > 0) {
        /* Panels end where the bump ends, and more of them near there on finer grids. */
        double parts = ceil(model->reach / wanted) + floor((double)n / 60);
        *per_period = 0;
        return model->reach / fmax(parts, 1);
    }
    *per_period = (size_t)ceil((double)n / 6);
    return model->period / (double)*per_period;
}

static size_t panel_count(const struct model *model, size_t n, double last)
{
    size_t per_period;
    double count = ceil(last / panel_width(model, n, &per_period));
    return count < 1 ? 1 : (size_t)fmin(count, 1e9);
}

double chain_nodes(const struct model *model, size_t points, double last)
{
    return (double)panel_count(model, points, last) * CHAIN_RULE;
}

double chain_cost(const struct model *model, size_t points, double last)
{
    size_t per_period;
    double width = panel_width(model, points, &per_period);
    double reach = model->reach > 0 ? 1 + model->reach / width : 0;
    double weights = per_period ? 0 : 40; /* one exponential of a potential counts for as many */
    return chain_nodes(model, points, last) * (weights + CHAIN_RULE * 2 * (1 + reach));
}

void chain_cardinal(const struct chain *chain, double t, double value[CHAIN_RULE])
{
    double sum = 0;
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        double distance = t - chain->node[nu];
        if (distance == 0) {
            memset(value, 0, CHAIN_RULE * sizeof *value);
            value[nu] = 1;
            return;
        }
        value[nu] = chain->barycentric[nu] / distance;
        sum += value[nu];
    }
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        value[nu] /= sum;
    }
}

static void init_rule(struct chain *chain)
{
    gauss_legendre(CHAIN_RULE, chain->node, chain->weight);
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        double x = chain->node[nu], size = sqrt((1 - x * x) * chain->weight[nu]);
        chain->barycentric[nu] = nu % 2 ? -size : size;
    }
}

static void init_below(struct chain *chain)
{
    for (size_t tau = 0; tau < CHAIN_RULE; tau++) {
        double half = (chain->node[tau] + 1) / 2;
        for (size_t i = 0; i < CHAIN_RULE; i++) {
            double value[CHAIN_RULE];
            chain_cardinal(chain, -1 + half * (chain->node[i] + 1), value);
            for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
                chain->below[tau][nu] += half * chain->weight[i] * value[nu] * chain->width / 2;
            }
        }
    }
}

static enum bcd_status init_bump(struct chain *chain, struct scratch *scratch)
{
    const struct model *model = chain->model;
    if (!(model->reach > 0)) {
        return BCD_OK;
    }
    chain->reach_panels = (size_t)round(model->reach / chain->width);
    const double everything[2] = {0, model->reach};
    struct measure points = {.capacity = 4 * measure_capacity(model, everything, 0)};
    points.gap = scratch_doubles(scratch, points.capacity);
    points.weight = scratch_doubles(scratch, points.capacity);
    chain->bump = scratch_doubles(scratch, (chain->reach_panels + 1) * CHAIN_RULE * CHAIN_RULE);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    for (size_t d = 0; d <= chain->reach_panels; d++) {
        for (size_t tau = 0; tau < CHAIN_RULE; tau++) {
            double offset = (chain->node[tau] + 1) / 2 * chain->width;
            if (!model_spend(model, 60 * (double)points.capacity)) {
                return BCD_OK;
            }
            double top = offset + (double)d * chain->width;
            const double range[2] = {top - chain->width, top};
            points.count = 0;
            measure_add_bump(&points, model, range, 0);
            double *row = chain->bump + (d * CHAIN_RULE + tau) * CHAIN_RULE;
            for (size_t i = 0; i < points.count; i++) {
                double value[CHAIN_RULE];
                chain_cardinal(chain, 2 * (top - points.gap[i]) / chain->width - 1, value);
                for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
                    row[nu] += points.weight[i] * value[nu];
                }
            }
        }
    }
    return BCD_OK;
}

static void share_tables(struct chain *chain, const struct chain *like)
{
    memcpy(chain->node, like->node, sizeof chain->node);
    memcpy(chain->weight, like->weight, sizeof chain->weight);
    memcpy(chain->barycentric, like->barycentric, sizeof chain->barycentric);
    memcpy(chain->below, like->below, sizeof chain->below);
    chain->bump = like->bump;
    chain->reach_panels = like->reach_panels;
}

static double gap_at(const struct chain *chain, size_t node)
{
    return chain->width * ((double)(node / CHAIN_RULE) + (chain->node[node % CHAIN_RULE] + 1) / 2);
}

enum bcd_status chain_init(struct chain *chain, const struct chain_args *args,
                           struct scratch *scratch)
{
    const struct model *model = args->model;
    size_t n = args->grid->n;
    *chain = (struct chain){
        .model = model, .grid = args->grid, .lambda = args->lambda, .last = args->last};
    chain->rods = 1;
    chain->width = panel_width(model, args->points, &chain->per_period);
    chain->panels = panel_count(model, args->points, chain->last);
    size_t nodes = chain->panels * CHAIN_RULE;
    chain->value = scratch_doubles(scratch, nodes * n);
    chain->product = scratch_doubles(scratch, nodes * n);
    chain->table = scratch_doubles(scratch, chain->per_period * CHAIN_RULE * n);
    chain->delta = scratch_doubles(scratch, n);
    chain->running = scratch_doubles(scratch, n);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    if (args->like) {
        share_tables(chain, args->like);
    } else {
        init_rule(chain);
        init_below(chain);
        if (init_bump(chain, scratch)) {
            return BCD_NO_MEMORY;
        }
    }
    for (size_t node = 0; node < nodes; node++) {
        double f = 1 + model_bump(model, gap_at(chain, node));
        for (size_t i = 0; i < n; i++) {
            chain->value[node * n + i] = f / chain->lambda;
        }
    }
    for (size_t i = 0; i < n; i++) {
        chain->delta[i] = model->bond / chain->lambda;
    }
    return BCD_OK;
}

/* product = E_j w / lambda at every node. */
static void multiply_weights(struct chain *chain)
{
    size_t n = chain->grid->n, nodes = chain->panels * CHAIN_RULE;
    double shift = fmod((double)chain->rods * chain->model->system.diameter, chain->model->period);
    size_t repeat = chain->per_period * CHAIN_RULE;
    double weight_ns = (double)n * model_weight_ns(chain->model), product_ns = (double)n;
    for (size_t node = 0; node < repeat && model_spend(chain->model, weight_ns); node++) {
        for (size_t i = 0; i < n; i++) {
            chain->table[node * n + i] =
                model_weight(chain->model, chain->grid->x[i] + shift + gap_at(chain, node));
        }
    }
    double node_ns = product_ns + (repeat ? 0 : weight_ns);
    for (size_t node = 0; node < nodes && model_spend(chain->model, node_ns); node++) {
        const double *restrict from = chain->value + node * n;
        double *restrict to = chain->product + node * n;
        if (repeat) {
            const double *restrict w = chain->table + node % repeat * n;
            for (size_t i = 0; i < n; i++) {
                to[i] = from[i] * w[i] / chain->lambda;
            }
            continue;
        }
        double g = fmod(shift + gap_at(chain, node), chain->model->period);
        for (size_t i = 0; i < n; i++) {
            to[i] = from[i] * model_weight(chain->model, chain->grid->x[i] + g) / chain->lambda;
        }
    }
}

static void add_scaled(size_t n, double *restrict to, const double *restrict from, double factor)
{
    for (size_t i = 0; i < n; i++) {
        to[i] += factor * from[i];
    }
}

/* Integral over the uniform part of f up to each node, and the bump's part. */
static void integrate_panel(struct chain *chain, size_t panel)
{
    size_t n = chain->grid->n;
    const double *here = chain->product + panel * CHAIN_RULE * n;
    for (size_t tau = 0; tau < CHAIN_RULE; tau++) {
        double *out = chain->value + (panel * CHAIN_RULE + tau) * n;
        memcpy(out, chain->running, n * sizeof *out);
        for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
            add_scaled(n, out, here + nu * n, chain->below[tau][nu]);
        }
        for (size_t d = 0; chain->bump && d <= chain->reach_panels && d <= panel; d++) {
            const double *source = here - d * CHAIN_RULE * n;
            const double *row = chain->bump + (d * CHAIN_RULE + tau) * CHAIN_RULE;
            for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
                add_scaled(n, out, source + nu * n, row[nu]);
            }
        }
    }
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        add_scaled(n, chain->running, here + nu * n, chain->weight[nu] * chain->width / 2);
    }
}

void chain_step(struct chain *chain)
{
    size_t n = chain->grid->n;
    const struct model *model = chain->model;
    multiply_weights(chain);
    /* A rod bonded to all before it: the delta function at g' = 0 becomes a constant beyond. */
    double shift = fmod((double)chain->rods * model->system.diameter, model->period);
    for (size_t i = 0; i < n; i++) {
        chain->running[i] =
            chain->delta[i] * model_weight(model, chain->grid->x[i] + shift) / chain->lambda;
        chain->delta[i] = chain->running[i] * model->bond;
    }
    double reach = chain->bump ? 1 + (double)chain->reach_panels : 0;
    double panel_ns = .7 * CHAIN_RULE * CHAIN_RULE * (double)n * (1 + reach);
    for (size_t panel = 0; panel < chain->panels && model_spend(model, panel_ns); panel++) {
        integrate_panel(chain, panel);
    }
    if (model->bond > 0) {
        for (size_t node = 0; node < chain->panels * CHAIN_RULE; node++) {
            add_scaled(n, chain->value + node * n, chain->product + node * n, model->bond);
        }
    }
    chain->rods++;
}

void chain_kept_value(const struct chain *chain, const double *value, int64_t rods, double gap,
                      double *out)
{
    size_t n = chain->grid->n;
    if (rods == 1) { /* not smooth, but known */
        for (size_t i = 0; i < n; i++) {
            out[i] = (1 + model_bump(chain->model, gap)) / chain->lambda;
        }
        return;
    }
    double place = gap / chain->width;
    size_t panel = place > 0 ? (size_t)place : 0;
    panel = panel < chain->panels ? panel : chain->panels - 1;
    double share[CHAIN_RULE];
    chain_cardinal(chain, 2 * (place - (double)panel) - 1, share);
    memset(out, 0, n * sizeof *out);
    for (size_t nu = 0; nu < CHAIN_RULE; nu++) {
        add_scaled(n, out, value + (panel * CHAIN_RULE + nu) * n, share[nu]);
    }
}

void chain_value(const struct chain *chain, double gap, double *out)
{
    chain_kept_value(chain, chain->value, chain->rods, gap, out);
}
