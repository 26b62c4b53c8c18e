/* SPDX-License-Identifier: GPL-3.0-or-later
 * ring.c - the canonical ring rod by rod (chain.h): for few rods, and against contour.c.
 *
 *   rho(x) ~ w(x) E_N(x, ell)
 *   pairs of neighbours at x and x' = x + sigma + g:  ~ w(x) f(g) w(x') E_{N-1}(x', ell - g)
 *
 * A single rod has no neighbour but itself: its contact, pair and gap densities are zero. */
#include <math.h>
#include <string.h>

#include "chain.h"
#include "transfer.h"

static const size_t points[] = {15, 23, 35, 53, 79, 119, 179};

struct ring {
    const struct model *model;
    struct grid grid;
    struct functionals functionals;
    struct profile profile;
    struct chain chain;
    double complex *mode, *column; /* [n] */
    double *rest, *shifted;        /* [n] */
    struct scratch scratch;
};

/* work->shifted = E_{N-1}(x + sigma + g, ell - g) at the grid's x. */
static void rest_behind(struct ring *ring, double gap)
{
    size_t n = ring->grid.n;
    double one = 1;
    const struct measure single = {.count = 1, .gap = &gap, .weight = &one};
    struct kernel_args args = {
        .grid = &ring->grid, .measure = &single, .diameter = ring->model->system.diameter};
    kernel_modes(&args, ring->mode);
    kernel_column(&ring->grid, ring->mode, ring->column);
    chain_value(&ring->chain, ring->model->free_length - gap, ring->rest);
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t j = 0; j < n; j++) {
            sum += creal(ring->column[(i + n - j) % n]) * ring->rest[j];
        }
        ring->shifted[i] = sum;
    }
}

static double add_point(struct ring *ring, double *out, double gap, double weight)
{
    const struct model *model = ring->model;
    double total = 0, n = (double)ring->grid.n;
    if (!model_spend(model, (2 * n + 20 + model_weight_ns(model)) * n)) {
        return 0;
    }
    rest_behind(ring, gap);
    for (size_t i = 0; i < ring->grid.n; i++) {
        double w = model_weight(model, ring->grid.x[i] + model->system.diameter + gap);
        double term = weight * ring->grid.weight[i] * w * ring->shifted[i] / ring->chain.lambda;
        if (out) {
            out[i] += term;
        }
        total += term;
    }
    return total;
}

/* Adds the average of one gap over the measure to out[n], if any; returns its sum over x. */
static double add_measure(struct ring *ring, double *out, const struct measure *measure)
{
    double total = 0;
    if (measure->delta > 0) {
        total += add_point(ring, out, 0, measure->delta);
    }
    for (size_t i = 0; i < measure->count; i++) {
        total += add_point(ring, out, measure->gap[i], measure->weight[i]);
    }
    if (measure->to > measure->from) {
        double node[CHAIN_RULE], weight[CHAIN_RULE], width = measure->to - measure->from;
        gauss_legendre(CHAIN_RULE, node, weight);
        size_t parts = 1 + (size_t)(width / (6 * ring->model->period / (double)ring->grid.n));
        double half = width / (2 * (double)parts);
        for (size_t i = 0; i < parts * CHAIN_RULE; i++) {
            double gap =
                measure->from + half * (2 * (double)(i / CHAIN_RULE) + 1 + node[i % CHAIN_RULE]);
            total += add_point(ring, out, gap, half * weight[i % CHAIN_RULE]);
        }
    }
    return total;
}

static enum bcd_status prepare(struct ring *ring, size_t n, struct bcd_error *error)
{
    const struct model *model = ring->model;
    struct scratch *scratch = &ring->scratch;
    double rods = (double)model->system.particles, ell = model->free_length;
    double cost = chain_cost(model, n, ell) * rods * (double)n;
    if (!(cost < 3e10) || chain_nodes(model, n, ell) * (double)n > 3e7) {
        return theory_fail(error, BCD_INTERNAL,
                           "canonical ring, rod by rod: too long a computation (%zu points per "
                           "period)",
                           n);
    }
    /* One rod's share of the integral, roughly: keeps E_N within range. */
    double bump = model->bond;
    const double everything[2] = {0, model->reach};
    struct measure all;
    if (measure_init(&all, model, scratch, everything, 0)) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    for (size_t i = 0; i < all.count; i++) {
        bump += all.weight[i];
    }
    grid_init(&ring->grid, model, scratch, n);
    ring->mode = scratch_complex(scratch, n);
    ring->column = scratch_complex(scratch, n);
    ring->rest = scratch_doubles(scratch, n);
    ring->shifted = scratch_doubles(scratch, n);
    struct chain_args args = {.model = model,
                              .grid = &ring->grid,
                              .points = n,
                              .lambda = 2 * model->mean_gap + bump,
                              .last = ell};
    args.lambda = fmax(args.lambda, model->mean_gap / 4); /* a bump may be negative */
    if (scratch->failed || functionals_init(&ring->functionals, model, &ring->grid, scratch) ||
        profile_init(&ring->profile, model, scratch, n) ||
        chain_init(&ring->chain, &args, scratch)) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    return BCD_OK;
}

