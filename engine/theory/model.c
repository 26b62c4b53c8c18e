/* SPDX-License-Identifier: GPL-3.0-or-later
 * model.c - a checked system; its Boltzmann factors and measures on gaps (tools.h). */
#include <math.h>

#include "tools.h"

#define ROUNDING (1 + 1e-12)
enum { RULE = BUMP_RULE };

static enum bcd_status check_pair(const struct theory_system *system, struct bcd_error *error)
{
    const struct theory_pair *pair = &system->pair;
    switch (pair->kind) {
    case THEORY_HARD:
        return BCD_OK;
    case THEORY_STICKY:
        if (!(pair->range > 0 && pair->range <= system->length)) {
            return theory_fail(error, BCD_INVALID,
                               "the range %g of the stickiness must be positive and below L",
                               pair->range);
        }
        if (!(pair->exponent >= 0 && pair->exponent <= 1000)) {
            return theory_fail(error, BCD_INVALID,
                               "the exponent %g of the stickiness is not within 0 .. 1000",
                               pair->exponent);
        }
        if (pair->range > system->diameter) {
            return theory_fail(error, BCD_INVALID,
                               "a stickiness of range %g reaches beyond nearest neighbours of "
                               "diameter %g: no exact reference",
                               pair->range, system->diameter);
        }
        /* fallthrough */
    case THEORY_BAXTER:
        if (!(pair->strength > 0 && pair->strength < 1e9)) {
            return theory_fail(error, BCD_INVALID,
                               "the stickiness %g must be positive and below 1e9", pair->strength);
        }
        return BCD_OK;
    case THEORY_ENERGY:
        if (!pair->energy || !(pair->cutoff > system->diameter) ||
            !(pair->cutoff <= 2 * system->diameter)) {
            return theory_fail(error, BCD_INVALID,
                               "a pair energy with cutoff %g reaches beyond nearest neighbours of "
                               "diameter %g: no exact reference",
                               pair->cutoff, system->diameter);
        }
        return BCD_OK;
    }
    return theory_fail(error, BCD_INVALID, "unknown kind of pair interaction");
}

static enum bcd_status check_system(const struct theory_system *system, struct bcd_error *error)
{
    double n = (double)system->particles;
    if (system->particles < 1 || system->particles > 10000000) {
        return theory_fail(error, BCD_INVALID, "%lld rods: exact references go from 1 to 1e7",
                           (long long)system->particles);
    }
    if (!(system->length > 0 && system->length < 1e12) || !(system->diameter >= 0)) {
        return theory_fail(error, BCD_INVALID, "length %g or diameter %g out of range",
                           system->length, system->diameter);
    }
    if (system->temperature == 0) {
        return theory_fail(error, BCD_INVALID,
                           "at zero temperature there is no equilibrium density to compare with");
    }
    if (!(system->temperature > 0 && system->temperature < 1e300)) {
        return theory_fail(error, BCD_INVALID, "temperature %g out of range", system->temperature);
    }
    if (!(system->length - n * system->diameter > 1e-9 * system->length)) {
        return theory_fail(error, BCD_INVALID,
                           "the rods leave %g of the length %g free: a rigid body, without a "
                           "reference of exact statistics",
                           system->length - n * system->diameter, system->length);
    }
    return check_pair(system, error);
}

bool model_refuses(const struct theory_system *system)
{
    return check_system(system, NULL) != BCD_OK;
}

static enum bcd_status check_wanted(const struct model *model, struct bcd_error *error)
{
    const struct theory_wanted *w = &model->wanted;
    enum { MOST = 1000000 };
    if (w->density_bins > MOST || w->contact_bins > MOST || w->pair_bins > MOST ||
        w->gap_bins > MOST) {
        return theory_fail(error, BCD_INVALID, "more than %d bins", MOST);
    }
    if (!(w->contact_gap >= 0 && w->contact_gap < model->free_length) ||
        (w->gap_bins && !(w->gap_last > 0 && w->gap_last <= model->free_length * ROUNDING)) ||
        (w->pair_bins && !(w->pair_last > 0 && w->pair_last <= model->system.length / 2))) {
        return theory_fail(error, BCD_INVALID,
                           "contact gap %g, last gap %g or last distance %g does not fit the ring",
                           w->contact_gap, w->gap_last, w->pair_last);
    }
    /* Quadratures run over these stretches in panels that resolve a period. */
    double longest = fmax(fmax(model->reach, w->contact_gap), w->gap_bins ? w->gap_last : 0);
    longest = fmax(longest, w->pair_bins ? w->pair_last : 0);
    if (!(longest <= 2000 * model->period)) {
        return theory_fail(error, BCD_INVALID,
                           "ranges, gaps or distances up to %g are too many periods %g", longest,
                           model->period);
    }
    if (!(w->tolerance >= 1e-12 && w->tolerance < 1)) {
        return theory_fail(error, BCD_INVALID, "tolerance %g is not within 1e-12 .. 1",
                           w->tolerance);
    }
    return BCD_OK;
}

