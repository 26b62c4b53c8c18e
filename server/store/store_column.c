/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_column.c - see store_column.h. */
#include "store_column.h"

#include <assert.h>
#include <endian.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER_BYTES = 4, VERSION = 1, NARROW_NONE = 0xFF, WIDE_NONE = 0xFFFF };

void column_clear(struct column *column)
{
    column->count = 0;
    for (size_t i = 0; i < SEGMENT_JOBS; i++)
        column->code[i] = COLUMN_NONE;
}

void column_put(struct column *column, size_t job, const struct scalar *value)
{
    assert(column->count < sizeof column->entry / sizeof column->entry[0] && job < SEGMENT_JOBS);
    /* Neighbours are mostly alike. */
    if (job > 0 && column->code[job - 1] != COLUMN_NONE &&
        scalar_compare(&column->entry[column->code[job - 1]], value, false) == 0) {
        column->code[job] = column->code[job - 1];
        return;
    }
    column->entry[column->count] = *value;
    column->code[job] = (uint16_t)column->count++;
}

struct scalar column_get(const struct column *column, size_t job)
{
    return column->code[job] == COLUMN_NONE ? (struct scalar){.type = SCALAR_NONE}
                                            : column->entry[column->code[job]];
}

/* ----------------------------------------------------------------- as bytes */

static int compare_entries(const void *a, const void *b)
{
    const struct scalar *const *x = a, *const *y = b;

    return scalar_compare(*x, *y, false);
}

/* The entries that some job has, in order, and without repetition; place[i] = where entry i went.
 */
static size_t sort_entries(const struct column *column, const struct scalar *order[],
                           uint16_t place[])
{
    bool used[2 * SEGMENT_JOBS] = {false};
    size_t count = 0, kept = 0;

    for (size_t i = 0; i < SEGMENT_JOBS; i++)
        if (column->code[i] != COLUMN_NONE)
            used[column->code[i]] = true;
    for (size_t i = 0; i < column->count; i++)
        if (used[i])
            order[count++] = &column->entry[i];
    qsort(order, count, sizeof order[0], compare_entries);
    for (size_t i = 0; i < count; i++) {
        if (i == 0 || scalar_compare(order[kept - 1], order[i], false) != 0)
            order[kept++] = order[i];
        place[order[i] - column->entry] = (uint16_t)(kept - 1);
    }
    return kept;
}

static size_t code_width(const struct column *column, size_t values)
{
    bool all = values == 1;

    for (size_t i = 0; i < SEGMENT_JOBS && all; i++)
        all = column->code[i] != COLUMN_NONE;
    return all ? 0 : values < NARROW_NONE ? 1 : 2;
}

static uint64_t pack(const struct scalar *value, size_t *text_bytes)
{
    uint64_t bits = 0;

    if (value->type == SCALAR_TEXT) {
        bits = *text_bytes | (uint64_t)value->length << 32;
        *text_bytes += value->length;
    } else {
        memcpy(&bits, &value->integer, sizeof bits); /* or the real in its place */
    }
    return htole64(bits);
}

static void put_code(unsigned char *codes, size_t width, size_t job, uint16_t code)
{
    if (width == 1)
        codes[job] = code == WIDE_NONE ? NARROW_NONE : (unsigned char)code;
    if (width == 2)
        memcpy(codes + 2 * job, &(uint16_t){htole16(code)}, 2);
}

