/* SPDX-License-Identifier: GPL-3.0-or-later
 * grid.c - equidistant points of one period, Fourier modes, translation-invariant kernels.
 *
 * An odd number of points: the modes -half .. half then come in conjugate pairs, and shifts of a
 * real function stay real. Transforms are O(n^2) sums over a table of roots of unity; n is a few
 * hundred at most and no transform is in an inner loop. */
#include <math.h>

#include "tools.h"

void grid_init(struct grid *grid, const struct model *model, struct scratch *scratch, size_t n)
{
    *grid = (struct grid){
        .n = n, .half = n / 2, .period = model->period, .watch = model->system.watch};
    grid->x = scratch_doubles(scratch, n);
    grid->weight = scratch_doubles(scratch, n);
    grid->energy = scratch_doubles(scratch, n);
    grid->root = scratch_complex(scratch, n);
    if (scratch->failed) {
        return;
    }
    for (size_t i = 0; i < n; i++) {
        grid->x[i] = model->period * (double)i / (double)n;
        grid->energy[i] = model_energy(model, grid->x[i]);
        grid->weight[i] = model_weight(model, grid->x[i]);
        grid->root[i] = cexp(2 * PI * I * (double)i / (double)n);
    }
}

void grid_analyse(const struct grid *grid, const double *values, double complex *coefficient)
{
    size_t n = grid->n;
    for (size_t k = 0; k <= grid->half; k++) {
        double complex sum = 0;
        for (size_t i = 0, turn = 0; i < n; i++) {
            sum += values[i] * conj(grid->root[turn]);
            turn += k;
            turn -= turn >= n ? n : 0;
        }
        coefficient[k] = sum / (double)n;
    }
}

void grid_bins(const struct grid *grid, const double complex *coefficient, double length,
               double *mean, size_t bins)
{
    for (size_t bin = 0; bin < bins && watch_spend(grid->watch, 40 * (double)grid->half); bin++) {
        double width = length / (double)bins, middle = ((double)bin + .5) * width;
        double sum = creal(coefficient[0]);
        for (size_t k = 1; k <= grid->half; k++) {
            double kappa = 2 * PI * (double)k / grid->period, z = kappa * width / 2;
            sum += 2 * creal(coefficient[k] * cexp(I * kappa * middle)) * sin(z) / z;
        }
        mean[bin] = sum;
    }
}

/* int_from^to g^moment e^{-z g} dg, to = INFINITY for Re z > 0. */
static double complex uniform_part(const struct measure *measure, double complex z, int moment)
{
    double a = measure->from, b = measure->to;
    if (!(b > a)) {
        return 0;
    }
    double complex lower = cexp(-z * a);
    if (moment == 0) {
        if (isinf(b)) {
            return lower / z;
        }
        /* Small windows: avoid the difference of two nearly equal exponentials. */
        double complex h = z * (b - a) / 2;
        double complex ratio = cabs(h) < 1e-4 ? 1 + h * h / 6 : csinh(h) / h;
        return (b - a) * cexp(-z * (a + b) / 2) * ratio;
    }
    double complex value = lower * (a / z + 1 / (z * z));
    return isinf(b) ? value : value - cexp(-z * b) * (b / z + 1 / (z * z));
}

void kernel_modes(const struct kernel_args *args, double complex *mode)
{
    const struct grid *grid = args->grid;
    const struct measure *measure = args->measure;
    double kappa = 2 * PI / grid->period, half = (double)grid->half;
    watch_spend(grid->watch, 150 * (double)grid->n);
    for (size_t k = 0; k < grid->n; k++) {
        double complex z = args->s - I * kappa * ((double)k - half);
        mode[k] = uniform_part(measure, z, args->moment);
        mode[k] += args->moment == 0 ? measure->delta : 0;
    }
    double point_ns = 100 + 3 * (double)grid->n;
    for (size_t i = 0; i < measure->count && watch_spend(grid->watch, point_ns); i++) {
        double g = measure->gap[i], weight = measure->weight[i];
        double complex value = cexp(-(args->s + I * kappa * half) * g) * weight;
        double complex step = cexp(I * kappa * g);
        value *= args->moment ? g : 1;
        for (size_t k = 0; k < grid->n; k++) {
            mode[k] += value;
            value *= step;
        }
    }
    for (size_t k = 0; k < grid->n; k++) {
        mode[k] *= cexp(I * kappa * ((double)k - half) * args->diameter);
    }
}

void kernel_column(const struct grid *grid, const double complex *mode, double complex *column)
{
    size_t n = grid->n;
    watch_spend(grid->watch, 2 * (double)(n * n));
    for (size_t d = 0; d < n; d++) {
        double complex sum = 0;
        size_t turn = (n - grid->half % n) * d % n; /* phase of mode -half */
        for (size_t k = 0; k < n; k++) {
            sum += mode[k] * grid->root[turn];
            turn += d;
            turn -= turn >= n ? n : 0;
        }
        column[d] = sum / (double)n;
    }
}
