/* SPDX-License-Identifier: GPL-3.0-or-later
 * sampler.c - see sampler.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "backward.h"
#include "chain.h"
#include "ramp.h"
#include "sampler.h"
#include "transfer.h"
#include "walls_draw.h"

enum { POINTS = RAMP_POINTS, BUDGET = 200000000 };
#define NOWHERE 1e-12 /* of the highest density: places without rods */

/* A periodic function: values at POINTS + 4 places, from one before 0 on. */
struct table {
    double value[POINTS + 4];
};

struct theory_sampler {
    struct model model;
    double p, lambda, periods, nowhere, bound; /* acceptance factors are at most bound */
    struct table phi;                          /* right of a rod */
    struct table left;                         /* h*: left of an empty place */
    struct table open_right;                   /* probability that a gap to the right is no bond */
    struct table open_left;
    struct table chi;
    struct table next;                      /* w phi: where bonds of finite range lead */
    struct table next_left;                 /* w chi */
    struct table next_most, next_left_most; /* bounds of these over the reach, right and left */
    struct ramp density;
    struct ramp decay; /* -ln h + p x */
    bool by_recursion; /* backward is used instead of all above */
    struct backward backward;
    struct walls_draw walls; /* or this, between walls */
};

/* ------------------------------------------------------------------ tables */

static double table_at(const struct theory_sampler *s, const struct table *table, double x)
{
    double place = x / s->model.period;
    place = (place - floor(place)) * POINTS;
    size_t k = (size_t)place;
    double t = place - (double)k;
    const double *v = table->value + k; /* places k - 1 .. k + 2 */
    return -t * (t - 1) * (t - 2) / 6 * v[0] + (t + 1) * (t - 1) * (t - 2) / 2 * v[1] -
           (t + 1) * t * (t - 2) / 2 * v[2] + (t + 1) * t * (t - 1) / 6 * v[3];
}

static void wrap(struct table *table)
{
    double *v = table->value;
    v[0] = v[POINTS];
    v[POINTS + 1] = v[1];
    v[POINTS + 2] = v[2];
    v[POINTS + 3] = v[3];
}

/* sum_k Re(c_k factor_k e^{i kappa (x + shift)}), k = 0 .. half, at the table's places; c_0 once
 * and the others twice. factor = 1/(p -+ i kappa) with decay = -+1, 1 with decay = 0. */
struct series {
    const struct grid *grid;
    const double complex *coefficient;
    double p, shift;
    int decay;
};

static void series_table(const struct series *series, struct table *table)
{
    double kappa = 2 * PI / series->grid->period;
    double place_ns = 50 + 12 * (double)series->grid->half;
    for (size_t i = 0; i < POINTS && watch_spend(series->grid->watch, place_ns); i++) {
        double x = series->grid->period * (double)i / POINTS + series->shift, sum = 0;
        double complex step = cexp(I * kappa * x), wave = 1;
        for (size_t k = 0; k <= series->grid->half; k++) {
            double complex term = series->coefficient[k] * wave * (k ? 2 : 1);
            sum +=
                creal(series->decay ? term / (series->p + I * (series->decay * kappa * (double)k))
                                    : term);
            wave *= step;
        }
        table->value[i + 1] = sum;
    }
    wrap(table);
}

/* Positive functions that span more than the digits of a double are known only where they are not
 * small; elsewhere they are kept from vanishing. Returns the value below which that was so. */
static double lift(struct table *table)
{
    double largest = 0;
    for (size_t i = 0; i < POINTS + 4; i++) {
        largest = fmax(largest, table->value[i]);
    }
    for (size_t i = 0; i < POINTS + 4; i++) {
        table->value[i] = fmax(table->value[i], 1e-15 * largest);
    }
    return 1e-9 * largest;
}

