/* SPDX-License-Identifier: GPL-3.0-or-later
 * base64.h - bytes as text (RFC 4648, with padding), and back. */
#ifndef BASE64_H
#define BASE64_H

#include <stdbool.h>
#include <stddef.h>

/* malloc'ed, NUL-terminated; NULL = out of memory. */
char *base64_print(const void *bytes, size_t size);

/* The one text that stands for some bytes, and no other: false when it is none, or there is no
 * memory. *bytes is malloc'ed (never NULL, also for no bytes). */
bool base64_parse(const char *text, size_t length, void **bytes, size_t *size);

#endif
