/* SPDX-License-Identifier: GPL-3.0-or-later
 * normals.c - see normals.h. Works in tiles of 64 counters laid out word by word, so that every
 * loop below runs over one array after the other and the compiler vectorises it. */
#include "normals.h"
#include "elementary.h"
#include "philox.h"
#include "simd.h"

#include <assert.h>
#include <math.h>

enum { TILE = PHILOX_TILE, ROWS_BLOCKS_MAX = 512 };

static inline uint32_t tick_high(const struct noise_key *key, int64_t tick)
{
    return (uint32_t)key->stream << 24 | (uint32_t)((uint64_t)tick >> 32);
}

/* The blocks first .. first + TILE - 1 of one tick. */
static inline __attribute__((always_inline)) void
philox_tile(struct philox_tile *t, uint32_t first, const struct noise_key *key, int64_t tick)
{
    for (int j = 0; j < TILE; j++) {
        t->word[0][j] = first + (uint32_t)j;
        t->word[1][j] = key->realization;
        t->word[2][j] = (uint32_t)tick;
        t->word[3][j] = tick_high(key, tick);
    }
    philox_rounds(t, key->seed);
}

/* Box-Muller of one pair: radius from `u`, angle from `v`; sine and cosine by own polynomials
 * (elementary.h). */
static inline __attribute__((always_inline)) void pair(uint64_t u, uint64_t v, double *sine,
                                                       double *cosine)
{
    const uint64_t low = 0xffffffffu, two_52 = 0x4330000000000000u;
    const double unit = 0x1p-32;
    /* (w + 1/2) 2^-32 lies strictly inside (0, 1). 2^52 + w is exact: no conversion needed. */
    double half_up = from_bits(two_52 | (u & low)) - (4503599627370496.0 - 0.5);
    double radius = sqrt(-2.0 * log_normal(half_up * unit));
    double turn = (from_bits(two_52 | (v & low)) - 4503599627370496.0) * unit - 0.5;
    *sine = radius * sin_half(turn);
    *cosine = radius * cos_half(turn);
}

/* Two at once: neither has to wait for the other's divisions and long sums. */
static inline __attribute__((always_inline)) void pair_tile(const uint64_t *u, const uint64_t *v,
                                                            double *sines, double *cosines)
{
    enum { HALF = TILE / 2 };
    for (int j = 0; j < HALF; j++) {
        pair(u[j], v[j], sines + j, cosines + j);
        pair(u[j + HALF], v[j + HALF], sines + j + HALF, cosines + j + HALF);
    }
}

/* The normals of a tile, word by word. */
struct normal_tile {
    _Alignas(64) double word[4][TILE];
};

static inline __attribute__((always_inline)) void box_muller(const struct philox_tile *t,
                                                             struct normal_tile *normal)
{
    pair_tile(t->word[0], t->word[1], normal->word[0], normal->word[1]);
    pair_tile(t->word[2], t->word[3], normal->word[2], normal->word[3]);
}

typedef double four __attribute__((vector_size(32), may_alias, aligned(8)));

/* Four blocks from j on, block by block: a square of numbers turned over its diagonal. */
static inline __attribute__((always_inline)) void turn(const struct normal_tile *normal, int j,
                                                       four block[4])
{
    const four a = *(const four *)(normal->word[0] + j), b = *(const four *)(normal->word[1] + j);
    const four c = *(const four *)(normal->word[2] + j), d = *(const four *)(normal->word[3] + j);
    const four even_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6);
    const four even_cd = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    const four odd_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    const four odd_cd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    block[0] = __builtin_shufflevector(even_ab, even_cd, 0, 1, 4, 5);
    block[1] = __builtin_shufflevector(odd_ab, odd_cd, 0, 1, 4, 5);
    block[2] = __builtin_shufflevector(even_ab, even_cd, 2, 3, 6, 7);
    block[3] = __builtin_shufflevector(odd_ab, odd_cd, 2, 3, 6, 7);
}

KERNEL_CLONES
void normals_add_stretch(double *out, const struct normals_stretch *stretch, double scale,
                         const struct noise_key *key, int64_t tick)
{
    const int64_t n = stretch->count, first = stretch->first;
    struct philox_tile t;
    struct normal_tile normal;
    assert(first % 4 == 0);
    for (int64_t start = 0; start < n; start += 4 * TILE) {
        const int64_t left = n - start, count = left < 4 * TILE ? left : 4 * TILE;
        double *to = out + start;
        int64_t i = 0;
        philox_tile(&t, (uint32_t)((first + start) / 4), key, tick);
        box_muller(&t, &normal);
        for (; i + 16 <= count; i += 16) {
            four block[4];
            turn(&normal, (int)i / 4, block);
            for (int k = 0; k < 4; k++)
                *(four *)(to + i + 4 * k) += scale * block[k];
        }
        for (; i < count; i++)
            to[i] += scale * normal.word[i % 4][i / 4];
    }
}

void normals_add(double *out, int64_t n, double scale, const struct noise_key *key, int64_t tick)
{
    normals_add_stretch(out, &(struct normals_stretch){0, n}, scale, key, tick);
}

KERNEL_CLONES
void normals_rows(double *out, int64_t n, const struct normals_ticks *ticks,
                  const struct noise_key *key)
{
    struct philox_tile t;
    struct normal_tile normal;
    const int64_t blocks = normals_stride(n) / 4, total = (blocks * ticks->count) << ticks->side;
    const uint32_t lanes = UINT32_C(1) << ticks->side;
    /* at / blocks is at * inverse >> 20 for the few counters that there are here. */
    const uint32_t inverse = (1u << 20) / (uint32_t)blocks + 1;
    assert(total <= ROWS_BLOCKS_MAX);
    for (int64_t start = 0; start < total; start += TILE) {
        for (int j = 0; j < TILE; j++) {
            uint32_t at = (uint32_t)start + (uint32_t)j, row = at * inverse >> 20;
            int64_t tick = ticks->first + (int64_t)(row >> ticks->side) * ticks->every;
            t.word[0][j] = at - row * (uint32_t)blocks;
            t.word[1][j] = (uint32_t)(key->realization + (row & (lanes - 1)));
            t.word[2][j] = (uint64_t)tick;
            t.word[3][j] = tick_high(key, tick);
        }
        philox_rounds(&t, key->seed);
        box_muller(&t, &normal);
        double *to = out + 4 * start;
        int count = total - start < TILE ? (int)(total - start) : TILE, j = 0;
        for (; j + 4 <= count; j += 4)
            turn(&normal, j, (four *)(to + 4 * j));
        for (; j < count; j++)
            for (int w = 0; w < 4; w++)
                to[4 * j + w] = normal.word[w][j];
    }
}

void philox_words(uint32_t *words, int64_t first, int64_t blocks, const struct noise_key *key,
                  int64_t tick)
{
    struct philox_tile t;
    for (int64_t start = 0; start < blocks; start += TILE) {
        philox_tile(&t, (uint32_t)(first + start), key, tick);
        for (int64_t j = 0; j < TILE && start + j < blocks; j++)
            for (int w = 0; w < 4; w++)
                words[4 * (start + j) + w] = (uint32_t)t.word[w][j];
    }
}