/* most(x) = bound of table over [x, x + reach] (sign 1) or [x - reach, x] (sign -1). */
static void window_bound(const struct theory_sampler *s, const struct table *table, int sign,
                         struct table *most)
{
    long cells = (long)(s->model.reach / s->model.period * POINTS) + 3;
    cells = cells < POINTS ? cells : POINTS;
    for (long i = 0; i < POINTS && model_spend(&s->model, 2 * (double)cells); i++) {
        double largest = 0;
        for (long d = -2; d <= cells; d++) {
            long at = ((i + sign * d) % POINTS + POINTS) % POINTS;
            largest = fmax(largest, table->value[at + 1]);
        }
        most->value[i + 1] = largest * 1.001; /* what interpolation may add between places */
    }
    wrap(most);
}

/* ------------------------------------------------------------------- setup */

/* Lifts the tables; false when one of them is unknown at a place where rods may be. */
static bool known_where_rods_are(struct theory_sampler *s)
{
    struct table *tables[] = {&s->phi,       &s->chi,       &s->left,
                              &s->next_most, &s->open_left, &s->open_right};
    double least[6], densest = 0;
    for (size_t k = 0; k < 6; k++) {
        least[k] = lift(tables[k]);
    }
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 1; i <= POINTS; i++) {
            double w = model_weight(&s->model, s->model.period * (double)(i - 1) / POINTS);
            double density = w * s->phi.value[i] * s->chi.value[i];
            densest = pass == 0 ? fmax(densest, density) : densest;
            if (pass == 0 || density < NOWHERE * densest) {
                continue;
            }
            /* phi, chi: of a rod here; the open gaps beside it */
            if (s->phi.value[i] < least[0] || s->chi.value[i] < least[1] ||
                s->open_left.value[i] < 1e-6 * least[4] ||
                s->open_right.value[i] < 1e-6 * least[5]) {
                return false;
            }
        }
    }
    s->nowhere = NOWHERE * densest;
    return densest > 0 && isfinite(densest);
}

/* Tables of what follows from the eigenvectors. */
static bool fill_functions(struct theory_sampler *s, const struct transfer *t,
                           double complex *coefficient, double *values)
{
    size_t n = t->grid.n;
    double sigma = s->model.system.diameter;
    struct series series = {.grid = &t->grid, .coefficient = coefficient, .p = t->p};
    grid_analyse(&t->grid, t->right, coefficient);
    series_table(&series, &s->phi);
    for (size_t i = 0; i < n; i++) {
        values[i] = t->grid.weight[i] * t->right[i];
    }
    grid_analyse(&t->grid, values, coefficient);
    series.decay = -1;
    series_table(&series, &s->next_most); /* for now h(x) = int_x^inf e^{-p (x'-x)} w phi */
    series.shift = sigma;
    series_table(&series, &s->open_right);
    grid_analyse(&t->grid, t->left, coefficient); /* w chi */
    series.decay = 1;
    series.shift = 0;
    series_table(&series, &s->left);
    series.shift = -sigma;
    series_table(&series, &s->open_left);
    /* lambda chi(x) = int f(g) e^{-p g} (w chi)(x - sigma - g) dg: the grid's column, reversed. */
    struct kernel_args args = {.grid = &t->grid, .measure = &t->all, .diameter = sigma, .s = t->p};
    kernel_modes(&args, t->mode);
    for (size_t k = 0; k <= t->grid.half; k++) {
        coefficient[k] *= conj(t->mode[t->grid.half + k]) / t->lambda;
    }
    series.decay = 0;
    series.shift = 0;
    series_table(&series, &s->chi);
    return known_where_rods_are(s);
}

