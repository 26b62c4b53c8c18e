/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * philox_lanes.h - the rounds of philox.c for one width of vector, read once for each. To be
 * defined before, and gone afterwards: ROUNDS_NAME, ROUNDS_TARGET (an attribute or nothing), LANES,
 * PRODUCT(words, number): the low halves of the words times a number, whole.
 */
static ROUNDS_TARGET void ROUNDS_NAME(struct philox_tile *tile, uint64_t seed)
{
    typedef uint64_t words __attribute__((vector_size(8 * LANES), may_alias));
    for (int j = 0; j < PHILOX_TILE; j += LANES) {
        words a = *(words *)(tile->word[0] + j), b = *(words *)(tile->word[1] + j);
        words c = *(words *)(tile->word[2] + j), d = *(words *)(tile->word[3] + j);
        uint32_t k0 = (uint32_t)seed, k1 = (uint32_t)(seed >> 32);
        for (int round = 0; round < PHILOX_ROUNDS; round++) {
            words p0 = PRODUCT(a, 0xd2511f53), p1 = PRODUCT(c, 0xcd9e8d57);
            a = (p1 >> 32) ^ b ^ (uint64_t)k0;
            b = p1;
            c = (p0 >> 32) ^ d ^ (uint64_t)k1;
            d = p0;
            k0 += 0x9e3779b9u;
            k1 += 0xbb67ae85u;
        }
        *(words *)(tile->word[0] + j) = a;
        *(words *)(tile->word[1] + j) = b;
        *(words *)(tile->word[2] + j) = c;
        *(words *)(tile->word[3] + j) = d;
    }
}
#undef ROUNDS_NAME
#undef ROUNDS_TARGET
#undef LANES
#undef PRODUCT
