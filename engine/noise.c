/* SPDX-License-Identifier: GPL-3.0-or-later
 * noise.c - see noise.h. */
#include "noise.h"
#include "kernels/rods.h"

#include <math.h>

enum { SMALL = 512 };

void noise_layout(struct noise *noise, int64_t n, int64_t every, struct arena *scratch)
{
    *noise = (struct noise){.n = n, .every = every, .realization = -1};
    if (n > SMALL)
        return;
    noise->row_count = NOISE_KEPT / normals_stride(n);
    noise->rows =
        arena_take(scratch, (size_t)(noise->row_count * normals_stride(n)) * sizeof(double));
}

static void add_tick(struct noise *noise, const struct noise_key *key, int64_t tick, double scale,
                     double *z)
{
    if (!noise->rows) {
        normals_add(z, noise->n, scale, key, tick);
        return;
    }
    int64_t row = (tick - noise->first) / noise->every;
    if (noise->realization != key->realization || row < 0 || row >= noise->row_count ||
        noise->first + row * noise->every != tick) {
        const struct normals_ticks ticks = {tick, noise->every, noise->row_count};
        normals_rows(noise->rows, noise->n, &ticks, key);
        noise->first = tick;
        noise->realization = key->realization;
        row = 0;
    }
    const int64_t stride = normals_stride(noise->n);
    rods_add(z, noise->rows + row * stride, scale, stride);
}

void noise_add_anew(struct noise *noise, const struct noise_key *key, int64_t tick, double scale,
                    double *z)
{
    if (!key->doubled) {
        add_tick(noise, key, tick, scale, z);
        return;
    }
    add_tick(noise, key, 2 * tick, scale * sqrt(0.5), z);
    add_tick(noise, key, 2 * tick + 1, scale * sqrt(0.5), z);
}
