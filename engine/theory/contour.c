/* SPDX-License-Identifier: GPL-3.0-or-later
 * contour.c - the canonical ring as a contour integral over powers of the transfer operator.
 *
 * Summed over all lengths n P of the ring with weight exp(-s n P), N rods on a ring give the trace
 * of K_s^N. The term n = L/P is picked by integrating s = p + i theta/P over theta in (-pi, pi]:
 *
 *   rho(x) ~ int dtheta e^{s ell} (K_s^N)(x, x)
 *
 * and likewise for averages of one gap (transfer.h) and for pairs (pairs.h). With p the pressure of
 * about that of the
 * infinite system the line runs near the saddle point, nothing cancels, and the trapezoidal
 * rule in theta is exact but for the weight of rings of length n P with n = L/P modulo the number
 * of thetas. That weight is watched half way between: it is the alternating sum of the same terms.
 *
 * The grid's modes end the line at |Im s| = pi n/P. What lies beyond makes the steps and kinks of
 * the weight at g = 0 and at the end of f's bump, and is far from L/P when it is faded out
 * smoothly. Only in Baxter's limit does it not fade by itself, unless the rods are many: then the
 * refinement does not converge and the answer is refused here. */
#include <math.h>

#include "pairs.h"

static const size_t points[] = {15, 23, 35, 45, 57, 71, 89, 111, 139, 175, 219, 271};

struct contour {
    const struct model *model;
    struct transfer transfer;
    struct functionals functionals;
    struct profile profile;
    struct pairs pairs;
    struct matrix step, power, other; /* K_s / lambda; its powers */
    size_t thetas;
    double trace, alternating;
    double operations; /* spent, in multiplications of real numbers */
    struct scratch scratch;
};

static void swap(struct matrix *a, struct matrix *b)
{
    struct matrix keep = *a;
    *a = *b;
    *b = keep;
}

/* K_s / lambda, faded out at the edge of the grid (transfer.h). The fading depends on the wave
 * number alone, so that theta and theta + 2 pi stay the same. */
static void build_step(struct contour *c, double complex s)
{
    struct transfer *t = &c->transfer;
    size_t n = t->grid.n;
    c->operations += 20 * (double)(n * n);
    model_spend(c->model, 2 * (double)(n * n));
    struct kernel_args args = {
        .grid = &t->grid, .measure = &t->all, .diameter = c->model->system.diameter, .s = s};
    kernel_modes(&args, t->mode);
    for (size_t k = 0; k < n; k++) {
        double wave = (double)k - (double)t->grid.half - cimag(s) * c->model->period / (2 * PI);
        t->mode[k] *= transfer_fade(&t->grid, wave);
    }
    kernel_column(&t->grid, t->mode, t->complex_column);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            double complex value =
                t->complex_column[(i + n - j) % n] * (t->grid.weight[j] / t->lambda);
            c->step.re[i * n + j] = creal(value);
            c->step.im[i * n + j] = cimag(value);
        }
    }
}

static void multiply(struct contour *c, const struct matrix *by)
{
    const double product_ns = 1;
    double n = (double)c->step.n;
    model_spend(c->model, product_ns * n * n * n);
    matrix_multiply(&c->other, &c->power, by);
    swap(&c->other, &c->power);
    c->operations += 4 * n * n * n;
}

/* power = step^exponent; false when all of it, and of higher powers, is below rounding. */
static bool raise(struct contour *c, int64_t exponent)
{
    size_t n = c->step.n;
    for (size_t i = 0; i < n * n; i++) {
        c->power.re[i] = i % (n + 1) == 0;
        c->power.im[i] = 0;
    }
    if (exponent == 0) {
        return true;
    }
    int bit = 62;
    while (!(exponent >> bit & 1)) {
        bit--;
    }
    int64_t done = 0;
    for (; bit >= 0; bit--) {
        if (done > 0) {
            multiply(c, &c->power);
            done *= 2;
        }
        if (exponent >> bit & 1) {
            multiply(c, &c->step);
            done++;
        }
        /* |power^m| <= |power|^m: enough of them make it vanish. */
        if (log(matrix_norm(&c->power)) * floor((double)exponent / (double)done) < -60) {
            return false;
        }
    }
    return true;
}

static double trace_of(const struct contour *c)
{
    double trace = 0;
    for (size_t i = 0; i < c->transfer.grid.n; i++) {
        trace += c->profile.density[i];
    }
    return trace;
}

static double theta_at(const struct contour *c, size_t index)
{
    return 2 * PI * (double)index / (double)c->thetas;
}

static bool is_dead(struct contour *c, size_t index)
{
    build_step(c, c->transfer.p + I * theta_at(c, index) / c->model->period);
    return !raise(c, c->model->system.particles - 1);
}

