/* SPDX-License-Identifier: GPL-3.0-or-later
 * Closed forms: against each other, against limits, and against independent quadratures. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <complex.h>

#include "../../engine/theory/closed_forms.h"

#define PI 3.14159265358979323846

static void assert_near(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected))) {
        fail_msg("%.15g instead of %.15g: off by %.2g, allowed %.2g", value, expected,
                 fabs(value / expected - 1), relative);
    }
}

static double cosine(const void *ctx, double x)
{
    const double *amplitude = ctx;
    return *amplitude / 2 * cos(2 * PI * x);
}

/* ----------------------------------------------------------------- Tonks gas */

static void tonks_gas(void **state)
{
    (void)state;
    assert_near(tonks_pressure(.8, .8, 2), 2 * .8 / .36, 1e-14);
    assert_near(tonks_contact(.8, .8), .64 / .36, 1e-14);
    assert_near(tonks_pair(.8, .8, .8), 1 / .36, 1e-13);
    assert_true(tonks_pair(.8, .8, .7999) == 0);
    assert_near(tonks_pair(.8, .8, 30), 1, 1e-9);
    assert_near(tonks_pair(.8, 0, .1), 1, 1e-15);
    assert_near(tonks_pair_ring(16, 20, .8, .8), 15 / 7.2 / .8, 1e-12);
    assert_near(tonks_pair_ring(16, 20, 0, 3), 15. / 16, 1e-12);
    /* one way round is the other way back; many rods are the infinite gas */
    assert_near(tonks_pair_ring(16, 20, .8, 3.3), tonks_pair_ring(16, 20, .8, 16.7), 1e-9);
    assert_near(tonks_pair_ring(800000, 1e6, .8, 2.5), tonks_pair(.8, .8, 2.5), 1e-5);
    assert_true(isnan(tonks_pressure(.8, 1.25, 1)) && isnan(tonks_pair(-1, .8, 1)));
    assert_true(isnan(tonks_pair_ring(16, 12.8, .8, 1)));
}

/* ---------------------------------------------------------------- single file */

/* Two points on a ring of length ell: the mean moves freely, the distance is reflected at 0 and
 * ell; its autocorrelation is a sum over the odd modes of a triangle wave. */
static double two_points_msd(double ell, double D, double t)
{
    double lost = 0;
    for (int k = 1; k < 4001; k += 2) {
        double mode = PI * k / ell;
        lost += 8 * ell * ell / pow(PI * k, 4) * -expm1(-mode * mode * 2 * D * t);
    }
    return D * t + lost / 2;
}

static void two_rods_on_a_ring(void **state)
{
    (void)state;
    for (double t = 1e-3; t < 1e3; t *= 10) {
        /* The sum is cut at 4000: its rest is below 1e-9 of the shortest time's. */
        assert_near(single_file_msd_ring(2, 3, .5, 1.5, t), two_points_msd(2, 1.5, t), 2e-9);
    }
}

static void single_file_limits(void **state)
{
    (void)state;
    double contact = tonks_contact(.8, .8);
    for (double t = 1e-6; t < 1e-3; t *= 10) {
        /* What is left out is of relative order t. */
        double x = single_file_msd(.8, .8, 2, t), known = single_file_msd_short(.8, contact, 2, t);
        assert_near(x, known, 10 * t);
        assert_true(fabs(x / (4 * t) - 1) > 20 * fabs(x / known - 1));
    }
    double correction = 0;
    for (double t = 1e2; t < 1e15; t *= 10) {
        double late = single_file_msd_long(.8, .8, 1, t), x = single_file_msd(.8, .8, 1, t);
        assert_near(x, late, .1 / sqrt(t));
        /* The difference tends to a constant, about -.0372 here. */
        if (t < 1e10) {
            correction = x - late;
            assert_near(correction, -.0372, .02);
        }
    }
    assert_near(single_file_msd_ring(1, 20, .8, 2, 3), 12, 1e-9);
    assert_true(single_file_msd(.8, .8, 1, 0) == 0);
    assert_true(isnan(single_file_msd(.8, 1.3, 1, 1)) && isnan(single_file_msd(.8, .8, 1, -1)));
}

static void ring_between_line_and_late_law(void **state)
{
    (void)state;
    /* Before a ring of many rods notices its size it is a line; in the end it turns as a whole. The
     * ring's own contact density is lower by 1/N. */
    for (double t = 1e-2; t < 1e3; t *= 10) {
        double line = single_file_msd(.8, .8, 1, t);
        assert_near(single_file_msd_ring(4000, 5000, .8, 1, t), line, 1e-3);
    }
    for (double t = 20; t < 1e6; t *= 7) {
        assert_near(single_file_msd_ring(16, 20, .8, 1, t),
                    single_file_msd_ring_late(16, 20, .8, 1, t), 1e-7);
    }
    double before = 0;
    for (double t = 1e-3; t < 100; t *= 1.3) {
        double x = single_file_msd_ring(16, 20, .8, 1, t);
        assert_true(x > before);
        before = x;
    }
}