void *column_encode(const struct column *column, size_t *size)
{
    const struct scalar *order[2 * SEGMENT_JOBS];
    uint16_t place[2 * SEGMENT_JOBS];
    size_t values = sort_entries(column, order, place), width = code_width(column, values);
    size_t codes = HEADER_BYTES + 9 * values, texts = codes + width * SEGMENT_JOBS;
    size_t text_bytes = 0;
    unsigned char *bytes;

    for (size_t i = 0; i < values; i++)
        text_bytes += order[i]->type == SCALAR_TEXT ? order[i]->length : 0;
    bytes = malloc(texts + text_bytes);
    if (!bytes)
        return NULL;
    *size = texts + text_bytes;
    bytes[0] = VERSION;
    bytes[1] = (unsigned char)width;
    memcpy(bytes + 2, &(uint16_t){htole16((uint16_t)values)}, 2);
    text_bytes = 0;
    for (size_t i = 0; i < values; i++) {
        size_t begin = text_bytes;
        uint64_t bits = pack(order[i], &text_bytes);

        bytes[HEADER_BYTES + i] = (unsigned char)order[i]->type;
        memcpy(bytes + HEADER_BYTES + values + 8 * i, &bits, 8);
        if (order[i]->type == SCALAR_TEXT)
            memcpy(bytes + texts + begin, order[i]->text, order[i]->length);
    }
    for (size_t i = 0; i < SEGMENT_JOBS; i++)
        put_code(bytes + codes, width, i,
                 column->code[i] == COLUMN_NONE ? WIDE_NONE : place[column->code[i]]);
    return bytes;
}

/* Where the parts of a blob are; false when they do not fit into it. */
struct layout {
    const unsigned char *bytes;
    size_t size, width, values, codes, texts;
};

static bool lay_out(struct layout *layout, const void *bytes, size_t size)
{
    const unsigned char *at = bytes;
    uint16_t values;

    if (size < HEADER_BYTES || at[0] != VERSION || at[1] > 2)
        return false;
    memcpy(&values, at + 2, 2);
    *layout =
        (struct layout){.bytes = bytes, .size = size, .width = at[1], .values = le16toh(values)};
    layout->codes = HEADER_BYTES + 9 * layout->values;
    layout->texts = layout->codes + layout->width * SEGMENT_JOBS;
    return layout->values >= 1 && layout->values <= SEGMENT_JOBS && layout->texts <= size;
}

static bool unpack(const struct layout *layout, size_t i, struct scalar *value)
{
    uint64_t bits, begin, length;

    value->type = (enum scalar_type)layout->bytes[HEADER_BYTES + i];
    memcpy(&bits, layout->bytes + HEADER_BYTES + layout->values + 8 * i, 8);
    bits = le64toh(bits);
    if (value->type == SCALAR_INTEGER || value->type == SCALAR_REAL) {
        memcpy(&value->integer, &bits, sizeof bits);
        return true;
    }
    begin = layout->texts + (bits & UINT32_MAX);
    length = bits >> 32;
    if (value->type != SCALAR_TEXT || begin + length > layout->size)
        return false;
    *value = scalar_text((const char *)layout->bytes + begin, length);
    return true;
}

static uint16_t get_code(const struct layout *layout, size_t job)
{
    uint16_t code;

    if (layout->width == 1) {
        code = layout->bytes[layout->codes + job];
        return code == NARROW_NONE ? COLUMN_NONE : code;
    }
    memcpy(&code, layout->bytes + layout->codes + 2 * job, 2);
    code = le16toh(code);
    return code == WIDE_NONE ? COLUMN_NONE : code;
}

bool column_decode(struct column *column, const void *bytes, size_t size)
{
    struct layout layout;
    bool sound = lay_out(&layout, bytes, size);

    if (!sound)
        return false;
    column->count = layout.values;
    for (size_t i = 0; i < layout.values && sound; i++)
        sound = unpack(&layout, i, &column->entry[i]);
    if (layout.width == 0) {
        memset(column->code, 0, sizeof column->code);
        return sound;
    }
    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        column->code[i] = get_code(&layout, i);
        sound = sound && (column->code[i] < layout.values || column->code[i] == COLUMN_NONE);
    }
    return sound;
}

