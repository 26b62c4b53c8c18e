/* SPDX-License-Identifier: GPL-3.0-or-later
 * profile.c - averages of one gap from chains of transfer operators (transfer.h). */
#include <math.h>
#include <string.h>

#include "transfer.h"

/* A delta function at contact. */
static enum bcd_status point_measure(struct measure *measure, struct scratch *scratch,
                                     double weight)
{
    *measure = (struct measure){.count = 1, .capacity = 1};
    measure->gap = scratch_doubles(scratch, 1);
    measure->weight = scratch_doubles(scratch, 1);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    measure->weight[0] = weight;
    return BCD_OK;
}

/* The window as a set of points: f(g) dg on [0, Delta'), on panels that resolve U. */
static enum bcd_status window_measure(struct measure *measure, const struct model *model,
                                      struct scratch *scratch, double wave_number)
{
    enum { RULE = 16 };
    const double range[2] = {0, model->wanted.contact_gap};
    size_t panels = 1 + (size_t)(24 * range[1] / model->period);
    *measure = (struct measure){.capacity = panels * RULE + 1};
    measure->capacity += measure_capacity(model, range, wave_number);
    measure->gap = scratch_doubles(scratch, measure->capacity);
    measure->weight = scratch_doubles(scratch, measure->capacity);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    double node[RULE], weight[RULE], half = range[1] / (2 * (double)panels);
    gauss_legendre(RULE, node, weight);
    for (size_t i = 0; i < panels * RULE; i++) {
        measure->gap[i] = half * (2 * (double)(i / RULE) + 1 + node[i % RULE]);
        measure->weight[i] = half * weight[i % RULE];
    }
    measure->count = panels * RULE;
    measure->weight[measure->count++] = model->bond; /* at gap 0 */
    measure_add_bump(measure, model, range, wave_number);
    return BCD_OK;
}

static enum bcd_status shifts_init(struct shifts *shifts, const struct measure *points,
                                   const struct model *model, const struct grid *grid,
                                   struct scratch *scratch)
{
    size_t n = grid->n;
    double sigma = model->system.diameter;
    double complex *mode = scratch_complex(scratch, n), *column = scratch_complex(scratch, n);
    shifts->column = scratch_doubles(scratch, points->count * 2 * n);
    shifts->weight_there = scratch_doubles(scratch, points->count * n);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    double one = 1;
    double place_ns = model_weight_ns(model) * (double)n;
    for (size_t point = 0; point < points->count && model_spend(model, place_ns); point++) {
        double gap = points->gap[point];
        const struct measure single = {.count = 1, .gap = &gap, .weight = &one};
        struct kernel_args args = {.grid = grid, .measure = &single, .diameter = sigma};
        kernel_modes(&args, mode);
        kernel_column(grid, mode, column);
        for (size_t i = 0; i < n; i++) {
            shifts->column[point * 2 * n + i] = shifts->column[point * 2 * n + n + i] =
                creal(column[i]);
            shifts->weight_there[point * n + i] = model_weight(model, grid->x[i] + sigma + gap);
        }
    }
    return BCD_OK;
}

enum bcd_status functionals_init(struct functionals *f, const struct model *model,
                                 const struct grid *grid, struct scratch *scratch)
{
    const struct theory_wanted *wanted = &model->wanted;
    double wave_number = transfer_wave_number(model, grid->n);
    *f = (struct functionals){0};
    enum bcd_status status = point_measure(&f->contact, scratch, 1 + model_bump(model, 0));
    if (!status && wanted->contact_gap > 0) {
        status = window_measure(&f->window, model, scratch, wave_number);
    }
    status = status ? status : shifts_init(&f->contact_shifts, &f->contact, model, grid, scratch);
    status = status ? status : shifts_init(&f->window_shifts, &f->window, model, grid, scratch);
    if (!status && model->system.pair.kind == THEORY_BAXTER) {
        status = point_measure(&f->bond, scratch, model->bond);
    } else if (!status && model->system.pair.kind == THEORY_STICKY) {
        const double range[2] = {0, model->reach};
        status = measure_init(&f->bond, model, scratch, range, wave_number);
    }
    f->gap = scratch_bytes(scratch, wanted->gap_bins * sizeof *f->gap);
    for (size_t bin = 0; bin < wanted->gap_bins && !status && !scratch->failed; bin++) {
        double width = wanted->gap_last / (double)wanted->gap_bins;
        const double range[2] = {width * (double)bin, width * ((double)bin + 1)};
        status = measure_init(&f->gap[bin], model, scratch, range, wave_number);
    }
    return scratch->failed ? BCD_NO_MEMORY : status;
}

enum bcd_status profile_init(struct profile *profile, const struct model *model,
                             struct scratch *scratch, size_t n)
{
    profile->density = scratch_doubles(scratch, n);
    profile->contact = scratch_doubles(scratch, n);
    profile->window = model->wanted.contact_gap > 0 ? scratch_doubles(scratch, n) : NULL;
    profile->bond = scratch_doubles(scratch, n);
    profile->gap = scratch_doubles(scratch, model->wanted.gap_bins);
    return scratch->failed ? BCD_NO_MEMORY : BCD_OK;
}

/* sum_j g_{i-j} w_j rest_ji for every i. */
static void add_diagonal(double *out, const struct contribution *c)
{
    const struct grid *grid = &c->transfer->grid;
    size_t n = grid->n;
    double complex factor = c->factor / c->transfer->lambda;
    model_spend(c->transfer->model, 4 * (double)(n * n));
    for (size_t i = 0; i < n; i++) {
        double complex sum = 0;
        for (size_t j = 0; j < n; j++) {
            double complex r = c->rest->re[j * n + i] + I * c->rest->im[j * n + i];
            sum += c->transfer->complex_column[(i + n - j) % n] * (grid->weight[j] * r);
        }
        out[i] += creal(factor * sum);
    }
}

