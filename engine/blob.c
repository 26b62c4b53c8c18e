/* SPDX-License-Identifier: GPL-3.0-or-later
 * blob.c - see blob.h. */
#include "blob.h"
#include "status.h"
#include "kernels/xxh64.h"

#include <string.h>

struct header {
    uint64_t magic;
    uint32_t kind, result_version;
    uint64_t identity, size, checksum, reserved;
};
_Static_assert(sizeof(struct header) == BLOB_HEADER_SIZE, "the header is what it says");

/* As bytes: "dbcdb01", whose checksum was an FNV-1a of everything, and "dbcdb02". What was written
 * before is read as ever. */
static const uint64_t magic_fnv = 0x31306264636264u, magic = 0x32306264636264u;

uint64_t blob_hash(const void *bytes, size_t size, uint64_t start)
{
    const unsigned char *at = bytes;
    uint64_t hash = start;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ at[i]) * 0x100000001b3u;
    return hash;
}

uint64_t blob_piece_sum(const void *piece, size_t size)
{
    return xxh64(piece, size, 0);
}

size_t blob_pieces(size_t size)
{
    return (size - BLOB_HEADER_SIZE + BLOB_PIECE_SIZE - 1) / BLOB_PIECE_SIZE;
}

static uint64_t sum_of_piece(const unsigned char *body, size_t body_size, size_t piece)
{
    size_t from = piece * BLOB_PIECE_SIZE, left = body_size - from;
    return blob_piece_sum(body + from, left < BLOB_PIECE_SIZE ? left : BLOB_PIECE_SIZE);
}

/* Over the header with its checksum left out, then the sums of the body's pieces: those given, or
 * those of the body given. */
static uint64_t checksum(const struct header *header, const uint64_t *sums,
                         const unsigned char *body)
{
    struct header plain = *header;
    plain.checksum = 0;
    uint64_t hash = xxh64(&plain, sizeof plain, 0);
    size_t size = (size_t)header->size;
    for (size_t i = 0; i < blob_pieces(size); i++) {
        uint64_t sum = sums ? sums[i] : sum_of_piece(body, size - BLOB_HEADER_SIZE, i);
        hash = xxh64(&sum, sizeof sum, hash);
    }
    return hash;
}

static uint64_t checksum_fnv(const struct header *header, const unsigned char *body)
{
    struct header plain = *header;
    plain.checksum = 0;
    uint64_t hash = blob_hash(&plain, sizeof plain, BLOB_HASH_START);
    return blob_hash(body, (size_t)header->size - sizeof plain, hash);
}

static void seal(void *head, const struct header *plain, const uint64_t *sums)
{
    struct header header = *plain;
    header.magic = magic;
    header.result_version = BCD_RESULT_VERSION;
    header.checksum = checksum(&header, sums, (unsigned char *)head + BLOB_HEADER_SIZE);
    memcpy(head, &header, sizeof header);
}

void blob_seal(void *bytes, enum blob_kind kind, uint64_t identity, size_t size)
{
    const struct header plain = {.kind = (uint32_t)kind, .identity = identity, .size = size};
    seal(bytes, &plain, NULL);
}

void blob_seal_pieces(void *head, const struct blob_pieces *of)
{
    const struct header plain = {
        .kind = (uint32_t)of->kind, .identity = of->identity, .size = of->size};
    seal(head, &plain, of->sums);
}

static bool sound(const struct header *header, const unsigned char *bytes)
{
    const unsigned char *body = bytes + BLOB_HEADER_SIZE;
    return header->checksum ==
           (header->magic == magic ? checksum(header, NULL, body) : checksum_fnv(header, body));
}

enum bcd_status blob_check(const void *bytes, enum blob_kind kind, uint64_t identity, size_t size,
                           struct bcd_error *error)
{
    struct header header;
    if (size < sizeof header)
        return error_set(error, BCD_CORRUPT, "", "%zu bytes are too few for a header", size);
    memcpy(&header, bytes, sizeof header);
    if (header.magic != magic && header.magic != magic_fnv)
        return error_set(error, BCD_CORRUPT, "", "not data of bcdd");
    if (header.kind >> 16 != (uint32_t)kind >> 16)
        return error_set(error, BCD_CORRUPT, "", "data of another kind");
    if (header.kind != (uint32_t)kind)
        return error_set(error, BCD_CORRUPT, "", "layout %u, this program knows layout %u",
                         header.kind & 0xffff, (unsigned)kind & 0xffff);
    if (header.size != size)
        return error_set(error, BCD_CORRUPT, "", "%zu bytes, but its header says %llu", size,
                         (unsigned long long)header.size);
    if (!sound(&header, bytes))
        return error_set(error, BCD_CORRUPT, "", "checksum does not match: the data is damaged");
    if (header.identity != identity)
        return error_set(error, BCD_CORRUPT, "", "it belongs to another job or chunk");
    if (kind != BLOB_TABLE && header.result_version != BCD_RESULT_VERSION)
        return error_set(error, BCD_CORRUPT, "", "made by result version %u, this program is %d",
                         header.result_version, BCD_RESULT_VERSION);
    return BCD_OK;
}