/* Adds theta number `index` of c->thetas; false when there is nothing to add. */
static bool add_theta(struct contour *c, size_t index)
{
    const struct model *model = c->model;
    struct transfer *t = &c->transfer;
    double theta = theta_at(c, index);
    bool own_conjugate = index == 0 || 2 * index == c->thetas;
    struct contribution all = {.transfer = t,
                               .functionals = &c->functionals,
                               .rest = &c->power,
                               .s = t->p + I * theta / model->period};
    all.factor = cexp(I * theta * model->free_length / model->period) * (own_conjugate ? 1 : 2);
    build_step(c, all.s);
    size_t terms = c->pairs.terms > 1 ? c->pairs.terms : 1;
    bool alive = raise(c, model->system.particles - (int64_t)terms);
    for (size_t j = terms; alive && j >= 1; j--) {
        if (j < terms) {
            multiply(c, &c->step);
        }
        if (c->pairs.terms) {
            pairs_add(&c->pairs, j, &all);
            all.rest = &c->power;
        }
    }
    if (alive) {
        double before = trace_of(c);
        profile_add(&c->profile, &all, &c->scratch);
        double term = trace_of(c) - before;
        c->alternating += index % 2 ? -term : term;
    }
    return alive;
}

/* All thetas from 0 to pi. Of many thetas most have died out; the leading eigenvalue changes
 * smoothly with theta, however many rods there are, so that between two dead ones less than pi/128
 * apart nothing is alive. */
static bool sum_thetas(struct contour *c)
{
    enum { LIMIT = 20 }; /* units of 1e9 multiplications: some ten seconds */
    size_t stride = 1 + c->thetas / 256, half = c->thetas / 2;
    for (size_t index = 0; index <= half; index++) {
        if (c->operations > LIMIT * 1e9 || watch_ended(c->model->system.watch)) {
            return false;
        }
        bool alive = add_theta(c, index);
        while (!alive && stride > 1 && index + stride <= half && is_dead(c, index + stride)) {
            index += stride;
        }
    }
    return true;
}

static enum bcd_status prepare(struct contour *c, size_t n, struct bcd_error *error)
{
    const struct model *model = c->model;
    enum bcd_status status = transfer_init(&c->transfer, model, &c->scratch, n, error);
    if (status) {
        return status;
    }
    matrix_init(&c->step, &c->scratch, n);
    matrix_init(&c->power, &c->scratch, n);
    matrix_init(&c->other, &c->scratch, n);
    status = functionals_init(&c->functionals, model, &c->transfer.grid, &c->scratch);
    return status ? theory_fail(error, status, "out of memory") : BCD_OK;
}

/* Half of them reach eight standard deviations of the length of the chain to either side. */
static double count_thetas(const struct contour *c)
{
    double deviation =
        sqrt((double)c->model->system.particles * c->transfer.gap_variance) / c->model->period;
    return 2 * ceil(8 * deviation + 3);
}

static enum bcd_status integrate(struct contour *c, struct bcd_error *error)
{
    double n = (double)c->transfer.grid.n, thetas = count_thetas(c);
    for (int doubling = 0;; doubling++, thetas *= 2) {
        if (doubling > 2) {
            return theory_fail(error, BCD_INVALID,
                               "canonical ring: %.0f points per period do not resolve the gaps of "
                               "so few rods",
                               n);
        }
        c->thetas = (size_t)thetas;
        c->alternating = 0;
        if (profile_init(&c->profile, c->model, &c->scratch, c->transfer.grid.n)) {
            return BCD_NO_MEMORY;
        }
        enum bcd_status status = pairs_init(&c->pairs, &c->transfer, &c->scratch, error);
        if (status) {
            return status; /* more pairs than can be told in time are no lack of memory */
        }
        if (!sum_thetas(c)) {
            return theory_fail(error, BCD_INTERNAL,
                               "canonical ring: too long a computation (%.0f points per period, "
                               "%.0f values of theta)",
                               n, thetas);
        }
        c->trace = trace_of(c);
        if (!(c->trace > 0)) {
            return theory_fail(error, BCD_INVALID, "canonical ring: the contour integral cancels");
        }
        /* The weight falls faster and faster with the distance in n: at twice this distance, where
         * it would do harm, it is less than the square. */
        if (fabs(c->alternating) < 1e-7 * c->trace) {
            return BCD_OK;
        }
    }
}

static enum bcd_status compute(struct theory_result **result, const struct model *model,
                               size_t level, struct bcd_error *error)
{
    struct contour c = {.model = model, .scratch = {.watch = model->system.watch}};
    struct theory_result *fresh = NULL;
    enum bcd_status status = prepare(&c, points[level], error);
    status = status ? status : integrate(&c, error);
    if (!status && result_create(&fresh, &model->wanted)) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    if (status) {
        goto cleanup;
    }
    status = profile_finish(fresh, &c.profile, model, &c.transfer.grid, &c.scratch);
    status = status ? status : pairs_finish(fresh, &c.pairs, c.trace, &c.scratch, error);
    if (!status && c.scratch.failed) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    if (status) {
        goto cleanup;
    }
    fresh->route = "contour";
    *result = fresh;
    fresh = NULL;
cleanup:
    theory_result_free(fresh);
    scratch_free(&c.scratch);
    return status;
}

enum bcd_status theory_contour(struct theory_result **result, const struct theory_system *system,
                               const struct theory_wanted *wanted, struct bcd_error *error)
{
    struct model model;
    enum bcd_status status = model_init(&model, system, wanted, error);
    if (status) {
        return status;
    }
    model.any_pressure = true;
    if (system->particles < 2) {
        return theory_fail(error, BCD_INVALID, "canonical ring: the contour needs two rods");
    }
    struct refinement how = {.compute = compute,
                             .levels = sizeof points / sizeof *points,
                             .what = "canonical ring, contour"};
    return refine(result, &model, wanted, &how, error);
}