/* The same for a measure of points, with w at the exact places rather than as a trigonometric
 * polynomial: contact densities may be smaller than densities by many orders of magnitude. */
static void add_points(double *out, const struct contribution *c, const struct measure *measure,
                       const struct shifts *shifts)
{
    size_t n = c->transfer->grid.n;
    double *re = c->transfer->sum, *im = re + n, point_ns = .7 * (double)(n * n) + 100;
    for (size_t point = 0; point < measure->count && model_spend(c->transfer->model, point_ns);
         point++) {
        const double *column = shifts->column + point * 2 * n + n;
        memset(re, 0, 2 * n * sizeof *re);
        for (size_t j = 0; j < n; j++) {
            const double *restrict from_re = c->rest->re + j * n;
            const double *restrict from_im = c->rest->im + j * n;
            for (size_t i = 0; i < n; i++) {
                re[i] += column[(ptrdiff_t)i - (ptrdiff_t)j] * from_re[i];
                im[i] += column[(ptrdiff_t)i - (ptrdiff_t)j] * from_im[i];
            }
        }
        double complex factor = c->factor * cexp(-c->s * measure->gap[point]) *
                                (measure->weight[point] / c->transfer->lambda);
        const double *w = shifts->weight_there + point * n;
        for (size_t i = 0; i < n; i++) {
            out[i] += w[i] * (creal(factor) * re[i] - cimag(factor) * im[i]);
        }
    }
}

/* As add_diagonal, averaged over i: only sums of rest along its diagonals matter. */
static void add_gaps(struct profile *profile, const struct contribution *c, struct scratch *scratch)
{
    struct transfer *t = c->transfer;
    size_t n = t->grid.n;
    double complex *along = scratch_complex(scratch, n);
    if (scratch->failed) {
        return;
    }
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++) {
            double complex r = c->rest->re[j * n + i] + I * c->rest->im[j * n + i];
            along[(i + n - j) % n] += t->grid.weight[j] * r;
        }
    }
    for (size_t bin = 0; bin < t->model->wanted.gap_bins; bin++) {
        transfer_column(t, &c->functionals->gap[bin], c->s);
        double complex sum = 0;
        for (size_t d = 0; d < n; d++) {
            sum += t->complex_column[d] * along[d];
        }
        profile->gap[bin] += creal(c->factor / t->lambda * sum);
    }
}

void profile_add(struct profile *profile, const struct contribution *c, struct scratch *scratch)
{
    struct transfer *t = c->transfer;
    transfer_column(t, &t->all, c->s);
    add_diagonal(profile->density, c);
    add_points(profile->contact, c, &c->functionals->contact, &c->functionals->contact_shifts);
    if (profile->window) {
        add_points(profile->window, c, &c->functionals->window, &c->functionals->window_shifts);
    }
    enum theory_pair_kind kind = t->model->system.pair.kind;
    if (kind == THEORY_BAXTER || kind == THEORY_STICKY) {
        transfer_column(t, &c->functionals->bond, c->s);
        add_diagonal(profile->bond, c);
    }
    if (t->model->wanted.gap_bins) {
        add_gaps(profile, c, scratch);
    }
}

enum bcd_status profile_finish(struct theory_result *result, const struct profile *profile,
                               const struct model *model, const struct grid *grid,
                               struct scratch *scratch)
{
    const struct theory_wanted *wanted = &model->wanted;
    size_t n = grid->n;
    double sum = 0, energy = 0, bonds = 0;
    for (size_t i = 0; i < n; i++) {
        sum += profile->density[i];
        energy += profile->density[i] * grid->energy[i];
        bonds += profile->bond[i];
    }
    double complex *coefficient = scratch_complex(scratch, grid->half + 1);
    if (scratch->failed) {
        return BCD_NO_MEMORY;
    }
    double scale = model->density * (double)n / sum;
    struct {
        const double *values;
        double *out, scale;
        size_t bins;
    } jobs[] = {
        {profile->density, result->density, scale, wanted->density_bins},
        {profile->contact, result->contact, scale, wanted->contact_bins},
        {profile->window, result->contact_window, scale / wanted->contact_gap,
         result->contact_window ? wanted->contact_bins : 0},
    };
    for (size_t job = 0; job < sizeof jobs / sizeof *jobs; job++) {
        if (jobs[job].bins == 0) {
            continue;
        }
        grid_analyse(grid, jobs[job].values, coefficient);
        grid_bins(grid, coefficient, model->bin_period, jobs[job].out, jobs[job].bins);
        for (size_t bin = 0; bin < jobs[job].bins; bin++) {
            /* Rounding may leave a hair below zero where there is nothing. */
            jobs[job].out[bin] = fmax(jobs[job].out[bin] * jobs[job].scale, 0);
        }
    }
    double width = wanted->gap_last / (double)wanted->gap_bins;
    for (size_t bin = 0; bin < wanted->gap_bins; bin++) {
        result->gap[bin] = fmax(profile->gap[bin] / sum / width, 0);
    }
    enum theory_pair_kind kind = model->system.pair.kind;
    result->bonded_fraction = kind == THEORY_BAXTER || kind == THEORY_STICKY ? bonds / sum : NAN;
    result->energy = energy / sum;
    result->points = n;
    return BCD_OK;
}
