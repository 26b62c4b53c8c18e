/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * philox.h - the counter-based generator Philox4x32-10, many counters at once (Salmon et al.,
 * SC'11, doi 10.1145/2063384.2063405).
 */
#ifndef KERNELS_PHILOX_H
#define KERNELS_PHILOX_H

#include <stdint.h>

enum { PHILOX_TILE = 64 };

/* word[w][j] = word w of counter j, in the low half; the high half is anything. Processors multiply
 * halves of 64 bits without moving them about: words stay apart by so much. */
struct philox_tile {
    _Alignas(64) uint64_t word[4][PHILOX_TILE];
};

/* Counters in, random words out. */
void philox_rounds(struct philox_tile *tile, uint64_t seed);

#endif
