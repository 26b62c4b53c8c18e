/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * fourier - U(x) = sum over k = 1.. of a_k cos(2 pi k x/lambda) + b_k sin(2 pi k x/lambda): any
 * smooth periodic potential, ratchets among them.
 *
 * With z = exp(2 pi i x/lambda) it is the real part of a polynomial, sum (a_k - i b_k) z^k, and is
 * evaluated by Horner's rule; so is its slope, sum (2 pi k/lambda) (b_k + i a_k) z^k.
 */
#include "part.h"
#include "kernels/elementary.h"
#include "kernels/simd.h"

#include <math.h>
#include <stdlib.h>

enum { TERMS_MAX = 64, TILE = 64, LANES = 8 };

/* Coefficients of z^1 .. z^count. */
struct polynomial {
    int count;
    double re[TERMS_MAX], im[TERMS_MAX];
};

struct fourier_par {
    double wavelength;
    struct bcd_numbers cosine, sine;
    struct polynomial energy, slope; /* made by complete */
    double curvature_max;
};

#define AMPLITUDES(member, text)                                                                   \
    {                                                                                              \
        .name = #member, .type = BCD_PARAM_NUMBERS, .unit = "energy", .min = -1e6, .max = 1e6,     \
        .most = TERMS_MAX, .doc = text, .offset = offsetof(struct fourier_par, member) \
    }
static const struct bcd_param fourier_params[] = {
    {.name = "wavelength",
     .type = BCD_PARAM_NUMBER,
     .above_min = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .fallback = 1,
     .doc = "lambda, period of the potential",
     .offset = offsetof(struct fourier_par, wavelength)},
    AMPLITUDES(cosine, "a_1, a_2, ... of cos(2 pi k x/lambda)"),
    AMPLITUDES(sine, "b_1, b_2, ... of sin(2 pi k x/lambda)"),
    {0},
};
#undef AMPLITUDES

static double number_or_zero(const struct bcd_numbers *numbers, size_t i)
{
    return i < numbers->count ? numbers->at[i] : 0;
}

/* re[j] = real part of the polynomial at place u[j] (in turns), n <= TILE. */
static inline void polynomial_at(const struct polynomial *p, const double *u, int n, double *re)
{
    double c[TILE], s[TILE], im[TILE];
    for (int j = 0; j < n; j++) {
        double turn = u[j] - round_whole(u[j]);
        c[j] = cos_half(turn);
        s[j] = sin_half(turn);
        re[j] = im[j] = 0;
    }
    for (int k = p->count - 1; k > 0; k--)
        for (int j = 0; j < n; j++) {
            double a = re[j] + p->re[k], b = im[j] + p->im[k];
            re[j] = a * c[j] - b * s[j];
            im[j] = a * s[j] + b * c[j];
        }
    for (int j = 0; j < n; j++)
        re[j] = (re[j] + p->re[0]) * c[j] - (im[j] + p->im[0]) * s[j];
}

/* Places of rods start .. start + n - 1 in turns. */
static inline void turns_of(const struct rods *rods, int64_t start, int n, double inverse,
                            double *u)
{
    rods_places(rods, start, n, u);
    for (int j = 0; j < n; j++)
        u[j] *= inverse;
}

/* max |U''| of a trigonometric polynomial of degree n: at most 1/cos(pi n/M) times its largest
 * value on M > 2 n equidistant points; H. Ehlich and K. Zeller, Math. Z. 86, 41 (1964), doi
 * 10.1007/BF01111276. Here M = 256 n: 8e-5 too large at most. */
static double curvature_bound(const struct polynomial *curvature)
{
    enum { PER_TERM = 256 };
    double most = 0;
    int points = PER_TERM * curvature->count;
    for (int start = 0; start < points; start += TILE) {
        double u[TILE], value[TILE];
        for (int j = 0; j < TILE; j++)
            u[j] = (double)(start + j) / points;
        polynomial_at(curvature, u, TILE, value);
        for (int j = 0; j < TILE; j++)
            most = fmax(most, fabs(value[j]));
    }
    return most / cos_turns(0.5 / PER_TERM);
}

