/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * normals.h - noise from a counter, not from a state: Philox4x32-10 (Salmon et al., SC'11,
 * doi 10.1145/2063384.2063405) and Box-Muller. The normal of rod i at a tick is a pure function of
 * (seed, realization, stream, tick, i), whatever was drawn before: runs can be cut anywhere.
 *
 * Counter words: {i / 4, realization, tick low, stream << 24 | tick high}; key: seed. One counter
 * gives four 32-bit words, two Box-Muller pairs, four normals (reach: 6.76 standard deviations).
 */
#ifndef KERNELS_NORMALS_H
#define KERNELS_NORMALS_H

#include <stdbool.h>
#include <stdint.h>

struct noise_key {
    uint64_t seed;
    uint32_t realization;
    uint8_t stream; /* separates uses: 0 = steps, 1 = initial configuration, ... */
    bool doubled;   /* noise.h: a step is two ticks long and takes the noise of both */
    /* noise.h: of 2^side realizations that go side by side this is number `lane`; all: what is
     * meant is this one, number 0, and those after it. */
    uint8_t side, lane;
    bool all;
};

/* out[i] += scale * normal(i), i = 0 .. n-1, for one tick (0 <= tick < 2^56), n < 2^34. */
void normals_add(double *out, int64_t n, double scale, const struct noise_key *key, int64_t tick);

/* The same for rods first .. first + count - 1 alone, out[0] the first of them; first is a multiple
 * of 4. */
struct normals_stretch {
    int64_t first, count;
};
void normals_add_stretch(double *out, const struct normals_stretch *stretch, double scale,
                         const struct noise_key *key, int64_t tick);

static inline int64_t normals_stride(int64_t n)
{
    return (n + 3) / 4 * 4;
}

/* The same normals, unscaled, for several ticks and realizations at once: row t 2^side + r of out
 * holds those of tick first + t every and realization key->realization + r, r < 2^side; rows are
 * normals_stride(n) apart (the rest of a row is filled too). For small n, where one tick leaves
 * most of a vector register idle. */
struct normals_ticks {
    int64_t first, every, count; /* count 2^side normals_stride(n) <= 2048 */
    int side;
};
void normals_rows(double *out, int64_t n, const struct normals_ticks *ticks,
                  const struct noise_key *key);

/* words[4 * j + w] = word w of the Philox block of counter {first + j, ...}, j = 0 .. blocks-1. */
void philox_words(uint32_t *words, int64_t first, int64_t blocks, const struct noise_key *key,
                  int64_t tick);

#endif
