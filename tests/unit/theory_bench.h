/* SPDX-License-Identifier: GPL-3.0-or-later
 * theory_bench.h - systems and comparisons that the tests of the equilibrium theory share. */
#ifndef THEORY_BENCH_H
#define THEORY_BENCH_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "../../engine/theory/closed_forms.h"
#include "../../engine/theory/theory.h"

#define PI 3.14159265358979323846

static inline double cosine(const void *ctx, double x)
{
    const double *amplitude = ctx;
    return *amplitude / 2 * cos(2 * PI * x);
}

static const double u6 = 6, u20 = 20;

static inline struct theory_system rods(int64_t n, double length, double diameter, const double *u)
{
    return (struct theory_system){.particles = n,
                                  .length = length,
                                  .diameter = diameter,
                                  .temperature = 1,
                                  .period = 1,
                                  .energy = u ? cosine : NULL,
                                  .ctx = u};
}

static inline struct theory_pair baxter(double gamma)
{
    return (struct theory_pair){.kind = THEORY_BAXTER, .strength = gamma};
}

static inline struct theory_pair sticky(double gamma, double range, double exponent)
{
    return (struct theory_pair){
        .kind = THEORY_STICKY, .strength = gamma, .range = range, .exponent = exponent};
}

typedef enum bcd_status (*route)(struct theory_result **, const struct theory_system *,
                                 const struct theory_wanted *, struct bcd_error *);

static inline struct theory_result *solve(route by, const struct theory_system *system,
                                   const struct theory_wanted *wanted)
{
    struct theory_result *result = NULL;
    struct bcd_error error = {0};
    if (by(&result, system, wanted, &error)) {
        fail_msg("%s", error.text);
    }
    assert_true(result->error < 1e-9);
    return result;
}

static inline void assert_near(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected))) {
        fail_msg("%.15g instead of %.15g: off by %.2g, allowed %.2g", value, expected,
                 fabs(value / expected - 1), relative);
    }
}

/* Largest difference of two profiles over the largest value of the second. */
static inline double distance(const double *a, const double *b, size_t count)
{
    double difference = 0, largest = 0;
    for (size_t i = 0; i < count; i++) {
        difference = fmax(difference, fabs(a[i] - b[i]));
        largest = fmax(largest, fabs(b[i]));
        assert_true(isfinite(a[i]) && isfinite(b[i]));
    }
    return difference / largest;
}

static inline void assert_same(const struct theory_result *a, const struct theory_result *b,
                               double bound)
{
    const struct theory_wanted *w = &a->wanted;
    assert_true(distance(a->density, b->density, w->density_bins) < bound);
    assert_true(distance(a->contact, b->contact, w->contact_bins) < bound);
    if (a->contact_window && b->contact_window) {
        assert_true(distance(a->contact_window, b->contact_window, w->contact_bins) < bound);
    }
    if (w->gap_bins && b->wanted.gap_bins) {
        assert_true(distance(a->gap, b->gap, w->gap_bins) < bound);
    }
    if (w->pair_bins && b->wanted.pair_bins) {
        assert_true(distance(a->pair, b->pair, w->pair_bins) < bound);
    }
    assert_true(fabs(a->energy - b->energy) < bound);
    if (!isnan(a->bonded_fraction) || !isnan(b->bonded_fraction)) {
        assert_true(fabs(a->bonded_fraction - b->bonded_fraction) < bound);
    }
}

static const struct theory_wanted profiles = {.density_bins = 50,
                                              .contact_bins = 50,
                                              .contact_gap = 1e-3,
                                              .gap_bins = 20,
                                              .gap_last = .1};

/* A sticky interaction given as an energy; other units of length and energy. */
static inline double as_energy(const void *ctx, double r)
{
    (void)ctx;
    double t = 1 - (r - .8) / .05;
    return t > 0 ? -log1p(1 * 4 / .05 * t * t * t) : 0;
}

#endif