static void fourier_complete(struct bcd_group *group, const struct plan *plan,
                             struct bcd_errors *errors)
{
    (void)plan;
    struct fourier_par *p = group->values;
    if (p->cosine.count == 0 && p->sine.count == 0) {
        group_fault(group, "cosine", errors, "is required, or \"sine\", or both: the amplitudes");
        return;
    }
    struct polynomial curvature;
    size_t count = p->cosine.count > p->sine.count ? p->cosine.count : p->sine.count;
    p->energy.count = p->slope.count = curvature.count = (int)count;
    for (size_t k = 0; k < count; k++) {
        double a = number_or_zero(&p->cosine, k), b = number_or_zero(&p->sine, k);
        double wave_number = 2 * M_PI * (double)(k + 1) / p->wavelength;
        p->energy.re[k] = a;
        p->energy.im[k] = -b;
        p->slope.re[k] = wave_number * b;
        p->slope.im[k] = wave_number * a;
        curvature.re[k] = -wave_number * wave_number * a;
        curvature.im[k] = wave_number * wave_number * b;
    }
    p->curvature_max = curvature_bound(&curvature);
}

static double fourier_period(const void *par)
{
    return ((const struct fourier_par *)par)->wavelength;
}

static bool fourier_flat(const void *par)
{
    const struct fourier_par *p = par;
    for (int k = 0; k < p->energy.count; k++)
        if (p->energy.re[k] != 0 || p->energy.im[k] != 0)
            return false;
    return true;
}

static double fourier_curvature_max(const void *par)
{
    return ((const struct fourier_par *)par)->curvature_max;
}

static bool fourier_steady(const void *par)
{
    (void)par;
    return true;
}

KERNEL_CLONES
static void fourier_add_force(const void *par, const struct rods *rods, double scale, double *out)
{
    const struct fourier_par *p = par;
    const double inverse = 1 / p->wavelength;
    double u[TILE], slope[TILE];
    for (int64_t start = 0; start < rods->count; start += TILE) {
        int n = rods->count - start < TILE ? (int)(rods->count - start) : TILE;
        turns_of(rods, start, n, inverse, u);
        polynomial_at(&p->slope, u, n, slope);
        for (int j = 0; j < n; j++)
            out[start + j] -= scale * slope[j];
    }
}

KERNEL_CLONES
static double fourier_energy_sum(const void *par, const struct rods *rods)
{
    const struct fourier_par *p = par;
    const double inverse = 1 / p->wavelength;
    double u[TILE], energy[TILE], sum[LANES] = {0};
    for (int64_t start = 0; start < rods->count; start += TILE) {
        int n = rods->count - start < TILE ? (int)(rods->count - start) : TILE;
        turns_of(rods, start, n, inverse, u);
        polynomial_at(&p->energy, u, n, energy);
        for (int j = 0; j < n; j++)
            sum[j % LANES] += energy[j];
    }
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

static double fourier_force_ns(const void *par, const struct plan *plan)
{
    (void)plan;
    return 1.5 * ((const struct fourier_par *)par)->slope.count;
}

static double fourier_energy_ns(const void *par)
{
    return 40 + 10 * (double)((const struct fourier_par *)par)->energy.count;
}

const struct potential_type potential_fourier = {
    .base = {.part = {.name = "fourier",
                      .doc = "U(x) = sum a_k cos(2 pi k x/lambda) + b_k sin(2 pi k x/lambda)",
                      .params = fourier_params},
             .par_size = sizeof(struct fourier_par),
             .complete = fourier_complete},
    .period = fourier_period,
    .flat = fourier_flat,
    .curvature_max = fourier_curvature_max,
    .add_force = fourier_add_force,
    .energy_sum = fourier_energy_sum,
    .steady = fourier_steady,
    .force_ns = fourier_force_ns,
    .energy_ns = fourier_energy_ns,
};
