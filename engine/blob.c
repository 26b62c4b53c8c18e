/* SPDX-License-Identifier: GPL-3.0-or-later
 * blob.c - see blob.h. */
#include "blob.h"
#include "status.h"

#include <string.h>

struct header {
    uint64_t magic;
    uint32_t kind, result_version;
    uint64_t identity, size, checksum, reserved;
};
_Static_assert(sizeof(struct header) == BLOB_HEADER_SIZE, "the header is what it says");

static const uint64_t magic = 0x31306264636264u; /* "dbcdb01" as bytes */

uint64_t blob_hash(const void *bytes, size_t size, uint64_t start)
{
    const unsigned char *at = bytes;
    uint64_t hash = start;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ at[i]) * 0x100000001b3u;
    return hash;
}

/* Over the header with its checksum left out, then the body. */
static uint64_t checksum(const struct header *header, const unsigned char *bytes, size_t size)
{
    struct header plain = *header;
    plain.checksum = 0;
    uint64_t hash = blob_hash(&plain, sizeof plain, BLOB_HASH_START);
    return blob_hash(bytes + sizeof plain, size - sizeof plain, hash);
}

void blob_seal(void *bytes, enum blob_kind kind, uint64_t identity, size_t size)
{
    struct header header = {.magic = magic,
                            .kind = (uint32_t)kind,
                            .result_version = BCD_RESULT_VERSION,
                            .identity = identity,
                            .size = size};
    header.checksum = checksum(&header, bytes, size);
    memcpy(bytes, &header, sizeof header);
}

enum bcd_status blob_check(const void *bytes, enum blob_kind kind, uint64_t identity, size_t size,
                           struct bcd_error *error)
{
    struct header header;
    if (size < sizeof header)
        return error_set(error, BCD_CORRUPT, "", "%zu bytes are too few for a header", size);
    memcpy(&header, bytes, sizeof header);
    if (header.magic != magic)
        return error_set(error, BCD_CORRUPT, "", "not data of bcdd");
    if (header.kind >> 16 != (uint32_t)kind >> 16)
        return error_set(error, BCD_CORRUPT, "", "data of another kind");
    if (header.kind != (uint32_t)kind)
        return error_set(error, BCD_CORRUPT, "", "layout %u, this program knows layout %u",
                         header.kind & 0xffff, (unsigned)kind & 0xffff);
    if (header.size != size)
        return error_set(error, BCD_CORRUPT, "", "%zu bytes, but its header says %llu", size,
                         (unsigned long long)header.size);
    if (header.checksum != checksum(&header, bytes, size))
        return error_set(error, BCD_CORRUPT, "", "checksum does not match: the data is damaged");
    if (header.identity != identity)
        return error_set(error, BCD_CORRUPT, "", "it belongs to another job or chunk");
    if (kind != BLOB_TABLE && header.result_version != BCD_RESULT_VERSION)
        return error_set(error, BCD_CORRUPT, "", "made by result version %u, this program is %d",
                         header.result_version, BCD_RESULT_VERSION);
    return BCD_OK;
}
