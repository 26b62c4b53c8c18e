/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * blob.h - the frame around everything that is kept as bytes (checkpoints, tallies, tables):
 * magic, kind with its version, result version, identity of what it belongs to, size, checksum.
 * The checksum is one of the sums of the body's pieces, so that whoever keeps pieces apart and has
 * changed a few needs no others to seal the whole.
 * Little-endian, as the machines this runs on; other byte orders fail the magic.
 */
#ifndef BLOB_H
#define BLOB_H

#include "bcd.h"

enum { BLOB_HEADER_SIZE = 48, BLOB_PIECE_SIZE = BCD_CHECKPOINT_PIECE };

/* Kind in the upper, version in the lower half: a new layout raises the version. */
enum blob_kind {
    BLOB_CHECKPOINT = 1 << 16 | 1,
    BLOB_TALLY = 2 << 16 | 2,
    BLOB_TABLE = 3 << 16 | 1,
};

/* 64-bit FNV-1a: of names and places, not of anything long. */
uint64_t blob_hash(const void *bytes, size_t size, uint64_t start);
#define BLOB_HASH_START 0xcbf29ce484222325u

/* Writes the header in front of the body that already stands at bytes + BLOB_HEADER_SIZE. size
 * counts both. identity = what this belongs to (0 = nothing in particular). */
void blob_seal(void *bytes, enum blob_kind kind, uint64_t identity, size_t size);

/* The same for a body that stands elsewhere, in pieces of BLOB_PIECE_SIZE (the last one may be
 * shorter) with these sums: writes the header alone. */
struct blob_pieces {
    enum blob_kind kind;
    uint64_t identity;
    size_t size; /* header included */
    const uint64_t *sums;
};
void blob_seal_pieces(void *head, const struct blob_pieces *of);
/* How many there are of a blob of that size; the sum of one. */
size_t blob_pieces(size_t size);
uint64_t blob_piece_sum(const void *piece, size_t size);

/* Everything a header can tell about bytes that come from outside. */
enum bcd_status blob_check(const void *bytes, enum blob_kind kind, uint64_t identity, size_t size,
                           struct bcd_error *error);

#endif
