/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * scan_json.h - what a JSON reader no longer knows once the text is a tree: where in the text
 * something stood, and which numbers were not kept. Works on the text alone, valid JSON or not.
 */
#ifndef SCAN_JSON_H
#define SCAN_JSON_H

#include "bcd.h"

enum { SCAN_POINTER_SIZE = 96 }; /* as struct bcd_error.field: longer pointers are cut */

/* Appends "/key" to a JSON pointer of at most SCAN_POINTER_SIZE bytes, escaped (RFC 6901), whole
 * characters only, with an ellipsis where it had to be cut. */
void scan_json_append(char *pointer, const char *key);

/* Deepest nesting of brackets. */
size_t scan_json_depth(const char *text);

/* Adds a fault for each number and word that starts before `end` and that a double cannot hold:
 * 1e400, integers beyond 64 bits, 1e-400 (which would silently become 0), NaN, Infinity. Returns
 * how many. text is NUL-terminated. */
size_t scan_json_numbers(const char *text, size_t end, struct bcd_errors *errors);

/* Pointer of the key whose text ends at byte `end` (its closing quote is the byte before); false
 * when there is none. */
bool scan_json_key(const char *text, size_t end, char pointer[SCAN_POINTER_SIZE]);

#endif
