/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_scalar.h - numbers and words that jobs are found and sorted by. For store*.c only.
 *
 * Numbers come before texts, and nothing (SCALAR_NONE) after both. Integers are exact up to 64 bits
 * and compare with reals by value. true and false are the texts "true" and "false".
 */
#ifndef STORE_SCALAR_H
#define STORE_SCALAR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct text;

enum scalar_type { SCALAR_NONE, SCALAR_INTEGER, SCALAR_REAL, SCALAR_TEXT };
struct scalar {
    enum scalar_type type;
    uint32_t length; /* of a text; it is borrowed and need not end in NUL */
    union {
        int64_t integer;
        double real;
        const char *text;
    };
};

struct scalar scalar_integer(int64_t value);
struct scalar scalar_real(double value);
struct scalar scalar_text(const char *text, size_t length);

/* < 0, 0, > 0; both orders put SCALAR_NONE last. */
int scalar_compare(const struct scalar *a, const struct scalar *b, bool descending);

/* What a user wrote: a number where it is one as a whole, else a text. */
struct scalar scalar_parse(const char *text);

enum { SCALAR_PATH_SIZE = 160 };

/* Calls visit for every scalar in a JSON object, at any depth but not within lists, with its dotted
 * path after `prefix` and the text that stands there; null is no scalar. The JSON was made by this
 * program: one that is none ends the walk early. */
typedef void scalar_visit(void *context, const char *path, const char *token, size_t length);
void scalar_walk(const char *json, const char *prefix, scalar_visit *visit, void *context);

/* The value of such a token. A text with escapes goes to scratch, others are borrowed. */
struct scalar scalar_read(const char *token, size_t length, struct text *scratch);

#endif
