/* SPDX-License-Identifier: GPL-3.0-or-later
 * philox.c - see philox.h. Compilers do not find the instruction that multiplies the low halves of
 * 64-bit words, so that it is named, once for each width of vector; the widest that the processor
 * has is taken. */
#include "philox.h"

enum { PHILOX_ROUNDS = 10 };

#ifdef __x86_64__
#include <immintrin.h>

#define ROUNDS_NAME rounds_of_two
#define ROUNDS_TARGET
#define LANES 2
#define PRODUCT(words_, by) ((words)_mm_mul_epu32((__m128i)(words_), _mm_set1_epi64x(by)))
#include "philox_lanes.h"

#define ROUNDS_NAME rounds_of_four
#define ROUNDS_TARGET __attribute__((target("avx2")))
#define LANES 4
#define PRODUCT(words_, by) ((words)_mm256_mul_epu32((__m256i)(words_), _mm256_set1_epi64x(by)))
#include "philox_lanes.h"

#define ROUNDS_NAME rounds_of_eight
#define ROUNDS_TARGET __attribute__((target("avx512f")))
#define LANES 8
#define PRODUCT(words_, by) ((words)_mm512_mul_epu32((__m512i)(words_), _mm512_set1_epi64(by)))
#include "philox_lanes.h"

void philox_rounds(struct philox_tile *tile, uint64_t seed)
{
    if (__builtin_cpu_supports("avx512f"))
        rounds_of_eight(tile, seed);
    else if (__builtin_cpu_supports("avx2"))
        rounds_of_four(tile, seed);
    else
        rounds_of_two(tile, seed);
}

#else

#define ROUNDS_NAME rounds_of_any
#define ROUNDS_TARGET
#define LANES 2
#define PRODUCT(words_, by) (((words_)&0xffffffffu) * by)
#include "philox_lanes.h"

void philox_rounds(struct philox_tile *tile, uint64_t seed)
{
    rounds_of_any(tile, seed);
}

#endif