/* The first entry from `low` on that stands at or above `least`, of those before `high`. */
static size_t search(const struct layout *layout, const struct column_filter *filter, int least,
                     size_t low, size_t high)
{
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        struct scalar value;

        if (unpack(layout, middle, &value) && filter->place(filter->context, &value) < least)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Codes that are accepted: two ranges, for a dictionary has numbers and then texts. */
struct accepted {
    uint16_t first[2], count[2];
    bool negate, none;
};

/* Compares and nothing else in the loops, so that the compiler takes many codes at a time. */
static void narrow_bytes(const struct accepted *accepted, const uint8_t *restrict codes,
                         uint8_t *restrict wanted)
{
    const uint8_t a = (uint8_t)accepted->first[0], b = (uint8_t)accepted->first[1];
    const uint8_t as = (uint8_t)accepted->count[0], bs = (uint8_t)accepted->count[1];
    const uint8_t negate = accepted->negate, none = accepted->none;

    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        uint8_t code = codes[i], from_a = (uint8_t)(code - a), from_b = (uint8_t)(code - b);
        uint8_t met = (uint8_t)((from_a < as) | (from_b < bs)) ^ negate;

        wanted[i] &= code == NARROW_NONE ? none : met;
    }
}

static void narrow_words(const struct accepted *accepted, const unsigned char *bytes,
                         uint8_t *restrict wanted)
{
    const uint16_t a = accepted->first[0], b = accepted->first[1];
    const uint16_t as = accepted->count[0], bs = accepted->count[1];
    const uint8_t negate = accepted->negate, none = accepted->none;
    uint16_t codes[SEGMENT_JOBS];

    memcpy(codes, bytes, sizeof codes);
    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        uint16_t code = le16toh(codes[i]);
        uint16_t from_a = (uint16_t)(code - a), from_b = (uint16_t)(code - b);
        uint8_t met = (uint8_t)((from_a < as) | (from_b < bs)) ^ negate;

        wanted[i] &= code == WIDE_NONE ? none : met;
    }
}

bool column_narrow(const void *bytes, size_t size, const struct column_filter *filter,
                   bool wanted[SEGMENT_JOBS])
{
    const unsigned char *types = (const unsigned char *)bytes + HEADER_BYTES;
    struct accepted accepted = {.negate = filter->negate, .none = filter->none};
    const unsigned char *text;
    struct layout layout;
    size_t numbers;

    if (!lay_out(&layout, bytes, size))
        return false;
    text = memchr(types, SCALAR_TEXT, layout.values);
    numbers = text ? (size_t)(text - types) : layout.values;
    for (int texts = 0; texts < 2; texts++) {
        size_t from = texts ? numbers : 0, to = texts ? layout.values : numbers;
        size_t first = search(&layout, filter, 0, from, to);

        accepted.first[texts] = (uint16_t)first;
        accepted.count[texts] = (uint16_t)(search(&layout, filter, 1, first, to) - first);
    }
    if (accepted.count[0] + accepted.count[1] == 0 && !filter->negate && !filter->none)
        memset(wanted, false, SEGMENT_JOBS);
    else if (layout.width == 1)
        narrow_bytes(&accepted, layout.bytes + layout.codes, (uint8_t *)wanted);
    else if (layout.width == 2)
        narrow_words(&accepted, layout.bytes + layout.codes, (uint8_t *)wanted);
    else if ((accepted.count[0] + accepted.count[1] > 0) == filter->negate)
        memset(wanted, false, SEGMENT_JOBS);
    return true;
}

bool column_value(const void *bytes, size_t size, size_t job, struct scalar *value)
{
    struct layout layout;
    uint16_t code = 0;

    if (!lay_out(&layout, bytes, size))
        return false;
    if (layout.width > 0)
        code = get_code(&layout, job);
    *value = (struct scalar){.type = SCALAR_NONE};
    return code == COLUMN_NONE || (code < layout.values && unpack(&layout, code, value));
}

bool column_ends(const void *bytes, size_t size, struct scalar *least, struct scalar *most)
{
    struct layout layout;

    return lay_out(&layout, bytes, size) && unpack(&layout, 0, least) &&
           unpack(&layout, layout.values - 1, most);
}
