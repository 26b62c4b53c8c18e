/* SPDX-License-Identifier: GPL-3.0-or-later
 * baseline.c - the floor under every step's cost (bcd.h). */
#include "bcd.h"
#include "noise.h"
#include "kernels/wave.h"

#include <string.h>

void bcd_baseline_noise_and_force(double *y, int64_t n, int64_t ticks)
{
    enum { TILE = 512 };
    const struct noise_key key = {.seed = 1};
    const struct wave wave = {1, 0};
    const double step = 1e-4, noise = 0.014142135623730951, force = 6 / 2.0 * 6.283185307179586;
    double old[TILE]; /* the force acts at the old positions */
    struct noise source;
    _Alignas(ARENA_ALIGNMENT) unsigned char rows[NOISE_BYTES_MAX];
    struct arena scratch = {.bytes = rows};
    noise_layout(&source, n, &scratch);
    for (int64_t t = 0; t < ticks; t++) {
        for (int64_t start = 0; start < n; start += TILE) {
            int64_t count = n - start < TILE ? n - start : TILE;
            memcpy(old, y + start, (size_t)count * sizeof *old);
            wave_add_sine(y + start, old, count, 0.5, &wave, step * force);
        }
        noise_add(&source, &key, t, noise, y);
    }
}
