/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "zip_stored.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum {
    VERSION = 45,   /* knows 64-bit sizes */
    FLAGS = 1 << 3, /* checksum and sizes follow the file */
    MADE_BY_UNIX = 3 << 8,
    DATE = 1 << 5 | 1, /* 1980-01-01: the same results are the same archive */
    EXTRA_64 = 1,
};
static const uint32_t ELSEWHERE = 0xffffffff; /* see the extra field */

/* Little-endian numbers one after another. */
struct bytes {
    unsigned char at[128];
    size_t size;
};

static void put(struct bytes *bytes, uint64_t value, size_t size)
{
    assert(bytes->size + size <= sizeof(bytes->at));
    for (size_t i = 0; i < size; i++)
        bytes->at[bytes->size++] = (unsigned char)(value >> 8 * i);
}

static void flush(struct zip *zip, struct text *text, const struct bytes *bytes)
{
    text_add_bytes(text, (const char *)bytes->at, bytes->size);
    zip->written += bytes->size;
}

static void add_name(struct zip *zip, struct text *text, const struct zip_file *file)
{
    text_add_bytes(text, file->name, strlen(file->name));
    zip->written += strlen(file->name);
}

/* CRC-32 (ISO 3309), four bits at a time: reflected polynomial 0xedb88320. */
static uint32_t crc_of(uint32_t crc, const unsigned char *bytes, size_t size)
{
    static const uint32_t table[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac,
                                       0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
                                       0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                       0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    crc = ~crc;
    for (size_t i = 0; i < size; i++) {
        crc = table[(crc ^ bytes[i]) & 15] ^ crc >> 4;
        crc = table[(crc ^ (uint32_t)bytes[i] >> 4) & 15] ^ crc >> 4;
    }
    return ~crc;
}

/* What local headers and the directory have in common, from the version on. */
static void put_head(struct bytes *bytes, const struct zip_file *file, size_t extra)
{
    put(bytes, VERSION, 2);
    put(bytes, FLAGS, 2);
    put(bytes, 0, 2); /* stored */
    put(bytes, 0, 2); /* midnight */
    put(bytes, DATE, 2);
    put(bytes, file->crc, 4); /* 0 in local headers: not known yet */
    put(bytes, ELSEWHERE, 4);
    put(bytes, ELSEWHERE, 4);
    put(bytes, strlen(file->name), 2);
    put(bytes, extra + 4, 2);
}

void zip_begin_file(struct zip *zip, struct text *text, const char *name, uint64_t size)
{
    struct bytes head = {.size = 0}, extra = {.size = 0};
    assert(zip->count < ZIP_FILES_MAX);
    struct zip_file *file = &zip->files[zip->count++];
    *file = (struct zip_file){.offset = zip->written, .size = size};
    snprintf(file->name, sizeof(file->name), "%s", name);
    put(&head, 0x04034b50, 4);
    put_head(&head, file, 16);
    flush(zip, text, &head);
    add_name(zip, text, file);
    put(&extra, EXTRA_64, 2);
    put(&extra, 16, 2);
    put(&extra, size, 8);
    put(&extra, size, 8);
    flush(zip, text, &extra);
}

void zip_add(struct zip *zip, struct text *text, const void *bytes, size_t size)
{
    struct zip_file *file = &zip->files[zip->count - 1];
    file->crc = crc_of(file->crc, bytes, size);
    text_add_bytes(text, bytes, size);
    zip->written += size;
}

void zip_end_file(struct zip *zip, struct text *text)
{
    const struct zip_file *file = &zip->files[zip->count - 1];
    struct bytes descriptor = {.size = 0};
    put(&descriptor, 0x08074b50, 4);
    put(&descriptor, file->crc, 4);
    put(&descriptor, file->size, 8);
    put(&descriptor, file->size, 8);
    flush(zip, text, &descriptor);
}

void zip_end(struct zip *zip, struct text *text)
{
    uint64_t directory = zip->written;
    for (size_t i = 0; i < zip->count; i++) {
        const struct zip_file *file = &zip->files[i];
        struct bytes head = {.size = 0}, extra = {.size = 0};
        put(&head, 0x02014b50, 4);
        put(&head, MADE_BY_UNIX | VERSION, 2);
        put_head(&head, file, 24);
        put(&head, 0, 2);                       /* no comment */
        put(&head, 0, 2);                       /* the first disk */
        put(&head, 0, 2);                       /* no text */
        put(&head, (uint64_t)0100644 << 16, 4); /* a file that its owner may write */
        put(&head, ELSEWHERE, 4);
        flush(zip, text, &head);
        add_name(zip, text, file);
        put(&extra, EXTRA_64, 2);
        put(&extra, 24, 2);
        put(&extra, file->size, 8);
        put(&extra, file->size, 8);
        put(&extra, file->offset, 8);
        flush(zip, text, &extra);
    }
    uint64_t end = zip->written;
    struct bytes tail = {.size = 0};
    put(&tail, 0x06064b50, 4); /* the 64-bit end, */
    put(&tail, 44, 8);
    put(&tail, MADE_BY_UNIX | VERSION, 2);
    put(&tail, VERSION, 2);
    put(&tail, 0, 8);
    put(&tail, zip->count, 8);
    put(&tail, zip->count, 8);
    put(&tail, end - directory, 8);
    put(&tail, directory, 8);
    put(&tail, 0x07064b50, 4); /* where it is, */
    put(&tail, 0, 4);
    put(&tail, end, 8);
    put(&tail, 1, 4);
    put(&tail, 0x06054b50, 4); /* and the end that all readers look for */
    put(&tail, 0, 4);
    put(&tail, zip->count, 2);
    put(&tail, zip->count, 2);
    put(&tail, ELSEWHERE, 4);
    put(&tail, ELSEWHERE, 4);
    put(&tail, 0, 2);
    flush(zip, text, &tail);
}
