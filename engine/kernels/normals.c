/* SPDX-License-Identifier: GPL-3.0-or-later
 * normals.c - see normals.h. Works in tiles of 64 counters laid out word by word, so that every
 * loop below runs over one array after the other and the compiler vectorises it. */
#include "normals.h"
#include "elementary.h"
#include "simd.h"

#include <math.h>

enum { TILE = 64, ROUNDS = 10 };

struct tile {
    uint32_t word[4][TILE];
};

static inline uint32_t tick_high(const struct noise_key *key, int64_t tick)
{
    return (uint32_t)key->stream << 24 | (uint32_t)((uint64_t)tick >> 32);
}

/* Philox4x32-10 of the counters that stand in the tile. */
static inline __attribute__((always_inline)) void philox_rounds(struct tile *t, uint64_t seed)
{
    const uint64_t m0 = 0xd2511f53u, m1 = 0xcd9e8d57u;
    uint32_t k0 = (uint32_t)seed, k1 = (uint32_t)(seed >> 32);
    for (int round = 0; round < ROUNDS; round++) {
        for (int j = 0; j < TILE; j++) {
            uint64_t p0 = m0 * t->word[0][j], p1 = m1 * t->word[2][j];
            uint32_t c1 = t->word[1][j], c3 = t->word[3][j];
            t->word[0][j] = (uint32_t)(p1 >> 32) ^ c1 ^ k0;
            t->word[1][j] = (uint32_t)p1;
            t->word[2][j] = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
            t->word[3][j] = (uint32_t)p0;
        }
        k0 += 0x9e3779b9u;
        k1 += 0xbb67ae85u;
    }
}

/* The blocks first .. first + TILE - 1 of one tick. */
static inline __attribute__((always_inline)) void philox_tile(struct tile *t, uint32_t first,
                                                              const struct noise_key *key,
                                                              int64_t tick)
{
    for (int j = 0; j < TILE; j++) {
        t->word[0][j] = first + (uint32_t)j;
        t->word[1][j] = key->realization;
        t->word[2][j] = (uint32_t)tick;
        t->word[3][j] = tick_high(key, tick);
    }
    philox_rounds(t, key->seed);
}

/* Box-Muller: radius from `u`, angle from `v`; sine and cosine by own polynomials
 * (elementary.h). */
static inline __attribute__((always_inline)) void pair_tile(const uint32_t *u, const uint32_t *v,
                                                            double *sines, double *cosines)
{
    const double unit = 0x1p-32;
    for (int j = 0; j < TILE; j++) {
        /* (w + 1/2) 2^-32 lies strictly inside (0, 1). 2^52 + w is exact: no conversion needed. */
        double half_up = from_bits(0x4330000000000000u | u[j]) - (4503599627370496.0 - 0.5);
        double uniform = half_up * unit;
        double radius = sqrt(-2.0 * log_normal(uniform));
        double turn = (from_bits(0x4330000000000000u | v[j]) - 4503599627370496.0) * unit - 0.5;
        sines[j] = radius * sin_half(turn);
        cosines[j] = radius * cos_half(turn);
    }
}

KERNEL_CLONES
void normals_add(double *out, int64_t n, double scale, const struct noise_key *key, int64_t tick)
{
    struct tile t;
    double normal[4][TILE];
    for (int64_t start = 0; start < n; start += 4 * TILE) {
        philox_tile(&t, (uint32_t)(start / 4), key, tick);
        pair_tile(t.word[0], t.word[1], normal[0], normal[1]);
        pair_tile(t.word[2], t.word[3], normal[2], normal[3]);
        double *to = out + start;
        if (n - start >= 4 * TILE) {
            for (int j = 0; j < TILE; j++)
                for (int w = 0; w < 4; w++)
                    to[4 * j + w] += scale * normal[w][j];
        } else {
            for (int64_t i = 0; i < n - start; i++)
                to[i] += scale * normal[i % 4][i / 4];
        }
    }
}

KERNEL_CLONES
void normals_rows(double *out, int64_t n, int64_t rows, const struct noise_key *key, int64_t first)
{
    struct tile t;
    double normal[4][TILE];
    const int64_t blocks = normals_stride(n) / 4, total = blocks * rows;
    int64_t block = 0, tick = first; /* of the next counter */
    for (int64_t start = 0; start < total; start += TILE) {
        for (int j = 0; j < TILE; j++) {
            t.word[0][j] = (uint32_t)block;
            t.word[1][j] = key->realization;
            t.word[2][j] = (uint32_t)tick;
            t.word[3][j] = tick_high(key, tick);
            block = block + 1 < blocks ? block + 1 : 0;
            tick += block == 0;
        }
        philox_rounds(&t, key->seed);
        pair_tile(t.word[0], t.word[1], normal[0], normal[1]);
        pair_tile(t.word[2], t.word[3], normal[2], normal[3]);
        double *to = out + 4 * start;
        int count = total - start < TILE ? (int)(total - start) : TILE;
        for (int j = 0; j < count; j++)
            for (int w = 0; w < 4; w++)
                to[4 * j + w] = normal[w][j];
    }
}

void philox_words(uint32_t *words, int64_t first, int64_t blocks, const struct noise_key *key,
                  int64_t tick)
{
    struct tile t;
    for (int64_t start = 0; start < blocks; start += TILE) {
        philox_tile(&t, (uint32_t)(first + start), key, tick);
        for (int64_t j = 0; j < TILE && start + j < blocks; j++)
            for (int w = 0; w < 4; w++)
                words[4 * (start + j) + w] = t.word[w][j];
    }
}
