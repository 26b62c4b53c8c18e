/* SPDX-License-Identifier: GPL-3.0-or-later
 * wave.c - see wave.h. */
#include "wave.h"
#include "elementary.h"
#include "simd.h"

enum { TILE = 256, LANES = 8, DOUBLE_MIN = 16 };

KERNEL_CLONES
void wave_add_sine(double *out, const struct wave_line *line, const struct wave *wave, double scale)
{
    const double k = wave->inverse_wavelength, phase = wave->phase, diameter = line->diameter;
    const double *y = line->y;
    const int64_t n = line->count, first = line->first;
    /* Two at once where it pays: neither has to wait for the other's long sums. */
    const int64_t half = n < DOUBLE_MIN ? 0 : n / 8 * 4;
    TURNS_APART
    for (int64_t i = 0; i < half; i++) {
        double near = (y[i] + number(first + i) * diameter) * k + phase;
        double far = (y[i + half] + number(first + i + half) * diameter) * k + phase;
        near = sin_turns(near);
        far = sin_turns(far);
        out[i] += scale * near;
        out[i + half] += scale * far;
    }
    TURNS_APART
    for (int64_t i = 2 * half; i < n; i++)
        out[i] += scale * sin_turns((y[i] + number(first + i) * diameter) * k + phase);
}

KERNEL_CLONES
void wave_add_sine_at(double *out, const struct wave_places *at, const struct wave *wave,
                      double scale)
{
    const double k = wave->inverse_wavelength, phase = wave->phase;
    const double *y = at->y, *offset = at->offset;
    const int64_t half = at->count / 2; /* two at once */
    TURNS_APART
    for (int64_t i = 0; i < half; i++) {
        double near = (y[i] + offset[i]) * k + phase;
        double far = (y[i + half] + offset[i + half]) * k + phase;
        near = sin_turns(near);
        far = sin_turns(far);
        out[i] += scale * near;
        out[i + half] += scale * far;
    }
}

/* What a rod at u turns gains, in wavelengths. The denominator adds two numbers >= 0 that are not 0
 * together. */
static inline __attribute__((always_inline)) double flow_of(double u, double growth)
{
    const double gain = growth - 1;
    double r = u - round_whole(u), s = sin_half(r), c = cos_half(r);
    return arc_tangent(gain * s / ((1 + c) + growth * (1 - c)));
}

KERNEL_CLONES
void wave_flow(double *y, const struct wave_line *line, const struct wave *wave, double growth)
{
    const double k = wave->inverse_wavelength, phase = wave->phase, diameter = line->diameter;
    const int64_t n = line->count;
    const double unit = 1 / (3.141592653589793 * k);
    for (int64_t start = 0; start < n; start += TILE) {
        int count = n - start < TILE ? (int)(n - start) : TILE;
        double base = (double)(line->first + start);
        double *at = y + start;
        for (int j = 0; j < count; j++) {
            double u = (at[j] + (base + (double)j) * diameter) * k + phase;
            at[j] += unit * flow_of(u, growth);
        }
    }
}

KERNEL_CLONES
void wave_flow_at(double *y, const struct wave_places *at, const struct wave *wave, double growth)
{
    const double k = wave->inverse_wavelength, phase = wave->phase;
    const double unit = 1 / (3.141592653589793 * k), *offset = at->offset;
    const int64_t half = at->count / 2; /* two at once */
    TURNS_APART
    for (int64_t i = 0; i < half; i++) {
        double near = (y[i] + offset[i]) * k + phase;
        double far = (y[i + half] + offset[i + half]) * k + phase;
        near = flow_of(near, growth);
        far = flow_of(far, growth);
        y[i] += unit * near;
        y[i + half] += unit * far;
    }
}

KERNEL_CLONES
double wave_sum_cosine(const double *y, int64_t n, double diameter, const struct wave *wave)
{
    const double k = wave->inverse_wavelength, phase = wave->phase;
    double sum[LANES] = {0}, value[TILE];
    for (int64_t start = 0; start < n; start += TILE) {
        const int count = n - start < TILE ? (int)(n - start) : TILE, whole = count / LANES * LANES;
        for (int64_t j = 0; j < count; j++)
            value[j] = cos_turns((y[start + j] + number(start + j) * diameter) * k + phase);
        for (int j = 0; j < whole; j += LANES)
            for (int lane = 0; lane < LANES; lane++)
                sum[lane] += value[j + lane];
        for (int j = whole; j < count; j++)
            sum[j - whole] += value[j];
    }
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

KERNEL_CLONES
void wave_cosine(double *out, const double *x, int n, const struct wave *wave)
{
    const double k = wave->inverse_wavelength, phase = wave->phase;
    for (int i = 0; i < n; i++)
        out[i] = 0 + cos_turns(x[i] * k + phase);
}
