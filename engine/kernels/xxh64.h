/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * xxh64.h - a 64-bit checksum of eight bytes at a time: XXH64 (Y. Collet, "xxHash fast digest
 * algorithm", github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md). Tells damage, not malice.
 */
#ifndef KERNELS_XXH64_H
#define KERNELS_XXH64_H

#include <stddef.h>
#include <stdint.h>

uint64_t xxh64(const void *bytes, size_t size, uint64_t seed);

#endif
