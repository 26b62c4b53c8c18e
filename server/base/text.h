/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * text.h - text that grows. Errors stick: after the first failed allocation nothing more is added
 * and text_take() gives NULL, so that writers need no check after each piece.
 */
#ifndef TEXT_H
#define TEXT_H

#include <stdbool.h>
#include <stddef.h>

struct text {
    char *bytes; /* NUL-terminated once something was added */
    size_t size, room;
    bool failed;
};

/* printf-style. Not for %f, %g: their decimal point depends on the locale. */
void text_add(struct text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
void text_add_bytes(struct text *text, const char *bytes, size_t size);

/* A number as json_number.h writes it. */
void text_add_number(struct text *text, double v);

/* A string of JSON, quotes included; of XML, escaped for content and attribute values alike. Bytes
 * that are not UTF-8, or not allowed in XML, become U+FFFD. */
void text_add_json_string(struct text *text, const char *string);
void text_add_xml(struct text *text, const char *string);

/* The finished text, malloc'ed and now the caller's ("" when nothing was added); NULL = out of
 * memory. The struct is empty afterwards. */
char *text_take(struct text *text);

/* Length of the UTF-8 sequence that starts here, 0 when it is none. Never reads past a NUL. */
size_t text_utf8(const char *bytes);

#endif
