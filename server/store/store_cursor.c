/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_cursor.c - see store_cursor.h. Bytes: checksum[8] type[1] seq[8] value[8], or a text[]. */
#include "store_cursor.h"

#include <endian.h>
#include <stdlib.h>
#include <string.h>

enum { SUM_BYTES = 8, HEAD_BYTES = SUM_BYTES + 1 + 8, TEXT_BYTES_MAX = 1 << 16 };

/* FNV-1a: against slips of the hand, not against malice; whoever forges one sees another page of
 * what is his to see. */
static uint64_t checksum(const unsigned char *bytes, size_t size, const char *sort)
{
    uint64_t sum = 0xcbf29ce484222325u;

    for (size_t i = SUM_BYTES; i < size; i++)
        sum = (sum ^ bytes[i]) * 0x100000001b3u;
    for (; *sort; sort++)
        sum = (sum ^ (unsigned char)*sort) * 0x100000001b3u;
    return sum;
}

static void put(unsigned char *to, uint64_t value)
{
    value = htole64(value);
    memcpy(to, &value, sizeof value);
}

static uint64_t get(const unsigned char *from)
{
    uint64_t value;

    memcpy(&value, from, sizeof value);
    return le64toh(value);
}

static size_t value_bytes(const struct scalar *value)
{
    return value->type == SCALAR_NONE ? 0 : value->type == SCALAR_TEXT ? value->length : 8;
}

char *cursor_print(const struct place *place, const char *sort)
{
    static const char digits[] = "0123456789abcdef";
    size_t size = HEAD_BYTES + value_bytes(&place->value);
    unsigned char *bytes = calloc(1, size);
    char *text = malloc(2 * size + 1);

    if (!bytes || !text) {
        free(bytes);
        free(text);
        return NULL;
    }
    bytes[SUM_BYTES] = (unsigned char)place->value.type;
    put(bytes + SUM_BYTES + 1, (uint64_t)place->seq);
    if (place->value.type == SCALAR_TEXT)
        memcpy(bytes + HEAD_BYTES, place->value.text, place->value.length);
    else if (place->value.type != SCALAR_NONE)
        put(bytes + HEAD_BYTES, (uint64_t)place->value.integer); /* or the real in its place */
    put(bytes, checksum(bytes, size, sort));
    for (size_t i = 0; i < size; i++) {
        text[2 * i] = digits[bytes[i] >> 4];
        text[2 * i + 1] = digits[bytes[i] & 15];
    }
    text[2 * size] = '\0';
    free(bytes);
    return text;
}

static int digit(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The bytes of an even number of digits, malloc'ed; NULL where it is none. */
static unsigned char *read_hex(const char *text, size_t size)
{
    unsigned char *bytes = malloc(size + 1);

    for (size_t i = 0; bytes && i < size; i++) {
        int high = digit(text[2 * i]), low = digit(text[2 * i + 1]);

        if (high < 0 || low < 0) {
            free(bytes);
            return NULL;
        }
        bytes[i] = (unsigned char)(high << 4 | low);
    }
    return bytes;
}

bool cursor_parse(const char *text, const char *sort, struct place *place)
{
    size_t length = strlen(text), size = length / 2;
    unsigned char *bytes = NULL;
    struct place found = {0};
    bool sound = length % 2 == 0 && size >= HEAD_BYTES && size <= HEAD_BYTES + TEXT_BYTES_MAX;

    if (sound)
        bytes = read_hex(text, size);
    sound = bytes && get(bytes) == checksum(bytes, size, sort) && bytes[SUM_BYTES] <= SCALAR_TEXT;
    if (sound) {
        found.value.type = (enum scalar_type)bytes[SUM_BYTES];
        found.value.length = (uint32_t)(size - HEAD_BYTES);
        found.seq = (int64_t)get(bytes + SUM_BYTES + 1);
        sound = value_bytes(&found.value) == size - HEAD_BYTES;
    }
    if (sound && found.value.type == SCALAR_TEXT) {
        char *copy = malloc(found.value.length + 1);

        if (copy)
            memcpy(copy, bytes + HEAD_BYTES, found.value.length);
        found.value.text = copy;
        sound = copy != NULL;
    } else if (sound && found.value.type != SCALAR_NONE) {
        found.value.integer = (int64_t)get(bytes + HEAD_BYTES);
    }
    free(bytes);
    if (sound)
        *place = found;
    return sound;
}