/* Ramps, probabilities of open gaps, bounds. */
static void fill_ramps(struct theory_sampler *s, const struct transfer *t)
{
    double width = s->model.period / POINTS, area = 0, before = 0, hard = 0;
    const struct table *h = &s->next_most;
    bool sticky = s->model.bond > 0 || s->model.reach > 0;
    for (size_t i = 0; i <= POINTS; i++) {
        size_t at = i + 1;
        double w = model_weight(&s->model, width * (double)(i % POINTS));
        s->next.value[at] = w * s->phi.value[at];
        s->next_left.value[at] = w * s->chi.value[at];
        s->decay.value[i] = t->p * width * (double)i - log(h->value[at] / h->value[1]);
        s->decay.slope[i] = s->next.value[at] / h->value[at];
        s->density.slope[i] = w * s->phi.value[at] * s->chi.value[at];
        area += i ? (before + s->density.slope[i]) * width / 2 : 0;
        before = s->density.slope[i];
        s->density.value[i] = area;
        double right = s->open_right.value[at] / (t->lambda * s->phi.value[at]);
        double left = s->open_left.value[at] / (t->lambda * s->chi.value[at]);
        s->open_right.value[at] = sticky ? fmin(right, 1) : 1;
        s->open_left.value[at] = sticky ? fmin(left, 1) : 1;
        if (s->density.slope[i] >= s->nowhere) {
            hard = fmax(hard, 1 / (s->left.value[at] * s->phi.value[at]));
        }
    }
    /* End corrections of the trapezoidal rule: density values to fourth order, not only at 0, P. */
    for (size_t i = 0; i <= POINTS; i++) {
        double ahead = s->density.slope[(i + 1) % POINTS],
               behind = s->density.slope[(i + POINTS - 1) % POINTS];
        double ahead_0 = s->density.slope[1], behind_0 = s->density.slope[POINTS - 1];
        s->density.value[i] -= width / 24 * ((ahead - behind) - (ahead_0 - behind_0));
    }
    s->density.rise = s->density.value[POINTS];
    s->decay.rise = t->p * s->model.period;
    wrap(&s->next);
    wrap(&s->next_left);
    wrap(&s->open_right);
    wrap(&s->open_left);
    double least = s->model.free_length - ((double)s->model.system.particles - 1) * s->model.reach;
    s->bound = hard * 1.0001 * (1 + model_bump(&s->model, fmax(least, 0)));
    window_bound(s, &s->next, 1, &s->next_most);
    window_bound(s, &s->next_left, -1, &s->next_left_most);
}

/* Whether the eigenvectors' highest modes have died out. */
static bool resolved(const struct transfer *t, double complex *coefficient)
{
    const double *vectors[] = {t->right, t->left};
    for (int v = 0; v < 2; v++) {
        grid_analyse(&t->grid, vectors[v], coefficient);
        double largest = 0, tail = 0;
        for (size_t k = 0; k <= t->grid.half; k++) {
            double size = cabs(coefficient[k]);
            largest = fmax(largest, size);
            tail = 5 * k > 4 * t->grid.half ? fmax(tail, size) : 0;
        }
        if (!(tail < 1e-10 * largest)) {
            return false;
        }
    }
    return true;
}

static enum bcd_status fill(struct theory_sampler *s, struct bcd_error *error)
{
    static const size_t points[] = {35, 53, 79, 119, 179, 269, 405};
    for (size_t level = 0; level < sizeof points / sizeof *points; level++) {
        struct scratch scratch = {.watch = s->model.system.watch};
        struct transfer t;
        enum bcd_status status = transfer_init(&t, &s->model, &scratch, points[level], error);
        double complex *coefficient = scratch_complex(&scratch, points[level]);
        double *values = scratch_doubles(&scratch, points[level]);
        if (status == BCD_NO_MEMORY || scratch.failed) {
            scratch_free(&scratch);
            return theory_fail(error, BCD_NO_MEMORY, "out of memory");
        }
        bool good =
            !status && resolved(&t, coefficient) && fill_functions(s, &t, coefficient, values);
        if (good) {
            s->p = t.p;
            s->lambda = t.lambda;
            fill_ramps(s, &t);
        }
        scratch_free(&scratch);
        if (watch_ended(s->model.system.watch)) {
            return watch_stopped(s->model.system.watch, error);
        }
        if (good) {
            return BCD_OK;
        }
    }
    return theory_fail(error, BCD_INVALID,
                       "equilibrium draw: the transfer operator is not resolved (the system is too "
                       "dense, or its potential too strong)");
}

