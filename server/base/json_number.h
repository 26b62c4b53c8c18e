/* SPDX-License-Identifier: GPL-3.0-or-later
 * json_number.h - the one way in which a number leaves the service, in JSON and in CSV. */
#ifndef JSON_NUMBER_H
#define JSON_NUMBER_H

#include <stddef.h>

enum { JSON_NUMBER_SIZE = 32 }; /* room for every number and its final NUL */

/* Writes the shortest decimal text that reads back as the same double, NUL-terminated, into `out`
 * (JSON_NUMBER_SIZE bytes) and returns its length. "null" for NaN and infinities, which JSON cannot
 * say. Negative zero keeps its sign ("-0.0"). The decimal point is a point in every locale. */
size_t json_number_print(char *out, double v);

#endif
