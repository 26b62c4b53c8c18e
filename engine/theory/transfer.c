/* SPDX-License-Identifier: GPL-3.0-or-later
 * transfer.c - leading eigenvectors of the transfer operator; the pressure (transfer.h). */
#include <math.h>
#include <string.h>

#include "lu.h"
#include "transfer.h"

double transfer_wave_number(const struct model *model, size_t n)
{
    return PI * ((double)n + 1) / model->period;
}

void transfer_column(struct transfer *t, const struct measure *measure, double complex s)
{
    struct kernel_args args = {
        .grid = &t->grid, .measure = measure, .diameter = t->model->system.diameter, .s = s};
    kernel_modes(&args, t->mode);
    kernel_column(&t->grid, t->mode, t->complex_column);
}

/* See transfer.h. */
double transfer_fade(const struct grid *grid, double mode)
{
    double x = 2 * mode / (double)grid->n;
    x *= x;
    x *= x;
    x *= x;
    return exp(-36 * x * x);
}

enum kind { PLAIN, FADED, MOMENT };

/* Real circulant times weight at pressure p: matrix[i][j] = g_{i-j} w_j. */
static void build_matrix(struct transfer *t, double p, enum kind kind, double *matrix)
{
    size_t n = t->grid.n;
    struct kernel_args args = {.grid = &t->grid,
                               .measure = &t->all,
                               .diameter = t->model->system.diameter,
                               .s = p,
                               .moment = kind == MOMENT};
    kernel_modes(&args, t->mode);
    for (size_t k = 0; k < n && kind == FADED; k++) {
        t->mode[k] *= transfer_fade(&t->grid, (double)k - (double)t->grid.half);
    }
    kernel_column(&t->grid, t->mode, t->complex_column);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            matrix[i * n + j] = creal(t->complex_column[(i + n - j) % n]) * t->grid.weight[j];
        }
    }
}

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Scales to a largest component of 1; returns what it was, with its sign. */
static double normalise(size_t n, double *v)
{
    double largest = 0;
    for (size_t i = 0; i < n; i++) {
        largest = fabs(v[i]) > fabs(largest) ? v[i] : largest;
    }
    for (size_t i = 0; i < n && largest != 0; i++) {
        v[i] /= largest;
    }
    return largest;
}

static void multiply(size_t n, const double *matrix, const double *v, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = dot(n, matrix + i * n, v);
    }
}

static void multiply_transposed(size_t n, const double *matrix, const double *v, double *out)
{
    memset(out, 0, n * sizeof *out);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            out[j] += v[i] * matrix[i * n + j];
        }
    }
}

static void power_iterations(struct transfer *t, int count)
{
    size_t n = t->grid.n;
    double turn_ns = 1.5 * (double)(n * n);
    for (int turn = 0; turn < count && model_spend(t->model, turn_ns); turn++) {
        multiply(n, t->matrix, t->right, t->work);
        memcpy(t->right, t->work, n * sizeof(double));
        normalise(n, t->right);
        multiply_transposed(n, t->matrix, t->left, t->work);
        memcpy(t->left, t->work, n * sizeof(double));
        normalise(n, t->left);
    }
}

/* Two-sided Rayleigh quotient iteration: cubic. Returns the relative residual. */
static double rayleigh_iterations(struct transfer *t, double *shifted)
{
    size_t n = t->grid.n;
    double residual = INFINITY, turn_ns = (.25 * (double)n + 5) * (double)(n * n);
    for (int turn = 0; turn < 12 && model_spend(t->model, turn_ns); turn++) {
        multiply(n, t->matrix, t->right, t->work);
        t->lambda = dot(n, t->left, t->work) / dot(n, t->left, t->right);
        double now = 0;
        for (size_t i = 0; i < n; i++) {
            double r = fabs(t->work[i] / t->lambda - t->right[i]);
            now = r > now || isnan(r) ? r : now;
        }
        /* Two more rounds than the right vector needs, for the left one. */
        if (isnan(now) || (turn > 2 && now < 1e-13) || (turn > 4 && now >= residual)) {
            return now;
        }
        residual = now;
        memcpy(shifted, t->matrix, n * n * sizeof(double));
        for (size_t i = 0; i < n; i++) {
            shifted[i * n + i] -= t->lambda;
        }
        lu_factor(n, shifted, t->pivot);
        lu_solve(n, shifted, t->pivot, t->right);
        lu_solve_transposed(n, shifted, t->pivot, t->left);
        normalise(n, t->right);
        normalise(n, t->left);
    }
    return residual;
}

static bool positive(size_t n, const double *v)
{
    for (size_t i = 0; i < n; i++) {
        if (!(v[i] > -1e-8)) {
            return false;
        }
    }
    return true;
}