/* -------------------------------------------------------------------- draw */

struct draw {
    const struct theory_sampler *s;
    const struct theory_uniforms *uniforms;
    double *y;
    int64_t placed; /* rods placed so far in all attempts */
    int64_t told;   /* those that the watch knows of */
    struct bcd_watch *watch;
};

/* False when the draw is to end, with any configuration. */
static bool go_on(struct draw *d)
{
    int64_t news = d->placed - d->told;
    d->told = d->placed;
    return watch_spend(d->watch, THEORY_PLACED_NS * (double)news);
}

static double uniform(struct draw *d)
{
    return d->uniforms->next(d->uniforms->ctx);
}

/* A gap from the bump, of a bond from x on to the right (sign 1) or left (-1). */
static double bond_gap(struct draw *d, double x, int sign)
{
    const struct theory_sampler *s = d->s;
    const struct theory_pair *pair = &s->model.system.pair;
    if (s->model.reach == 0) {
        return 0;
    }
    const struct table *next = sign > 0 ? &s->next : &s->next_left;
    double contact = x + sign * s->model.system.diameter;
    double most = table_at(s, sign > 0 ? &s->next_most : &s->next_left_most, contact);
    for (;;) {
        double gap = pair->range * (1 - pow(uniform(d), 1 / (pair->exponent + 1)));
        double value = exp(-s->p * gap) * table_at(s, next, contact + sign * gap);
        d->placed++;
        bool enough = d->placed > BUDGET || (d->placed % 16384 == 0 && !go_on(d));
        if (uniform(d) * most < value || enough) {
            return gap;
        }
    }
}

/* The next gap to the right of a rod at x. */
static double next_gap(struct draw *d, double x)
{
    const struct theory_sampler *s = d->s;
    if (s->model.bond + s->model.reach > 0 && uniform(d) > table_at(s, &s->open_right, x)) {
        return bond_gap(d, x, 1);
    }
    double from = x + s->model.system.diameter;
    from -= floor(from / s->model.period) * s->model.period;
    double target = ramp_at(&s->decay, s->model.period, from) - log(uniform(d));
    return fmax(ramp_inverse(&s->decay, s->model.period, target) - from, 0);
}

/* Chain to the left of rod 0: bonds only. Returns their number; their y, relative to rod 0 and less
 * ell, go to the end of the array. */
static int64_t place_left(struct draw *d, double *x)
{
    const struct theory_sampler *s = d->s;
    int64_t n = s->model.system.particles, bonds = 0;
    double y = 0;
    bool sticky = s->model.bond + s->model.reach > 0;
    while (sticky && bonds < n - 1 && uniform(d) > table_at(s, &s->open_left, *x)) {
        double gap = bond_gap(d, *x, -1);
        *x -= s->model.system.diameter + gap;
        y -= gap;
        bonds++;
        d->y[n - bonds] = y;
        d->placed++;
    }
    return bonds;
}

/* One attempt: y relative to rod 0. Was the ring accepted? *first = place of rod 0. */
static bool attempt(struct draw *d, double *first)
{
    const struct theory_sampler *s = d->s;
    int64_t n = s->model.system.particles;
    double ell = s->model.free_length;
    *first = ramp_inverse(&s->density, s->model.period, uniform(d) * s->density.rise);
    double x_left = *first, x = *first, y = 0;
    int64_t bonds = place_left(d, &x_left);
    double room = bonds ? ell + d->y[n - bonds] : ell;
    d->y[0] = 0;
    d->placed++;
    for (int64_t i = 1; i < n - bonds && y <= room; i++) {
        double gap = next_gap(d, x);
        x += s->model.system.diameter + gap;
        d->y[i] = y += gap;
        d->placed++;
    }
    double closing = room - y;
    if (!(closing >= 0)) {
        return false;
    }
    double factor = exp(-s->p * closing) / table_at(s, &s->phi, x);
    if (bonds == n - 1) {
        /* Every other gap is a bond: the closing one may be anything. */
        factor *= (1 + model_bump(&s->model, closing)) / (s->lambda * table_at(s, &s->chi, x_left));
    } else {
        factor /= table_at(s, &s->left, x_left - s->model.system.diameter);
    }
    for (int64_t i = n - bonds; i < n; i++) {
        d->y[i] += ell;
    }
    return uniform(d) * s->bound < factor;
}

