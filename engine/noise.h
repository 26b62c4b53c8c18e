/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * noise.h - the noise of a run's steps for methods. Normals are functions of the tick
 * (kernels/normals.h); small rings draw those of many ticks at once and keep them in scratch.
 */
#ifndef NOISE_H
#define NOISE_H

#include "arena.h"
#include "kernels/normals.h"
#include "kernels/rods.h"

/* Normals kept at once, and the memory they take: fits the first-level cache. */
enum { NOISE_KEPT = 2048, NOISE_BYTES_MAX = NOISE_KEPT * 8 };

struct noise {
    int64_t n;
    double *rows;        /* NULL for large rings */
    int64_t row_count;   /* ticks that fit */
    int64_t first;       /* tick of the first row */
    int64_t every;       /* ticks from one row to the next */
    int64_t realization; /* whose normals the rows hold; -1 = none yet */
};

/* Takes its memory; to be called again to hand it out (arena.h). every: noise is wanted at ticks so
 * far apart, as a rule. */
void noise_layout(struct noise *noise, int64_t n, int64_t every, struct arena *scratch);

/* The normals of one tick, [arena_whole(n)], where they are at hand; else NULL. */
static inline const double *noise_row(const struct noise *noise, const struct noise_key *key,
                                      int64_t tick)
{
    const int64_t row = tick - noise->first;
    bool there = noise->realization == key->realization && row >= 0 && row < noise->row_count &&
                 noise->every == 1;
    return there && !key->doubled ? noise->rows + row * normals_stride(noise->n) : NULL;
}

/* What noise_add does where the row is not there yet, or more than one is needed. */
void noise_add_anew(struct noise *noise, const struct noise_key *key, int64_t tick, double scale,
                    double *z);

/* z[i] += scale * normal(tick, i), i = 0 .. n-1; z has room for arena_whole(n). key->doubled: of
 * the step that ticks 2 tick and 2 tick + 1 make up, (normal(2 tick, i) + normal(2 tick + 1, i)) /
 * sqrt 2: the same noise. */
static inline void noise_add(struct noise *noise, const struct noise_key *key, int64_t tick,
                             double scale, double *z)
{
    const double *row = noise_row(noise, key, tick);
    if (row)
        rods_add(z, row, scale, normals_stride(noise->n));
    else
        noise_add_anew(noise, key, tick, scale, z);
}

#endif
