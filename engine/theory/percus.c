/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * percus.c - the second route to the infinite system: an equation for the density alone.
 *
 * Percus (J. Stat. Phys. 15, 505, 1976) for hard rods, [1] Eq. 34 for sticky ones. Derivation, from
 * the grand canonical chain of rods with fugacity z, w = exp(-U/kT), lengths in units of choice:
 *
 *   R(x), L(x)      partition functions of what lies right (left) of an empty place x
 *   phi(x), chi(x)  the same, right (left) of a rod at x:
 *                phi(x) = R(x+s) + gamma z w(x+s) phi(x+s),   chi(x) likewise with x-s, s = sigma
 *   R' = -z w phi,  L' = z w chi,   Q = R L of the whole
 *
 *   rho(x)          = z w chi phi / Q
 *   m(x)            = L(x) R(x+s) / Q   = probability that no centre lies in (x, x+s)
 *                   = 1 - int_x^{x+s} rho
 *   c(x)            = z w(x) chi(x) gamma z w(x+s) phi(x+s) / Q      density of bonds x, x+s
 *   rho(x) - c(x)   = z w(x) chi(x) R(x+s) / Q                       not bonded to the right
 *   rho(x+s) - c(x) = L(x) z w(x+s) phi(x+s) / Q                     not bonded to the left
 *
 * Products of these lines give the law of mass action,
 *
 *   gamma (rho(x) - c)(rho(x+s) - c) = m c,
 *
 * a quadratic equation for c; with d ln L/dx = (rho - c)/m =: v, eliminating phi, chi, R, L from
 * rho = z w chi phi / Q,
 *
 *   ln z - U(x)/kT = ln[(rho - c(x)) (rho - c(x-s)) / (rho m(x))] + int_{x-s}^x v(y) dy.
 *
 * Without stickiness c = 0 and this is Percus' equation; averaged with its mirror image it becomes
 * the symmetric form of [1] Eq. 34, with 1/2 ln{[1-eta(x)][1-eta(x+s)]} and 1 - eta(x+s) = m(x).
 * (rho - c)(rho(x+s) - c)/m = c/gamma is the contact density; the mean of v is the pressure/kT.
 *
 * Solved by Newton's method for ln rho and ln z at fixed mean density, U switched on in steps.
 * Shifts and integrals are exact on the Fourier modes of the grid. */
#include <math.h>
#include <string.h>

#include "lu.h"
#include "tools.h"

static const size_t points[] = {15, 23, 35, 53, 79, 119, 179, 269};

struct percus {
    const struct model *model;
    struct grid grid;
    double *shift, *cover, *behind; /* [n] columns: f(x+s), int_x^{x+s} f, int_{x-s}^x f */
    double *back;                   /* f(x-s) */
    double *log_rho;                /* [n + 1], last: ln z */
    double *rho, *next, *empty, *bond, *bond_back, *rate, *integral; /* [n] */
    double *by_rho, *by_next, *by_empty;                             /* [n] derivatives of bond */
    double *bond_matrix, *rate_matrix, *jacobian, *residual;         /* [n][n], [n+1][n+1], [n+1] */
    size_t *pivot;
    struct scratch scratch;
};

static void apply(const struct percus *p, const double *column, const double *f, double *out)
{
    size_t n = p->grid.n;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t j = 0; j < n; j++) {
            sum += column[(i + n - j) % n] * f[j];
        }
        out[i] = sum;
    }
}

/* Real column of the operator with modes sigma^integral e^{i kappa shift} sinc(...). */
static void operator_column(struct percus *p, double shift, bool integral, double *column)
{
    size_t n = p->grid.n;
    double sigma = p->model->system.diameter;
    double complex *mode = scratch_complex(&p->scratch, n);
    double complex *values = scratch_complex(&p->scratch, n);
    if (p->scratch.failed) {
        return;
    }
    for (size_t k = 0; k < n; k++) {
        double kappa = 2 * PI / p->grid.period * ((double)k - (double)p->grid.half);
        double z = kappa * sigma / 2;
        mode[k] = cexp(I * kappa * shift);
        mode[k] *= integral ? sigma * (fabs(z) < 1e-8 ? 1 : sin(z) / z) : 1;
    }
    kernel_column(&p->grid, mode, values);
    for (size_t d = 0; d < n; d++) {
        column[d] = creal(values[d]);
    }
}

static enum bcd_status percus_init(struct percus *p, size_t n)
{
    struct scratch *scratch = &p->scratch;
    grid_init(&p->grid, p->model, scratch, n);
    double **vectors[] = {&p->shift,     &p->cover,  &p->behind,  &p->back,    &p->rho,
                          &p->next,      &p->empty,  &p->bond,    &p->rate,    &p->integral,
                          &p->bond_back, &p->by_rho, &p->by_next, &p->by_empty};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        *vectors[i] = scratch_doubles(scratch, n);
    }
    p->log_rho = scratch_doubles(scratch, n + 1);
    p->residual = scratch_doubles(scratch, n + 1);
    p->bond_matrix = scratch_doubles(scratch, n * n);
    p->rate_matrix = scratch_doubles(scratch, n * n);
    p->jacobian = scratch_doubles(scratch, (n + 1) * (n + 1));
    p->pivot = scratch_bytes(scratch, (n + 1) * sizeof *p->pivot);
    double sigma = p->model->system.diameter;
    if (!scratch->failed) {
        operator_column(p, sigma, false, p->shift);
        operator_column(p, -sigma, false, p->back);
        operator_column(p, sigma / 2, true, p->cover);
        operator_column(p, -sigma / 2, true, p->behind);
    }
    return scratch->failed ? BCD_NO_MEMORY : BCD_OK;
}

