/* SPDX-License-Identifier: GPL-3.0-or-later
 * pairs.c - see pairs.h. */
#include <math.h>
#include <string.h>

#include "chain.h"
#include "pairs.h"

enum { RULE = 16 };

/* Rods that can matter within `last`: those that fit, and not many more than are expected. */
static size_t count_terms(const struct model *model, size_t *most)
{
    const struct theory_system *system = &model->system;
    double last = model->wanted.pair_last, fit = (double)system->particles - 1;
    if (system->diameter > 0) {
        fit = fmin(fit, floor(last / system->diameter * (1 + 1e-12)));
    }
    *most = (size_t)fit;
    double expected = model->density * (last + model->period);
    return (size_t)fmin(fit, ceil(2 * expected + 12 * sqrt(expected) + 16));
}

enum bcd_status pairs_init(struct pairs *pairs, const struct transfer *transfer,
                           struct scratch *scratch, struct bcd_error *error)
{
    const struct model *model = transfer->model;
    *pairs = (struct pairs){.transfer = transfer};
    if (model->wanted.pair_bins == 0) {
        return BCD_OK;
    }
    size_t n = transfer->grid.n;
    pairs->terms = count_terms(model, &pairs->most);
    double steps = model->wanted.pair_last / model->period * (double)n;
    double size = (steps + 2 * PAIRS_MARGIN) * (double)n * (double)pairs->terms;
    if (size > PAIRS_TABLE_MAX) {
        return theory_fail(error, BCD_INVALID,
                           "a pair distribution up to %g needs too many terms (%zu rods between)",
                           model->wanted.pair_last, pairs->terms);
    }
    double joins = (double)(model->wanted.pair_bins * RULE * n) * (double)pairs->terms;
    if (joins > PAIRS_JOINS_MAX) {
        return theory_fail(error, BCD_INVALID,
                           "a pair distribution up to %g in %zu bins takes too long (%zu rods "
                           "between)",
                           model->wanted.pair_last, model->wanted.pair_bins, pairs->terms);
    }
    pairs->steps = (size_t)steps + 2 + 2 * PAIRS_MARGIN;
    pairs->rest = scratch_doubles(scratch, pairs->terms * pairs->steps * n);
    return scratch->failed ? theory_fail(error, BCD_NO_MEMORY, "out of memory") : BCD_OK;
}

void pairs_add(struct pairs *pairs, size_t j, const struct contribution *c)
{
    size_t n = c->transfer->grid.n;
    const struct model *model = c->transfer->model;
    double step_ns = 60 + 2 * (double)n;
    for (size_t step = 0; step < pairs->steps && model_spend(model, step_ns); step++) {
        double r = ((double)step - PAIRS_MARGIN) * model->period / (double)n;
        /* Only the phase: exp(-p g) goes with the chain. */
        double phase = -cimag(c->s) * (r - (double)j * model->system.diameter);
        double complex factor = c->factor * cexp(I * phase);
        double *out = pairs->rest + ((j - 1) * pairs->steps + step) * n;
        size_t shift = (step + n * PAIRS_MARGIN - PAIRS_MARGIN) % n;
        for (size_t i = 0; i < n; i++) {
            size_t place = (i + shift) % n * n + i;
            out[i] += creal(factor) * c->rest->re[place] - cimag(factor) * c->rest->im[place];
        }
    }
}

/* Interpolates the table at r: 16 points around it. */
static void rest_at(const struct pairs *pairs, size_t j, double r, double *out)
{
    size_t n = pairs->transfer->grid.n;
    double place = r / pairs->transfer->model->period * (double)n;
    size_t first = (size_t)floor(place) + 1; /* of PAIRS_MARGIN * 2 points, margin included */
    double t = place + PAIRS_MARGIN - (double)first;
    memset(out, 0, n * sizeof *out);
    for (size_t a = 0; a < 2 * PAIRS_MARGIN; a++) {
        double share = 1;
        for (size_t b = 0; b < 2 * PAIRS_MARGIN; b++) {
            share *= a == b ? 1 : (t - (double)b) / ((double)a - (double)b);
        }
        const double *row = pairs->rest + ((j - 1) * pairs->steps + first + a) * n;
        for (size_t i = 0; i < n; i++) {
            out[i] += share * row[i];
        }
    }
}

enum bcd_status bin_points_init(struct bin_points *points, const struct model *model, size_t n,
                                struct scratch *scratch)
{
    double width = model->wanted.pair_last / (double)model->wanted.pair_bins;
    points->capacity = ((size_t)(width / model->period * (double)n / 6) + 8) * RULE * 5;
    points->r = scratch_doubles(scratch, points->capacity);
    points->weight = scratch_doubles(scratch, points->capacity);
    points->count = n; /* grid, until set */
    return scratch->failed ? BCD_NO_MEMORY : BCD_OK;
}

static void add_interval(struct bin_points *points, double a, double b, double step)
{
    double node[RULE], weight[RULE];
    gauss_legendre(RULE, node, weight);
    size_t parts = 1 + (size_t)((b - a) / step);
    double half = (b - a) / (2 * (double)parts);
    for (size_t part = 0; part < parts; part++) {
        for (size_t i = 0; i < RULE && points->count < points->capacity; i++) {
            points->r[points->count] = a + half * (2 * (double)part + 1 + node[i]);
            points->weight[points->count++] = half * weight[i];
        }
    }
}

