/* SPDX-License-Identifier: GPL-3.0-or-later
 * xxh64.c - see xxh64.h. Names and steps are those of the specification. */
#include "xxh64.h"

#include <string.h>

static const uint64_t prime1 = 0x9e3779b185ebca87u, prime2 = 0xc2b2ae3d27d4eb4fu,
                      prime3 = 0x165667b19e3779f9u, prime4 = 0x85ebca77c2b2ae63u,
                      prime5 = 0x27d4eb2f165667c5u;

static uint64_t turn(uint64_t x, int bits)
{
    return x << bits | x >> (64 - bits);
}

static uint64_t lane_at(const unsigned char *at)
{
    uint64_t lane;
    memcpy(&lane, at, sizeof lane);
    return lane;
}

static uint64_t mix(uint64_t acc, uint64_t lane)
{
    return turn(acc + lane * prime2, 31) * prime1;
}

static uint64_t merge(uint64_t acc, uint64_t lane)
{
    return (acc ^ mix(0, lane)) * prime1 + prime4;
}

/* What is left of whole stripes, and the last mixing of all. */
static uint64_t finish(uint64_t acc, const unsigned char *at, size_t left)
{
    for (; left >= 8; left -= 8, at += 8)
        acc = turn(acc ^ mix(0, lane_at(at)), 27) * prime1 + prime4;
    if (left >= 4) {
        uint32_t half;
        memcpy(&half, at, sizeof half);
        acc = turn(acc ^ half * prime1, 23) * prime2 + prime3;
        left -= 4, at += 4;
    }
    for (; left > 0; left--, at++)
        acc = turn(acc ^ *at * prime5, 11) * prime1;
    acc = (acc ^ acc >> 33) * prime2;
    acc = (acc ^ acc >> 29) * prime3;
    return acc ^ acc >> 32;
}

uint64_t xxh64(const void *bytes, size_t size, uint64_t seed)
{
    const unsigned char *at = bytes;
    uint64_t a = seed + prime1 + prime2, b = seed + prime2, c = seed, d = seed - prime1;
    size_t left = size;
    if (size < 32)
        return finish(seed + prime5 + size, at, size);
    for (; left >= 32; left -= 32, at += 32) {
        a = mix(a, lane_at(at));
        b = mix(b, lane_at(at + 8));
        c = mix(c, lane_at(at + 16));
        d = mix(d, lane_at(at + 24));
    }
    uint64_t acc = turn(a, 1) + turn(b, 7) + turn(c, 12) + turn(d, 18);
    acc = merge(merge(merge(merge(acc, a), b), c), d);
    return finish(acc + size, at, left);
}
