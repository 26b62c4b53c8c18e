/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * noise.h - the noise of a run's steps for methods. Normals are functions of the tick
 * (kernels/normals.h); small rings draw those of many ticks, and of realizations that go side by
 * side, at once and keep them in scratch.
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
    double *rows;        /* [ticks][2^side realizations][normals_stride(n)]; NULL for large rings */
    int64_t row_count;   /* rows that fit */
    int64_t first;       /* tick of the first row */
    int64_t ticks;       /* that the rows hold */
    int64_t every;       /* ticks from one to the next */
    int64_t realization; /* the first whose normals the rows hold; -1 = none yet */
    int side;            /* 2^side realizations */
};

/* Takes its memory; to be called again to hand it out (arena.h). every: noise is wanted at ticks so
 * far apart, as a rule. */
void noise_layout(struct noise *noise, int64_t n, int64_t every, struct arena *scratch);

/* Numbers that a key means: a row, or those of all realizations side by side. */
static inline int64_t noise_count(const struct noise *noise, const struct noise_key *key)
{
    return normals_stride(noise->n) << (key->all ? key->side : 0);
}

static inline bool noise_holds(const struct noise *noise, const struct noise_key *key)
{
    return noise->realization == (int64_t)key->realization - key->lane && noise->side == key->side;
}

/* The row of the `at`-th tick that is held. */
static inline const double *noise_row_at(const struct noise *noise, const struct noise_key *key,
                                         int64_t at)
{
    return noise->rows + ((at << key->side) + key->lane) * normals_stride(noise->n);
}

/* The normals of one tick, [noise_count], where they are at hand; else NULL. */
static inline const double *noise_row(const struct noise *noise, const struct noise_key *key,
                                      int64_t tick)
{
    const int64_t at = tick - noise->first;
    bool there = noise_holds(noise, key) && at >= 0 && at < noise->ticks && noise->every == 1;
    return there && !key->doubled ? noise_row_at(noise, key, at) : NULL;
}

/* What noise_add does where the row is not there yet, or more than one is needed. */
void noise_add_anew(struct noise *noise, const struct noise_key *key, int64_t tick, double scale,
                    double *z);

/* z[i] += scale * normal(tick, i), i = 0 .. n-1; z has room for arena_whole(n). key->all: the same
 * for the realizations after it, each arena_whole(n) behind the one before. key->doubled: of the
 * step that ticks 2 tick and 2 tick + 1 make up, (normal(2 tick, i) + normal(2 tick + 1, i)) /
 * sqrt 2: the same noise. */
static inline void noise_add(struct noise *noise, const struct noise_key *key, int64_t tick,
                             double scale, double *z)
{
    const double *row = noise_row(noise, key, tick);
    if (row)
        rods_add(z, row, scale, noise_count(noise, key));
    else
        noise_add_anew(noise, key, tick, scale, z);
}

#endif