void bin_points_set(struct bin_points *points, const struct model *model, size_t j, size_t bin)
{
    double width = model->wanted.pair_last / (double)model->wanted.pair_bins;
    double contact = (double)j * model->system.diameter, to = width * ((double)bin + 1);
    double from = fmax(width * (double)bin, contact), step = model->period / 8;
    points->count = 0;
    for (size_t k = 1; k <= 4 && model->reach > 0 && from < to; k++) {
        double edge = contact + (double)k * model->reach;
        if (edge > from && edge < to) {
            add_interval(points, from, edge, step);
            from = edge;
        }
    }
    if (from < to) {
        add_interval(points, from, to, step);
    }
}

size_t bin_of_contact(const struct model *model, size_t j)
{
    double width = model->wanted.pair_last / (double)model->wanted.pair_bins;
    double bin = floor((double)j * model->system.diameter / width * (1 + 1e-12));
    return bin < (double)model->wanted.pair_bins ? (size_t)bin : model->wanted.pair_bins;
}

struct pair_work {
    double *left, *right; /* [n] */
    struct bin_points points;
};

/* Mean over x of left * w(x + r) * right. */
static double join(const struct pairs *pairs, double r, const struct pair_work *work)
{
    const struct model *model = pairs->transfer->model;
    const struct grid *grid = &pairs->transfer->grid;
    double sum = 0, r_folded = fmod(r, model->period);
    for (size_t i = 0; i < grid->n; i++) {
        sum += work->left[i] * model_weight(model, grid->x[i] + r_folded) * work->right[i];
    }
    return sum;
}

/* Adds the term of j = chain->rods to all bins; returns the largest bin of this term. */
static double add_term(double *bins, const struct pairs *pairs, const struct chain *chain,
                       struct pair_work *work)
{
    const struct model *model = chain->model;
    const struct theory_wanted *wanted = &model->wanted;
    size_t j = (size_t)chain->rods, n = chain->grid->n;
    double contact = (double)j * model->system.diameter, largest = 0;
    for (size_t bin = bin_of_contact(model, j); bin < wanted->pair_bins; bin++) {
        double sum = 0;
        bin_points_set(&work->points, model, j, bin);
        double point_ns = 500 + (24 + model_weight_ns(model)) * (double)n;
        if (!model_spend(model, point_ns * (double)work->points.count)) {
            return 0;
        }
        for (size_t k = 0; k < work->points.count; k++) {
            double r = work->points.r[k], gap = r - contact;
            chain_value(chain, gap, work->left);
            rest_at(pairs, j, r, work->right);
            sum += work->points.weight[k] * exp(-pairs->transfer->p * gap) * join(pairs, r, work);
        }
        if (bin == bin_of_contact(model, j) && model->bond > 0) {
            memcpy(work->left, chain->delta, n * sizeof(double));
            rest_at(pairs, j, contact, work->right);
            sum += join(pairs, contact, work);
        }
        bins[bin] += sum;
        largest = sum > largest ? sum : largest;
    }
    return largest;
}

enum bcd_status pairs_finish(struct theory_result *result, const struct pairs *pairs, double norm,
                             struct scratch *scratch, struct bcd_error *error)
{
    if (pairs->terms == 0) {
        return BCD_OK;
    }
    const struct transfer *t = pairs->transfer;
    const struct model *model = t->model;
    const struct theory_wanted *wanted = &model->wanted;
    struct chain chain;
    struct pair_work work = {.left = scratch_doubles(scratch, t->grid.n),
                             .right = scratch_doubles(scratch, t->grid.n)};
    struct chain_args args = {.model = model,
                              .grid = &t->grid,
                              .points = t->grid.n,
                              .lambda = t->lambda,
                              .last = wanted->pair_last - model->system.diameter};
    if (t->p * wanted->pair_last > 600) {
        return theory_fail(error, BCD_INVALID,
                           "pair distribution: pressure times distance %g is too large",
                           t->p * wanted->pair_last);
    }
    if (chain_nodes(model, t->grid.n, args.last) * (double)t->grid.n > PAIRS_TABLE_MAX) {
        return theory_fail(error, BCD_INVALID, "a pair distribution up to %g takes too long",
                           wanted->pair_last);
    }
    if (bin_points_init(&work.points, model, t->grid.n, scratch) ||
        chain_init(&chain, &args, scratch)) {
        return theory_fail(error, BCD_NO_MEMORY, "pair distribution: out of memory");
    }
    double width = wanted->pair_last / (double)wanted->pair_bins, last = 0, largest = 0;
    for (size_t j = 1; j <= pairs->terms && !watch_ended(model->system.watch); j++) {
        last = add_term(result->pair, pairs, &chain, &work);
        largest = last > largest ? last : largest;
        if (j < pairs->terms) {
            chain_step(&chain);
        }
    }
    if (pairs->terms < pairs->most && last > 1e-12 * largest) {
        return theory_fail(error, BCD_INVALID,
                           "pair distribution: more than %zu rods within a distance of %g",
                           pairs->terms, wanted->pair_last);
    }
    for (size_t bin = 0; bin < wanted->pair_bins; bin++) {
        result->pair[bin] = fmax(result->pair[bin] / (width * model->density * norm), 0);
    }
    return BCD_OK;
}