/* The equation at log_rho with `share` of the potential; false outside its domain. */
static bool evaluate(struct percus *p, double share)
{
    size_t n = p->grid.n;
    const struct model *model = p->model;
    double gamma = model->bond, mean = 0;
    for (size_t i = 0; i < n; i++) {
        p->rho[i] = exp(p->log_rho[i]);
        mean += p->rho[i] / (double)n;
    }
    apply(p, p->shift, p->rho, p->next);
    apply(p, p->cover, p->rho, p->empty);
    for (size_t i = 0; i < n; i++) {
        double r = p->rho[i], s = fmax(p->next[i], 0), m = p->empty[i] = 1 - p->empty[i];
        if (!(m > 0) || !isfinite(r)) {
            return false;
        }
        double t = r + s + m / gamma, c = 0, root = 1;
        p->by_rho[i] = p->by_next[i] = p->by_empty[i] = 0;
        if (gamma > 0) {
            root = sqrt(fmax(t * t - 4 * r * s, 0));
            c = 2 * r * s / (t + root);
            p->by_rho[i] = (s - c) / root;
            p->by_next[i] = (r - c) / root;
            p->by_empty[i] = -c / (gamma * root);
        }
        p->bond[i] = c;
        p->rate[i] = (r - c) / m;
    }
    apply(p, p->back, p->bond, p->bond_back);
    apply(p, p->behind, p->rate, p->integral);
    for (size_t i = 0; i < n; i++) {
        double free = p->rho[i] - p->bond[i], free_left = p->rho[i] - p->bond_back[i];
        if (!(free > 0) || !(free_left > 0)) {
            return false;
        }
        p->residual[i] = log(free / p->empty[i]) + log(free_left / p->rho[i]) + p->integral[i] +
                         share * (p->grid.energy[i] - model->lowest) / model->system.temperature -
                         p->log_rho[n];
    }
    p->residual[n] = mean / model->density - 1;
    return true;
}

/* Derivatives of bond and rate by rho, dense. */
static void differentiate_local(struct percus *p)
{
    size_t n = p->grid.n;
    for (size_t i = 0; i < n; i++) {
        double m = p->empty[i], v = p->rate[i];
        for (size_t j = 0; j < n; j++) {
            size_t d = (i + n - j) % n;
            double same = i == j ? 1 : 0, empty = -p->cover[d];
            double bond =
                p->by_rho[i] * same + p->by_next[i] * p->shift[d] + p->by_empty[i] * empty;
            p->bond_matrix[i * n + j] = bond;
            p->rate_matrix[i * n + j] = (same - bond - v * empty) / m;
        }
    }
}

/* Row i of  column * matrix. */
static void circulant_row(const struct percus *p, const double *column, const double *matrix,
                          size_t i, double *row)
{
    size_t n = p->grid.n;
    memset(row, 0, n * sizeof *row);
    for (size_t k = 0; k < n; k++) {
        double factor = column[(i + n - k) % n];
        for (size_t j = 0; j < n; j++) {
            row[j] += factor * matrix[k * n + j];
        }
    }
}

static void differentiate(struct percus *p)
{
    size_t n = p->grid.n;
    double *left = p->by_rho, *integral = p->by_next; /* rows; their old contents are used up */
    differentiate_local(p);
    for (size_t i = 0; i < n; i++) {
        double *row = p->jacobian + i * (n + 1);
        double free = p->rho[i] - p->bond[i], free_left = p->rho[i] - p->bond_back[i];
        circulant_row(p, p->back, p->bond_matrix, i, left);
        circulant_row(p, p->behind, p->rate_matrix, i, integral);
        for (size_t j = 0; j < n; j++) {
            double same = i == j ? 1 : 0;
            double value = (same - p->bond_matrix[i * n + j]) / free +
                           p->cover[(i + n - j) % n] / p->empty[i] + (same - left[j]) / free_left -
                           same / p->rho[i] + integral[j];
            row[j] = value * p->rho[j]; /* unknown: ln rho */
        }
        row[n] = -1;
        p->jacobian[n * (n + 1) + i] = p->rho[i] / ((double)n * p->model->density);
    }
    p->jacobian[n * (n + 1) + n] = 0;
}

static double largest(const double *v, size_t count)
{
    double value = 0;
    for (size_t i = 0; i < count; i++) {
        value = fabs(v[i]) > value || isnan(v[i]) ? fabs(v[i]) : value;
    }
    return value;
}

