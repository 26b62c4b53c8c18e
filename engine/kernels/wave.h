/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * wave.h - a plane wave acting on rods: x_i = y_i + i * diameter (reduced to real coordinates).
 * turns(x) = x * inverse_wavelength + phase counts wavelengths (phase in turns, not radians).
 */
#ifndef KERNELS_WAVE_H
#define KERNELS_WAVE_H

#include <stdint.h>

struct wave {
    double inverse_wavelength, phase;
};

/* Rods `first` .. first + count - 1 of a line; y and what stands beside it begin with the first of
 * them. */
struct wave_line {
    const double *y; /* [count] */
    int64_t count, first;
    double diameter;
};

/* out[i] += scale * sin(2 pi turns(x_i)), i = 0 .. count-1; out may be y. */
void wave_add_sine(double *out, const struct wave_line *line, const struct wave *wave,
                   double scale);

/* The same for rods of several rings, x_i = y_i + offset_i; count is even. */
struct wave_places {
    const double *y, *offset; /* [count] */
    int64_t count;
};
void wave_add_sine_at(double *out, const struct wave_places *at, const struct wave *wave,
                      double scale);

/* The exact flow of dx/dt = c sin(2 pi turns(x)) for a time t, y[i] in and out, line->y is y:
 *     tan(pi turns') = E tan(pi turns),   E = growth = exp(2 pi c t / wavelength) > 0. */
void wave_flow(double *y, const struct wave_line *line, const struct wave *wave, double growth);

/* The same for rods of several rings; at->y is y. */
void wave_flow_at(double *y, const struct wave_places *at, const struct wave *wave, double growth);

/* Sum over i of cos(2 pi turns(x_i)), in a fixed order of eight partial sums. */
double wave_sum_cosine(const double *y, int64_t n, double diameter, const struct wave *wave);

/* out[i] = cos(2 pi turns(x_i)): each as wave_sum_cosine gives it for that rod alone. */
void wave_cosine(double *out, const double *x, int n, const struct wave *wave);

#endif