static enum bcd_status fold_potential(struct model *model, struct bcd_error *error)
{
    const struct theory_system *system = &model->system;
    if (!system->energy) {
        /* Nothing depends on x: one rod's share of the ring is as good a period as any. */
        model->period = system->length / (double)system->particles;
        model->bin_period = system->length;
        return BCD_OK;
    }
    double ratio = system->length / system->period, whole = round(ratio);
    if (!(system->period > 0) || whole < 1 || fabs(ratio - whole) > 1e-9 * whole) {
        return theory_fail(error, BCD_INVALID, "the length %g is not a whole number of periods %g",
                           system->length, system->period);
    }
    model->period = model->bin_period = system->length / whole;
    enum { SCAN = 4096 };
    model->lowest = INFINITY;
    model_spend(model, SCAN * model_weight_ns(model));
    for (int i = 0; i < SCAN; i++) {
        double u = system->energy(system->ctx, model->period * i / SCAN);
        if (!isfinite(u)) {
            return theory_fail(error, BCD_INVALID, "the potential is not finite at x = %g",
                               model->period * i / SCAN);
        }
        model->lowest = u < model->lowest ? u : model->lowest;
    }
    return BCD_OK;
}

/* What holds on the ring and between walls. */
static enum bcd_status begin(struct model *model, const struct theory_system *system,
                             const struct theory_wanted *wanted, struct bcd_error *error)
{
    *model = (struct model){.system = *system, .wanted = *wanted};
    if (model->wanted.tolerance == 0) {
        model->wanted.tolerance = system->tolerance > 0 ? system->tolerance : 1e-9;
    }
    enum bcd_status status = check_system(system, error);
    if (status) {
        return status;
    }
    model->free_length = system->length - (double)system->particles * system->diameter;
    model->mean_gap = model->free_length / (double)system->particles;
    model->density = (double)system->particles / system->length;
    const struct theory_pair *pair = &system->pair;
    model->bond = pair->kind == THEORY_BAXTER ? pair->strength : 0;
    model->reach = pair->kind == THEORY_STICKY   ? pair->range
                   : pair->kind == THEORY_ENERGY ? pair->cutoff - system->diameter
                                                 : 0;
    gauss_legendre(RULE, model->node, model->weight);
    return BCD_OK;
}

enum bcd_status model_init(struct model *model, const struct theory_system *system,
                           const struct theory_wanted *wanted, struct bcd_error *error)
{
    if (system->walls) {
        return theory_fail(error, BCD_INVALID,
                           "between walls there is no infinite system at the same density to "
                           "compare with");
    }
    enum bcd_status status = begin(model, system, wanted, error);
    status = status ? status : fold_potential(model, error);
    return status ? status : check_wanted(model, error);
}

/* Smallest energy that a centre comes to, roughly. */
static enum bcd_status scan_potential(struct model *model, struct bcd_error *error)
{
    const struct theory_system *system = &model->system;
    enum { SCAN = 4096 };
    double room = system->length - system->diameter;
    model_spend(model, SCAN * model_weight_ns(model));
    model->lowest = INFINITY;
    for (int i = 0; i <= SCAN; i++) {
        double x = system->diameter / 2 + room * i / SCAN;
        double u = model_energy(model, x) - system->force * x;
        if (!isfinite(u)) {
            return theory_fail(error, BCD_INVALID, "the potential is not finite at x = %g", x);
        }
        model->lowest = u < model->lowest ? u : model->lowest;
    }
    return BCD_OK;
}

enum bcd_status model_init_walls(struct model *model, const struct theory_system *system,
                                 const struct theory_wanted *wanted, struct bcd_error *error)
{
    enum { MOST = 1000000 };
    enum bcd_status status = begin(model, system, wanted, error);
    if (status) {
        return status;
    }
    model->bin_period = system->length;
    model->period = system->length;
    if (system->energy && system->period > 0 && system->period < system->length) {
        model->period = system->period;
    }
    if (wanted->density_bins > MOST || wanted->contact_bins > MOST || wanted->pair_bins > MOST) {
        return theory_fail(error, BCD_INVALID, "more than %d bins", MOST);
    }
    if (wanted->gap_bins) {
        return theory_fail(error, BCD_INVALID, "no gap distribution between walls");
    }
    if (!(wanted->contact_gap >= 0 && wanted->contact_gap <= model->free_length) ||
        (wanted->pair_bins && !(wanted->pair_last > 0 && wanted->pair_last <= system->length))) {
        return theory_fail(error, BCD_INVALID,
                           "contact gap %g or last distance %g does not fit between the walls",
                           wanted->contact_gap, wanted->pair_last);
    }
    if (!(model->wanted.tolerance >= 1e-12 && model->wanted.tolerance < 1)) {
        return theory_fail(error, BCD_INVALID, "tolerance %g is not within 1e-12 .. 1",
                           model->wanted.tolerance);
    }
    return scan_potential(model, error);
}