/* --------------------------------------------------------------------- one rod */

/* I_0 by its integral. */
static double bessel_0(double x)
{
    double sum = 0;
    for (int i = 0; i < 4000; i++) {
        sum += exp(x * (cos(2 * PI * i / 4000.) - 1)) / 4000;
    }
    return sum * exp(x);
}

static void lifson_jackson_of_a_cosine(void **state)
{
    (void)state;
    for (double amplitude = 0; amplitude <= 200; amplitude += 25) {
        struct one_rod rod = {
            .energy = cosine, .ctx = &amplitude, .period = 1, .kT = .8, .D = 2};
        double d, v, tilted;
        struct bcd_error error = {0};
        assert_int_equal(lifson_jackson(&d, &rod, &error), BCD_OK);
        assert_near(d, 2 / pow(bessel_0(amplitude / 1.6), 2), 1e-10);
        assert_int_equal(tilted_drift(&v, &tilted, &rod, &error), BCD_OK);
        assert_near(tilted, d, 1e-9);
        assert_true(v == 0);
    }
}

/* Drift from the stationary Fokker-Planck equation by a continued fraction in its Fourier modes:
 * (f - i k q kT) p_k + (U0 q/4i) (p_{k-1} - p_{k+1}) = 0 for k > 0. */
static double drift_by_modes(double amplitude, double kT, double D, double force)
{
    double q = 2 * PI;
    double complex a = amplitude * q / (4 * I), ratio = 0;
    for (int k = 400; k >= 1; k--) {
        ratio = -a / (force - I * k * q * kT - a * ratio);
    }
    return D / kT * (force - amplitude * q / 2 * cimag(ratio));
}

static void tilted_drift_of_a_cosine(void **state)
{
    (void)state;
    const double forces[] = {.1, 1, 5, 10, 18, 19, 25, 60, -3, -20};
    for (double amplitude = 2; amplitude <= 14; amplitude += 4) {
        double d0, v, d;
        struct one_rod rod = {
            .energy = cosine, .ctx = &amplitude, .period = 1, .kT = .7, .D = 1.3};
        struct bcd_error error = {0};
        assert_int_equal(lifson_jackson(&d0, &rod, &error), BCD_OK);
        for (size_t i = 0; i < sizeof forces / sizeof *forces; i++) {
            rod.force = forces[i];
            assert_int_equal(tilted_drift(&v, &d, &rod, &error), BCD_OK);
            /* The modes lose digits where the drift is much smaller than f. */
            assert_near(v, drift_by_modes(amplitude, .7, 1.3, forces[i]), 1e-7);
            assert_true(d > 0);
        }
        rod.force = 1e-6;
        assert_int_equal(tilted_drift(&v, &d, &rod, &error), BCD_OK);
        assert_near(v, d0 * 1e-6 / .7, 1e-9); /* Einstein */
        assert_near(d, d0, 1e-9);
        rod.force = 400;
        assert_int_equal(tilted_drift(&v, &d, &rod, &error), BCD_OK);
        assert_near(v, 1.3 * 400 / .7, .01);
        assert_near(d, 1.3, .05);
    }
}

/* Far above the critical force the diffusion follows from perturbation theory in U0/f (kT -> 0
 * aside); at strong tilt and low temperature, from the first passage over one period: D_eff =
 * (P^2/2) Var(tau)/<tau>^3 with the moments of the passage time by direct nested quadrature. */
static void tilted_diffusion_by_passage_times(void **state)
{
    (void)state;
    enum { STEPS = 1200, BACK = 4 };
    double amplitude = 3, kT = 1, D = 1, force = 12, h = 1. / STEPS;
    /* tau moments over one period from far upstream: T1'(x) = -e^{V} int_{-inf}^x e^{-V}/D,
     * Var = 2 int dx e^{V(x)}/D int_{-inf}^x dy e^{-V(y)} D T1'(y)^2 ... on midpoints, BACK periods
     * back (e^{-12} each). */
    static double v[STEPS * (BACK + 1)], slope[STEPS * (BACK + 1)];
    double inner = 0, square = 0, mean = 0, variance = 0;
    for (int i = 0; i < STEPS * (BACK + 1); i++) {
        double x = (i + .5) * h - BACK;
        v[i] = (cosine(&amplitude, x) - force * x) / kT;
    }
    for (int i = 0; i < STEPS * (BACK + 1); i++) {
        double here = exp(-v[i]) * h;
        slope[i] = exp(v[i]) * (inner + here / 2) / D;
        inner += here;
        double there = here * slope[i] * slope[i];
        double spread = exp(v[i]) * (square + there / 2);
        square += there;
        if (i >= STEPS * BACK) {
            mean += slope[i] * h;
            variance += 2 * spread * h;
        }
    }
    struct one_rod rod = {
        .energy = cosine, .ctx = &amplitude, .period = 1, .kT = kT, .D = D, .force = force};
    double velocity, diffusion;
    assert_int_equal(tilted_drift(&velocity, &diffusion, &rod, NULL), BCD_OK);
    /* Midpoint rule: relative error of order (f h)^2. */
    assert_near(velocity, 1 / mean, 2e-4);
    assert_near(diffusion, variance / (2 * mean * mean * mean), 5e-4);
}

