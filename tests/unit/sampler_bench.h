/* SPDX-License-Identifier: GPL-3.0-or-later
 * sampler_bench.h - exact equilibrium configurations against exact references: what the quick and
 * the long test of the sampler share.
 *
 * Of every configuration one rod, one gap and one pair are counted, so that the counts are
 * independent and chi-square is what its name says. A test fails below a p-value of 1e-5: with some
 * 60 of them and seeds that were not chosen, one accidental failure in 1600 sets of seeds. */
#ifndef SAMPLER_BENCH_H
#define SAMPLER_BENCH_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>
#include <gsl/gsl_cdf.h>

#include "../../engine/theory/sampler.h"

#define PI 3.14159265358979323846
enum { BINS = 20 };

static inline double next_uniform(void *ctx) /* splitmix64 */
{
    uint64_t *state = ctx;
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return ((double)(z >> 12) + .5) * 0x1p-52;
}

struct wave {
    double amplitude, period;
};

/* Not symmetric, so that mirror images cannot pass for each other. */
static inline double wave(const void *ctx, double x)
{
    const struct wave *w = ctx;
    double phase = 2 * PI * x / w->period;
    return w->amplitude / 2 * (cos(phase) + .3 * sin(2 * phase));
}

static const struct wave u6 = {6, 1}, u20 = {20, 1};

static inline struct theory_system rods(int64_t n, double length, double diameter,
                                        const struct wave *u)
{
    return (struct theory_system){.particles = n,
                                  .length = length,
                                  .diameter = diameter,
                                  .temperature = 1,
                                  .period = u ? u->period : 0,
                                  .energy = u ? wave : NULL,
                                  .ctx = u};
}

struct counts {
    double density[BINS], gap[BINS + 1], pair[BINS + 1];
    double energy, energy_square, bonds;
};

static inline struct theory_sampler *sampler_of(const struct theory_system *system)
{
    struct theory_sampler *sampler = NULL;
    struct bcd_error error = {0};
    if (theory_sampler_create(&sampler, system, &error)) {
        fail_msg("%s", error.text);
    }
    return sampler;
}

static inline void check_order(const struct theory_system *system, const double *y)
{
    int64_t n = system->particles;
    double ell = system->length - (double)n * system->diameter;
    assert_true(y[0] >= 0 && y[0] <= system->length);
    for (int64_t i = 1; i < n; i++) {
        assert_true(y[i] >= y[i - 1]);
    }
    assert_true(y[n - 1] <= y[0] + ell);
}

static inline void count_one(struct counts *c, const struct theory_system *system,
                             const struct theory_wanted *wanted, const double *y)
{
    int64_t n = system->particles;
    double ell = system->length - (double)n * system->diameter, energy = 0;
    double period = system->energy ? system->period : system->length;
    double place = y[0] / period;
    c->density[(int)((place - floor(place)) * BINS) % BINS]++;
    for (int64_t i = 0; i < n && system->energy; i++) {
        double x = y[i] + (double)i * system->diameter;
        energy += system->energy(system->ctx, x) / (double)n;
    }
    c->energy += energy;
    c->energy_square += energy * energy;
    if (n == 1) {
        return;
    }
    /* the gap behind the last rod, across the seam */
    double gap = y[0] + ell - y[n - 1];
    size_t bin = gap < wanted->gap_last ? (size_t)(gap / wanted->gap_last * BINS) : BINS;
    c->gap[bin < BINS ? bin : BINS]++;
    enum theory_pair_kind kind = system->pair.kind;
    c->bonds +=
        kind == THEORY_BAXTER ? gap == 0 : kind == THEORY_STICKY && gap < system->pair.range;
    /* rod 0 and one other, a different one for every place of rod 0 */
    int64_t other = 1 + (int64_t)((double)(n - 1) * (y[0] * 1e3 - floor(y[0] * 1e3)));
    double r = y[other] - y[0] + (double)other * system->diameter;
    bin = r < wanted->pair_last ? (size_t)(r / wanted->pair_last * BINS * (1 + 1e-12)) : BINS;
    c->pair[bin < BINS ? bin : BINS]++;
}