double model_weight_ns(const struct model *model)
{
    const double usual = 12, exponential = 8;
    const struct theory_system *system = &model->system;
    double energy = system->energy_ns > 0 ? system->energy_ns : usual;
    return exponential + (system->energy ? energy : 0);
}

double model_energy(const struct model *model, double x)
{
    const struct theory_system *system = &model->system;
    return system->energy ? system->energy(system->ctx, x) : 0;
}

double model_weight(const struct model *model, double x)
{
    const struct theory_system *system = &model->system;
    if (!system->energy && system->force == 0) {
        return 1;
    }
    return exp((model->lowest - model_energy(model, x) + system->force * x) / system->temperature);
}

double model_bump(const struct model *model, double gap)
{
    const struct theory_pair *pair = &model->system.pair;
    if (gap >= model->reach || gap < 0) {
        return 0;
    }
    if (pair->kind == THEORY_STICKY) {
        return pair->strength * (pair->exponent + 1) / pair->range *
               pow(1 - gap / pair->range, pair->exponent);
    }
    double v = pair->energy(pair->ctx, model->system.diameter + gap);
    return expm1(-v / model->system.temperature);
}

/* Panels of the bump's quadrature. Towards its end a sticky bump vanishes like a power that need
 * not be whole: there the panels halve, down to where the rest no longer counts. */
struct panels {
    size_t graded; /* halvings towards the end of the bump */
    size_t even;   /* equal panels in each */
    double from, to;
};

static struct panels bump_panels(const struct model *model, const double range[2],
                                 double wave_number)
{
    const struct theory_pair *pair = &model->system.pair;
    struct panels panels = {.from = range[0] > 0 ? range[0] : 0,
                            .to = range[1] < model->reach ? range[1] : model->reach};
    double width = panels.to - panels.from;
    if (!(width > 0)) {
        return (struct panels){0};
    }
    bool ends = panels.to == model->reach;
    if (pair->kind == THEORY_STICKY) {
        bool whole = pair->exponent == floor(pair->exponent) && pair->exponent < 16;
        panels.graded = ends && !whole ? 2 + (size_t)(60 / (pair->exponent + 1)) : 1;
        panels.even = 1 + (size_t)(pair->exponent * width / model->reach / 8);
    } else {
        panels.graded = 1;
        panels.even = 8;
    }
    panels.even += (size_t)(wave_number * width / 8);
    return panels;
}

size_t measure_capacity(const struct model *model, const double range[2], double wave_number)
{
    struct panels panels = bump_panels(model, range, wave_number);
    return panels.graded * panels.even * RULE;
}

void measure_add_bump(struct measure *measure, const struct model *model, const double range[2],
                      double wave_number)
{
    struct panels panels = bump_panels(model, range, wave_number);
    double a = panels.from;
    for (size_t level = 0; level < panels.graded; level++) {
        double b = level + 1 == panels.graded ? panels.to : a + (panels.to - a) / 2;
        double half = (b - a) / (2 * (double)panels.even);
        for (size_t part = 0; part < panels.even; part++) {
            double middle = a + (2 * (double)part + 1) * half;
            for (size_t i = 0; i < RULE && measure->count < measure->capacity; i++) {
                double gap = middle + half * model->node[i];
                measure->gap[measure->count] = gap;
                measure->weight[measure->count++] =
                    half * model->weight[i] * model_bump(model, gap);
            }
        }
        a = b;
    }
}

enum bcd_status measure_init(struct measure *measure, const struct model *model,
                             struct scratch *scratch, const double range[2], double wave_number)
{
    *measure = (struct measure){.from = range[0], .to = range[1]};
    measure->delta = range[0] <= 0 ? model->bond : 0;
    measure->capacity = measure_capacity(model, range, wave_number);
    measure->gap = scratch_doubles(scratch, measure->capacity);
    measure->weight = scratch_doubles(scratch, measure->capacity);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    measure_add_bump(measure, model, range, wave_number);
    return BCD_OK;
}