/* Newton's method; false when it does not converge from here. */
static bool converge(struct percus *p, double share)
{
    size_t n = p->grid.n;
    int settled = 0;
    for (int turn = 0; turn < 30; turn++) {
        if (!evaluate(p, share)) {
            return false;
        }
        differentiate(p);
        lu_factor(n + 1, p->jacobian, p->pivot);
        lu_solve(n + 1, p->jacobian, p->pivot, p->residual);
        double step = largest(p->residual, n + 1);
        if (!(step < 20)) {
            return false;
        }
        double part = fmin(1, 1 / step);
        for (size_t i = 0; i <= n; i++) {
            p->log_rho[i] -= part * p->residual[i];
        }
        /* Small densities are known to the rounding of the large ones: ask for no more. */
        settled = step < 1e-7 ? settled + 1 : 0;
        if (step < 1e-13 || settled == 4) {
            return evaluate(p, share);
        }
    }
    return false;
}

static enum bcd_status switch_on(struct percus *p, struct bcd_error *error)
{
    size_t n = p->grid.n;
    double share = 0, stride = p->model->system.energy ? .25 : 1;
    double *good = scratch_doubles(&p->scratch, n + 1);
    if (p->scratch.failed) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    for (size_t i = 0; i < n; i++) {
        p->log_rho[i] = log(p->model->density);
    }
    if (!evaluate(p, 0)) {
        return theory_fail(error, BCD_INTERNAL, "Percus: no even density");
    }
    p->log_rho[n] = p->residual[0]; /* exact without potential */
    memcpy(good, p->log_rho, (n + 1) * sizeof *good);
    while (share < 1) {
        double next = fmin(share + stride, 1);
        if (converge(p, next)) {
            share = next;
            stride *= 1.7;
            memcpy(good, p->log_rho, (n + 1) * sizeof *good);
            continue;
        }
        memcpy(p->log_rho, good, (n + 1) * sizeof *good);
        stride /= 3;
        if (stride < 1e-3) {
            return theory_fail(error, BCD_INVALID,
                               "Percus: no convergence beyond %.3g of the potential on %zu points "
                               "per period",
                               share, n);
        }
    }
    return BCD_OK;
}

/* Bin means of density and contact density, averages. */
static void harvest(struct theory_result *result, struct percus *p, double complex *coefficient)
{
    const struct model *model = p->model;
    const struct theory_wanted *wanted = &model->wanted;
    size_t n = p->grid.n;
    double sum = 0, energy = 0, bonds = 0, pressure = 0;
    for (size_t i = 0; i < n; i++) {
        sum += p->rho[i];
        energy += p->rho[i] * p->grid.energy[i];
        bonds += p->bond[i];
        pressure += p->rate[i] / (double)n;
    }
    grid_analyse(&p->grid, p->rho, coefficient);
    grid_bins(&p->grid, coefficient, model->bin_period, result->density, wanted->density_bins);
    for (size_t i = 0; i < n; i++) {
        p->residual[i] = p->rate[i] * (p->next[i] - p->bond[i]);
    }
    grid_analyse(&p->grid, p->residual, coefficient);
    grid_bins(&p->grid, coefficient, model->bin_period, result->contact, wanted->contact_bins);
    result->energy = energy / sum;
    result->bonded_fraction = model->bond > 0 ? bonds / sum : NAN;
    result->pressure = pressure * model->system.temperature;
    result->points = n;
    result->route = "percus";
}

static enum bcd_status compute(struct theory_result **result, const struct model *model,
                               size_t level, struct bcd_error *error)
{
    struct percus p = {.model = model};
    struct theory_result *fresh = NULL;
    enum bcd_status status = percus_init(&p, points[level]);
    double complex *coefficient = scratch_complex(&p.scratch, points[level]);
    if (status || p.scratch.failed || result_create(&fresh, &model->wanted)) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
        goto cleanup;
    }
    status = switch_on(&p, error);
    if (status) {
        goto cleanup;
    }
    harvest(fresh, &p, coefficient);
    *result = fresh;
    fresh = NULL;
cleanup:
    theory_result_free(fresh);
    scratch_free(&p.scratch);
    return status;
}

enum bcd_status theory_percus(struct theory_result **result, const struct theory_system *system,
                              const struct theory_wanted *wanted, struct bcd_error *error)
{
    struct model model;
    enum bcd_status status = model_init(&model, system, wanted, error);
    if (status) {
        return status;
    }
    if (system->pair.kind != THEORY_HARD && system->pair.kind != THEORY_BAXTER) {
        return theory_fail(error, BCD_INVALID,
                           "Percus' functional is for hard rods and for Baxter's sticky limit");
    }
    if (wanted->contact_gap > 0 || wanted->pair_bins || wanted->gap_bins) {
        return theory_fail(error, BCD_INVALID,
                           "Percus' functional gives densities at contact only");
    }
    struct refinement how = {
        .compute = compute, .levels = sizeof points / sizeof *points, .what = "Percus' functional"};
    return refine(result, &model, wanted, &how, error);
}