/* p-value of counts against probabilities; cells that expect less than 10 are lumped together. */
static inline double p_value(const double *count, const double *probability, size_t cells,
                             double draws)
{
    double chi = 0, rare_count = 0, rare = 0;
    int degrees = -1;
    for (size_t i = 0; i < cells; i++) {
        double expected = draws * probability[i];
        if (expected < 10) {
            rare_count += count[i];
            rare += expected;
            continue;
        }
        chi += (count[i] - expected) * (count[i] - expected) / expected;
        degrees++;
    }
    if (rare >= 10) {
        chi += (rare_count - rare) * (rare_count - rare) / rare;
        degrees++;
    } else {
        assert_true(rare_count < rare + 5 * sqrt(rare) + 6);
    }
    return degrees > 0 ? gsl_cdf_chisq_Q(chi, degrees) : 1;
}

static inline void compare(const struct counts *c, const struct theory_result *r,
                           const struct theory_system *system, double draws)
{
    double density[BINS], gap[BINS + 1] = {0}, pair[BINS + 1] = {0}, rest = 1;
    double rho = (double)system->particles / system->length;
    for (size_t i = 0; i < BINS; i++) {
        density[i] = r->density[i] / rho / BINS;
    }
    double p = p_value(c->density, density, BINS, draws), p_gap = 1, p_pair = 1, z_bond = 0;
    if (r->wanted.gap_bins) {
        for (size_t i = 0; i < BINS; i++) {
            rest -= gap[i] = r->gap[i] * r->wanted.gap_last / BINS;
        }
        gap[BINS] = fmax(rest, 0);
        p_gap = p_value(c->gap, gap, BINS + 1, draws);
    }
    if (r->wanted.pair_bins) {
        rest = 1;
        for (size_t i = 0; i < BINS; i++) {
            rest -= pair[i] =
                r->pair[i] * rho * r->wanted.pair_last / BINS / (double)(system->particles - 1);
        }
        pair[BINS] = fmax(rest, 0);
        p_pair = p_value(c->pair, pair, BINS + 1, draws);
    }
    double mean = c->energy / draws, spread = c->energy_square / draws - mean * mean;
    double z = spread > 1e-20 ? (mean - r->energy) / sqrt(spread / draws) : 0;
    if (!isnan(r->bonded_fraction)) {
        double b = r->bonded_fraction;
        z_bond = b > 0 ? (c->bonds - draws * b) / sqrt(draws * b * (1 - b)) : c->bonds;
    }
    print_message("N %lld: p density %.3f gap %.3f pair %.3f, z energy %.2f bonds %.2f\n",
                  (long long)system->particles, p, p_gap, p_pair, z, z_bond);
    assert_true(p > 1e-5 && p_gap > 1e-5 && p_pair > 1e-5);
    assert_true(fabs(z) < 5 && fabs(z_bond) < 5);
}

static inline void check_system(const struct theory_system *system, int draws, bool with_pairs)
{
    double ell = system->length - (double)system->particles * system->diameter;
    double mean_gap = ell / (double)system->particles;
    bool one = system->particles == 1;
    struct theory_wanted wanted = {.density_bins = BINS,
                                   .gap_bins = one ? 0 : BINS,
                                   .gap_last = fmin(3 * mean_gap, ell / 2),
                                   .pair_bins = with_pairs ? BINS : 0,
                                   .pair_last = fmin(2.5, system->length / 2)};
    struct theory_result *result = NULL;
    struct bcd_error error = {0};
    if (theory_canonical(&result, system, &wanted, &error)) {
        fail_msg("%s", error.text);
    }
    struct theory_sampler *sampler = sampler_of(system);
    uint64_t state = 20240229;
    struct theory_uniforms uniforms = {.next = next_uniform, .ctx = &state};
    struct counts counts = {0};
    double *y = calloc((size_t)system->particles, sizeof *y);
    assert_non_null(y);
    for (int i = 0; i < draws; i++) {
        if (theory_sampler_draw(sampler, y, &uniforms, &error)) {
            fail_msg("%s", error.text);
        }
        check_order(system, y);
        count_one(&counts, system, &wanted, y);
    }
    compare(&counts, result, system, draws);
    free(y);
    theory_sampler_free(sampler);
    theory_result_free(result);
}

#endif