static double bad_energy(const void *ctx, double x)
{
    (void)ctx;
    return x > .3 ? INFINITY : 0;
}

static void one_rod_refusals(void **state)
{
    (void)state;
    double amplitude = 1e4, d = 7, v = 7;
    struct bcd_error error = {0};
    struct one_rod rod = {
        .energy = cosine, .ctx = &amplitude, .period = 1, .kT = 1, .D = 1, .force = 1};
    assert_int_equal(tilted_drift(&v, &d, &rod, &error), BCD_INVALID);
    assert_true(strlen(error.text) > 10);
    rod.kT = 0;
    assert_int_equal(lifson_jackson(&d, &rod, &error), BCD_INVALID);
    rod.kT = 1;
    rod.energy = bad_energy;
    assert_int_equal(lifson_jackson(&d, &rod, &error), BCD_INVALID);
    assert_int_equal(tilted_drift(&v, &d, &rod, NULL), BCD_INVALID);
    assert_true(d == 7 && v == 7);
}

/* ------------------------------------------------------------------ zero noise */

static double flow_velocity(const struct cosine_flow *flow, double x)
{
    double q = 2 * PI / flow->wavelength;
    return flow->mobility *
           (flow->force + flow->amplitude / 2 * q * sin(q * x + flow->phase));
}

static void zero_noise_flow(void **state)
{
    (void)state;
    for (double force = -30; force <= 30; force += 2.5) {
        struct cosine_flow flow = {
            .amplitude = 6, .wavelength = 1.2, .phase = .3, .mobility = .7, .force = force};
        double x = -3.7, h = 1e-4;
        for (int i = 0; i < 20000; i++) {
            double a = flow_velocity(&flow, x), b = flow_velocity(&flow, x + h / 2 * a);
            double c = flow_velocity(&flow, x + h / 2 * b), d = flow_velocity(&flow, x + h * c);
            x += h / 6 * (a + 2 * b + 2 * c + d);
        }
        double exact = cosine_flow_position(&flow, -3.7, 2);
        assert_true(fabs(exact - x) < 1e-9);
        /* A flow is a group, also after many turns. */
        double half = cosine_flow_position(&flow, -3.7, 1);
        assert_true(fabs(cosine_flow_position(&flow, half, 1) - exact) < 1e-9);
        double far = cosine_flow_position(&flow, -3.7, 1e4);
        assert_true(fabs((far + 3.7) / 1e4 - cosine_flow_velocity(&flow)) < 2e-4);
    }
    struct cosine_flow critical = {
        .amplitude = 2, .wavelength = 1, .mobility = 1, .force = 2 * PI};
    assert_true(isfinite(cosine_flow_position(&critical, .1, 3)));
    struct cosine_flow top = {.amplitude = 2, .wavelength = 1, .mobility = 1};
    assert_true(fabs(cosine_flow_position(&top, .1, 100) - .5) < 1e-12); /* in the well */
}

/* --------------------------------------------------------------------- two rods */

/* Averages over the normal displacement of the gap, variance 2 D t, by the trapezoidal rule. */
static void two_rods_first_step(void **state)
{
    (void)state;
    double D = 1.7, t = .3, s = sqrt(2 * D * t);
    for (double gap = 0; gap < 4; gap += .25) {
        /* u = d + s z > 0: elastic takes |u|, rejection keeps d when u < 0. Split at u = 0. */
        enum { STEPS = 20000 };
        double elastic = 0, rejection = 0, h = 12. * s / STEPS;
        for (int i = 0; i <= STEPS; i++) {
            double u = i * h, end = i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2;
            double right = exp(-(u - gap) * (u - gap) / (2 * s * s));
            double left = exp(-(u + gap) * (u + gap) / (2 * s * s));
            double weight = end * h / 3 / (s * sqrt(2 * PI));
            elastic += weight * (u - gap) * (right + left);
            rejection += weight * (u - gap) * right;
        }
        assert_true(fabs(two_rods_elastic(gap, D, t) - elastic) < 1e-9);
        assert_true(fabs(two_rods_rejection(gap, D, t) - rejection) < 1e-9);
    }
    assert_near(two_rods_rejection(0, D, t) * 2, two_rods_elastic(0, D, t), 1e-14);
    assert_true(two_rods_elastic(1, 1, 0) == 0 && isnan(two_rods_elastic(-1, 1, 1)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tonks_gas),
        cmocka_unit_test(two_rods_on_a_ring),
        cmocka_unit_test(single_file_limits),
        cmocka_unit_test(ring_between_line_and_late_law),
        cmocka_unit_test(lifson_jackson_of_a_cosine),
        cmocka_unit_test(tilted_drift_of_a_cosine),
        cmocka_unit_test(tilted_diffusion_by_passage_times),
        cmocka_unit_test(one_rod_refusals),
        cmocka_unit_test(zero_noise_flow),
        cmocka_unit_test(two_rods_first_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