static enum bcd_status recur(struct ring *ring, struct bcd_error *error)
{
    const struct model *model = ring->model;
    int64_t rods = model->system.particles;
    const struct functionals *f = &ring->functionals;
    struct profile *profile = &ring->profile;
    for (int64_t j = 1; j < rods && !watch_ended(model->system.watch); j++) {
        if (j == rods - 1) {
            add_measure(ring, profile->contact, &f->contact);
            if (profile->window) {
                add_measure(ring, profile->window, &f->window);
            }
            add_measure(ring, profile->bond, &f->bond);
            for (size_t bin = 0; bin < model->wanted.gap_bins; bin++) {
                profile->gap[bin] = add_measure(ring, NULL, &f->gap[bin]);
            }
        }
        chain_step(&ring->chain);
    }
    chain_value(&ring->chain, model->free_length, ring->rest);
    double sum = 0;
    for (size_t i = 0; i < ring->grid.n; i++) {
        profile->density[i] = ring->grid.weight[i] * ring->rest[i];
        sum += profile->density[i];
    }
    if (!(sum > 1e-280 && sum < 1e280)) {
        return theory_fail(error, BCD_INVALID,
                           "canonical ring, rod by rod: weights out of range of the numbers");
    }
    return BCD_OK;
}

static enum bcd_status compute(struct theory_result **result, const struct model *model,
                               size_t level, struct bcd_error *error)
{
    struct ring ring = {.model = model, .scratch = {.watch = model->system.watch}};
    struct theory_result *fresh = NULL;
    enum bcd_status status = prepare(&ring, points[level], error);
    status = status ? status : recur(&ring, error);
    if (!status && result_create(&fresh, &model->wanted)) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    if (status) {
        goto cleanup;
    }
    if (profile_finish(fresh, &ring.profile, model, &ring.grid, &ring.scratch)) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
        goto cleanup;
    }
    fresh->route = "chain";
    *result = fresh;
    fresh = NULL;
cleanup:
    theory_result_free(fresh);
    scratch_free(&ring.scratch);
    return status;
}

enum bcd_status theory_chain(struct theory_result **result, const struct theory_system *system,
                             const struct theory_wanted *wanted, struct bcd_error *error)
{
    struct model model;
    enum bcd_status status = model_init(&model, system, wanted, error);
    if (status) {
        return status;
    }
    if (wanted->pair_bins > 0 && system->particles > 1) {
        return theory_fail(error, BCD_INVALID,
                           "canonical ring, rod by rod: no pair distribution on this route");
    }
    struct refinement how = {.compute = compute,
                             .levels = sizeof points / sizeof *points,
                             .what = "canonical ring, rod by rod"};
    return refine(result, &model, wanted, &how, error);
}

enum bcd_status theory_canonical(struct theory_result **result, const struct theory_system *system,
                                 const struct theory_wanted *wanted, struct bcd_error *error)
{
    if (system->walls) {
        return theory_walls(result, system, wanted, error);
    }
    /* Few rods, and Baxter's limit: the recursion is quick, and the contour converges slowly. */
    enum { FEW = 4, FEW_STICKY = 200 };
    int64_t limit = system->pair.kind == THEORY_BAXTER ? FEW_STICKY : FEW;
    bool few = system->particles == 1 || (system->particles <= limit && wanted->pair_bins == 0);
    struct bcd_error first = {0}, second = {0};
    enum bcd_status status = few ? theory_chain(result, system, wanted, &first)
                                 : theory_contour(result, system, wanted, &first);
    bool again = status == BCD_INVALID && system->particles > 1;
    if (again) {
        status = few ? theory_contour(result, system, wanted, &second)
                     : theory_chain(result, system, wanted, &second);
    }
    if (status && error) {
        *error = again && status == BCD_STOPPED ? second : first;
        error->code = status;
    }
    return status;
}