/* -------------------------------------------------------------- create, draw */

/* Uniforms of a trial: splitmix64 from a fixed seed. */
static double trial_uniform(void *ctx)
{
    uint64_t *state = ctx;
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return ((double)(z >> 12) + .5) * 0x1p-52;
}

/* Rods that are placed for one ring, on average over a few; INFINITY for more than TRIAL. */
static enum bcd_status try_closing(const struct theory_sampler *s, double *placed)
{
    enum { TRIAL = 3000000, RINGS = 3 };
    uint64_t state = 1;
    const struct theory_uniforms uniforms = {.next = trial_uniform, .ctx = &state};
    struct draw draw = {.s = s, .uniforms = &uniforms, .watch = s->model.system.watch};
    draw.y = calloc((size_t)s->model.system.particles, sizeof *draw.y);
    if (!draw.y) {
        return BCD_NO_MEMORY;
    }
    int rings = 0;
    double first;
    while (rings < RINGS && draw.placed < RINGS * TRIAL && go_on(&draw)) {
        rings += attempt(&draw, &first);
    }
    free(draw.y);
    *placed = rings == RINGS ? (double)draw.placed / RINGS : INFINITY;
    return BCD_OK;
}

/* Chains that close, or the recursion where they do not or take longer. A rod placed costs about as
 * much as PLACED operations of the recursion; below QUICK the choice is not worth its set-up. */
static enum bcd_status choose(struct theory_sampler *s, struct bcd_error *error)
{
    enum { PLACED = 50, QUICK = 500000, POINTS_GUESS = 79 };
    struct bcd_error first = {0}, second = {0};
    double placed = INFINITY;
    enum bcd_status status = fill(s, &first);
    if (status == BCD_OK) {
        status = try_closing(s, &placed);
        theory_fail(&first, BCD_INVALID,
                    "equilibrium draw: chains of %lld rods do not close to a ring often enough",
                    (long long)s->model.system.particles);
    }
    if (watch_ended(s->model.system.watch)) {
        return watch_stopped(s->model.system.watch, error);
    }
    if (status == BCD_NO_MEMORY) {
        return theory_fail(error, status, "out of memory");
    }
    double recursion = chain_cost(&s->model, POINTS_GUESS, s->model.free_length) *
                       (double)s->model.system.particles;
    if (placed * PLACED < QUICK || placed * PLACED < recursion) {
        return BCD_OK;
    }
    status = backward_init(&s->backward, &s->model, &second);
    s->by_recursion = status == BCD_OK;
    if (status == BCD_INVALID && isfinite(placed)) {
        return BCD_OK;
    }
    if (status && error) {
        *error = status == BCD_INVALID ? first : second;
    }
    return status;
}

static enum bcd_status create_walls(struct theory_sampler **sampler,
                                    const struct theory_system *system, struct bcd_error *error)
{
    struct theory_sampler *fresh = calloc(1, sizeof *fresh);
    if (!fresh) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    const struct theory_wanted nothing = {0};
    enum bcd_status status = model_init_walls(&fresh->model, system, &nothing, error);
    status = status ? status : walls_draw_init(&fresh->walls, &fresh->model, error);
    if (status) {
        theory_sampler_free(fresh);
        return status;
    }
    fresh->model.system.watch = NULL; /* borrowed until here */
    *sampler = fresh;
    return BCD_OK;
}

