/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_column.h - the values that one scalar has in the jobs of a segment, as a blob. For store*.c
 * only.
 *
 * A blob is a sorted dictionary of the distinct values and a code for each job: nothing where all
 * jobs have the one value (most scalars of a sweep), else one byte or two. Little-endian:
 *
 *   0  version (1)   1  bytes of a code: 0, 1, 2   2  uint16 values in the dictionary
 *   4  a byte each: enum scalar_type      then 8 bytes each: the number, or where the text begins
 *      (uint32, within the texts) and its length (uint32)
 *   then 1024 codes, all bits set = no value; then the texts
 */
#ifndef STORE_COLUMN_H
#define STORE_COLUMN_H

#include "store_scalar.h"

enum {
    SEGMENT_BITS = 10,
    SEGMENT_JOBS = 1 << SEGMENT_BITS, /* 005_find.sql has it too */
    COLUMN_NONE = 2 * SEGMENT_JOBS,
};

/* Decoded. The dictionary has room for a value of each job beside those of the blob. */
struct column {
    size_t count;
    struct scalar entry[2 * SEGMENT_JOBS];
    uint16_t code[SEGMENT_JOBS]; /* COLUMN_NONE = no value */
};

/* No job has a value. */
void column_clear(struct column *column);
/* Another value of a job instead of the one it had. At most once a job. */
void column_put(struct column *column, size_t job, const struct scalar *value);
/* The value of a job. */
struct scalar column_get(const struct column *column, size_t job);

/* As a blob, malloc'ed; NULL = out of memory. */
void *column_encode(const struct column *column, size_t *size);

/* False = that is no column. Texts are borrowed from the blob. */
bool column_decode(struct column *column, const void *bytes, size_t size);

/* Strikes out of wanted the jobs whose values are not accepted, without decoding the rest: the
 * dictionary is searched, not read. place tells where a value stands: < 0 below what is accepted, 0
 * accepted, > 0 above, numbers among numbers and texts among texts; `negate`: all others are
 * accepted; `none`: jobs without a value are. False = that is no column. */
struct column_filter {
    int (*place)(const void *context, const struct scalar *value);
    const void *context;
    bool negate, none;
};
bool column_narrow(const void *bytes, size_t size, const struct column_filter *filter,
                   bool wanted[SEGMENT_JOBS]);

/* The value of one job (SCALAR_NONE = it has none), without looking at the rest; a text is borrowed
 * from the blob. False = that is no column. */
bool column_value(const void *bytes, size_t size, size_t job, struct scalar *value);

/* The smallest and the largest value of a blob, without looking at the rest. */
bool column_ends(const void *bytes, size_t size, struct scalar *least, struct scalar *most);

#endif