/* Eigenvectors at p and the mean gap. The leading pair is the only positive one. */
static enum bcd_status solve_at(struct transfer *t, double p, double *shifted, double *mean_gap)
{
    size_t n = t->grid.n;
    t->p = p;
    int powers = 40;
    for (int attempt = 0; attempt < 3; attempt++, powers *= 10) {
        if (attempt > 0) {
            for (size_t i = 0; i < n; i++) {
                t->right[i] = 1;
                t->left[i] = t->grid.weight[i];
            }
        }
        build_matrix(t, p, FADED, t->matrix);
        power_iterations(t, powers);
        build_matrix(t, p, PLAIN, t->matrix);
        double residual = rayleigh_iterations(t, shifted);
        /* A last product makes small components as exact, relatively, as the factor w in them. */
        power_iterations(t, 1);
        if (residual < 1e-10 && t->lambda > 0 && positive(n, t->right) && positive(n, t->left)) {
            build_matrix(t, p, MOMENT, shifted);
            multiply(n, shifted, t->right, t->work);
            double scale = dot(n, t->left, t->right);
            *mean_gap = dot(n, t->left, t->work) / (t->lambda * scale);
            for (size_t i = 0; i < n; i++) {
                t->left[i] /= scale;
            }
            if (*mean_gap > 0 && isfinite(*mean_gap)) {
                return BCD_OK;
            }
        }
    }
    return BCD_INVALID;
}

/* ln(mean gap) falls with ln p, like -ln p for a gas of points: secants, kept inside a bracket. */
static enum bcd_status solve_pressure(struct transfer *t, double *shifted, struct bcd_error *error)
{
    double target = log(t->model->mean_gap), x = -target, low = -INFINITY, high = INFINITY;
    double before_x = NAN, before_y = NAN;
    double enough = t->model->any_pressure ? .02 / sqrt((double)t->model->system.particles) : 0;
    for (int turn = 0; turn < 100; turn++) {
        double mean_gap;
        if (watch_ended(t->model->system.watch)) {
            return watch_stopped(t->model->system.watch, error);
        }
        if (solve_at(t, exp(x), shifted, &mean_gap)) {
            return theory_fail(error, BCD_INVALID,
                               "transfer operator: no positive eigenvectors on %zu points per "
                               "period at reduced pressure %g (potential or stickiness too "
                               "strong for them to be told apart?)",
                               t->grid.n, exp(x));
        }
        double y = log(mean_gap) - target;
        double slope = (y - before_y) / (x - before_x);
        slope = slope < -1e-12 && slope > -1e3 ? slope : -1;
        /* Variance from the slope while the points are not too close for it. */
        if (isnan(before_x) || fabs(x - before_x) > 1e-5) {
            t->gap_variance = -slope * mean_gap / exp(x);
        }
        low = y > 0 ? x : low;
        high = y > 0 ? high : x;
        double before_before = before_x;
        before_x = x;
        before_y = y;
        double step = -y / slope;
        bool first = isnan(before_before);
        if (fabs(y) < 3e-13 || fabs(step) < 1e-14 || (!first && fabs(y) < enough)) {
            return BCD_OK;
        }
        step = first && fabs(y) < enough ? 1e-2 : step; /* a second point, for the variance */
        x += fabs(step) < 3 ? step : copysign(3, step);
        if (!(x > low && x < high) && isfinite(low) && isfinite(high)) {
            x = (low + high) / 2;
        }
        if (high - low < 1e-14 || fabs(x) > 600) {
            break;
        }
    }
    return fabs(before_y) < 1e-12
               ? BCD_OK
               : theory_fail(error, BCD_INVALID, "no pressure found for a mean gap of %g",
                             t->model->mean_gap);
}

enum bcd_status transfer_init(struct transfer *t, const struct model *model,
                              struct scratch *scratch, size_t n, struct bcd_error *error)
{
    *t = (struct transfer){.model = model};
    grid_init(&t->grid, model, scratch, n);
    t->right = scratch_doubles(scratch, n);
    t->left = scratch_doubles(scratch, n);
    t->matrix = scratch_doubles(scratch, n * n);
    t->work = scratch_doubles(scratch, n);
    t->sum = scratch_doubles(scratch, 2 * n);
    t->pivot = scratch_bytes(scratch, n * sizeof *t->pivot);
    t->mode = scratch_complex(scratch, n);
    t->complex_column = scratch_complex(scratch, n);
    double *shifted = scratch_doubles(scratch, n * n);
    const double everything[2] = {0, INFINITY};
    if (scratch->failed ||
        measure_init(&t->all, model, scratch, everything, transfer_wave_number(model, n))) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    for (size_t i = 0; i < n; i++) {
        t->right[i] = 1;
        t->left[i] = t->grid.weight[i];
    }
    return solve_pressure(t, shifted, error);
}