enum bcd_status theory_sampler_create(struct theory_sampler **sampler,
                                      const struct theory_system *system, struct bcd_error *error)
{
    if (system->walls) {
        return create_walls(sampler, system, error);
    }
    struct theory_sampler *fresh = calloc(1, sizeof *fresh);
    if (!fresh) {
        return theory_fail(error, BCD_NO_MEMORY, "out of memory");
    }
    const struct theory_wanted nothing = {0};
    enum bcd_status status = model_init(&fresh->model, system, &nothing, error);
    if (!status && system->pair.kind == THEORY_ENERGY) {
        status =
            theory_fail(error, BCD_INVALID, "equilibrium draw: only for hard and for sticky rods");
    }
    if (!status && system->particles > 1000000) {
        status = theory_fail(error, BCD_INVALID, "equilibrium draw: more than 1e6 rods");
    }
    fresh->model.any_pressure = true;
    if (!status) {
        status = choose(fresh, error);
    }
    if (status) {
        theory_sampler_free(fresh);
        return status;
    }
    fresh->model.system.watch = NULL; /* borrowed until here */
    fresh->periods = round(system->length / fresh->model.period);
    *sampler = fresh;
    return BCD_OK;
}

void theory_sampler_free(struct theory_sampler *sampler)
{
    if (sampler) {
        backward_fini(&sampler->backward);
        walls_draw_fini(&sampler->walls);
    }
    free(sampler);
}

/* Rod 0 to its place, the others relative to it. Coordinates are rounded to 2^-32 of a period, so
 * that the last bits of exp and log, which differ from machine to machine, do not show. */
static void place(const struct theory_sampler *s, double *y, double first, double turn)
{
    double unit = s->model.period * 0x1p-32, ell = s->model.free_length;
    first = rint(first / unit) * unit + turn * s->model.period;
    for (int64_t i = 0; i < s->model.system.particles; i++) {
        double relative = fmin(rint(y[i] / unit) * unit, ell);
        y[i] = first + (y[i] == ell ? ell : relative);
    }
}

/* The same between walls; bonds stay bitwise equal. */
static void place_in_walls(const struct theory_sampler *s, double *y)
{
    double ell = s->model.free_length, unit = ell * 0x1p-32, low = s->model.system.diameter / 2;
    for (int64_t i = 0; i < s->model.system.particles; i++) {
        y[i] = low + fmin(rint(y[i] / unit) * unit, ell);
    }
}

enum bcd_status theory_sampler_draw(const struct theory_sampler *sampler, double *y,
                                    const struct theory_uniforms *uniforms, struct bcd_error *error)
{
    struct draw draw = {.s = sampler, .uniforms = uniforms, .y = y, .watch = uniforms->watch};
    double first;
    if (sampler->model.system.walls) {
        enum bcd_status status = walls_draw(&sampler->walls, y, uniforms, error);
        if (status == BCD_OK) {
            place_in_walls(sampler, y);
        }
        return status;
    }
    if (sampler->by_recursion) {
        if (backward_draw(&sampler->backward, y, &first, uniforms) &&
            !watch_ended(uniforms->watch)) {
            return theory_fail(error, BCD_NO_MEMORY, "out of memory");
        }
    }
    while (!sampler->by_recursion && !attempt(&draw, &first) && go_on(&draw)) {
        if (draw.placed > BUDGET) {
            return theory_fail(error, BCD_INVALID,
                               "equilibrium draw: no ring of %lld rods closed within %d rods "
                               "placed",
                               (long long)sampler->model.system.particles, BUDGET);
        }
    }
    if (watch_ended(uniforms->watch)) {
        return watch_stopped(uniforms->watch, error);
    }
    double turn = floor(uniform(&draw) * sampler->periods);
    place(sampler, y, first, turn);
    return BCD_OK;
}
