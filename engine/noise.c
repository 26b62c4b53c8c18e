/* SPDX-License-Identifier: GPL-3.0-or-later
 * noise.c - see noise.h. */
#include "noise.h"
#include "kernels/rods.h"

#include <assert.h>
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

/* Fills the rows from that tick on, with those that go beside the realization too. */
static void draw(struct noise *noise, const struct noise_key *key, int64_t tick)
{
    const struct normals_ticks ticks = {tick, noise->every, noise->row_count >> key->side,
                                        key->side};
    struct noise_key first = *key;
    first.realization -= key->lane;
    assert(ticks.count > 0);
    normals_rows(noise->rows, noise->n, &ticks, &first);
    noise->first = tick;
    noise->ticks = ticks.count;
    noise->realization = first.realization;
    noise->side = key->side;
}

static void add_tick(struct noise *noise, const struct noise_key *key, int64_t tick, double scale,
                     double *z)
{
    if (!noise->rows) {
        assert(!key->all || key->side == 0);
        normals_add(z, noise->n, scale, key, tick);
        return;
    }
    int64_t at = (tick - noise->first) / noise->every;
    if (!noise_holds(noise, key) || at < 0 || at >= noise->ticks ||
        noise->first + at * noise->every != tick) {
        draw(noise, key, tick);
        at = 0;
    }
    rods_add(z, noise_row_at(noise, key, at), scale, noise_count(noise, key));
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
