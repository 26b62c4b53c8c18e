/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "text.h"
#include "json_number.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REPLACEMENT "\xEF\xBF\xBD" /* U+FFFD */

static bool reserve(struct text *text, size_t more);

void text_add(struct text *text, const char *format, ...)
{
    va_list args;
    if (!strchr(format, '%')) {
        text_add_bytes(text, format, strlen(format));
        return;
    }
    if (text->failed)
        return;
    size_t left = text->bytes ? text->room - text->size : 0; /* as a rule it fits */
    va_start(args, format);
    int size = vsnprintf(left ? text->bytes + text->size : NULL, left, format, args);
    va_end(args);
    if (size < 0)
        text->failed = true;
    if (size < 0 || ((size_t)size >= left && !reserve(text, (size_t)size)))
        return;
    if ((size_t)size >= left) {
        va_start(args, format);
        vsnprintf(text->bytes + text->size, (size_t)size + 1, format, args);
        va_end(args);
    }
    text->size += (size_t)size;
}

void text_add_bytes(struct text *text, const char *bytes, size_t size)
{
    if (!reserve(text, size))
        return;
    memcpy(text->bytes + text->size, bytes, size);
    text->size += size;
    text->bytes[text->size] = '\0';
}

void text_add_number(struct text *text, double v)
{
    char number[JSON_NUMBER_SIZE];
    text_add_bytes(text, number, json_number_print(number, v));
}

void text_add_json_string(struct text *text, const char *string)
{
    text_add_bytes(text, "\"", 1);
    for (const char *c = string; *c;) {
        size_t plain = 0, length = text_utf8(c);
        while (c[plain] >= ' ' && c[plain] < 0x7F && c[plain] != '"' && c[plain] != '\\')
            plain++;
        if (plain > 0)
            text_add_bytes(text, c, length = plain);
        else if (length == 0)
            text_add_bytes(text, REPLACEMENT, 3);
        else if (*c == '"' || *c == '\\')
            text_add(text, "\\%c", *c);
        else if ((unsigned char)*c < 0x20)
            text_add(text, "\\u%04x", (unsigned)*c);
        else
            text_add_bytes(text, c, length);
        c += length ? length : 1;
    }
    text_add_bytes(text, "\"", 1);
}

void text_add_xml(struct text *text, const char *string)
{
    for (const char *c = string; *c;) {
        size_t length = text_utf8(c);
        bool control = (unsigned char)*c < 0x20 && !strchr("\t\n\r", *c);
        bool noncharacter =
            length == 3 && (!memcmp(c, "\xEF\xBF\xBE", 3) || !memcmp(c, "\xEF\xBF\xBF", 3));
        if (length == 0 || control || noncharacter)
            text_add_bytes(text, REPLACEMENT, 3);
        else if (strchr("<>&\"'", *c))
            text_add(text, "&#%d;", *c);
        else
            text_add_bytes(text, c, length);
        c += length ? length : 1;
    }
}

char *text_take(struct text *text)
{
    text_add_bytes(text, "", 0);
    char *bytes = text->bytes;
    char *fitted = bytes && text->room > 2 * text->size ? realloc(bytes, text->size + 1) : NULL;
    bytes = fitted ? fitted : bytes;
    if (text->failed) {
        free(bytes);
        bytes = NULL;
    }
    *text = (struct text){0};
    return bytes;
}

size_t text_utf8(const char *bytes)
{
    const unsigned char *c = (const unsigned char *)bytes;
    size_t length = c[0] < 0x80 ? 1 : c[0] < 0xC2 ? 0 : c[0] < 0xE0 ? 2 : c[0] < 0xF0 ? 3 : 4;
    if (c[0] == '\0' || c[0] > 0xF4)
        return 0;
    for (size_t i = 1; i < length; i++)
        if ((c[i] & 0xC0) != 0x80)
            return 0;
    /* Too long for what it says, a surrogate, or beyond U+10FFFF. */
    bool wrong = (c[0] == 0xE0 && c[1] < 0xA0) || (c[0] == 0xED && c[1] > 0x9F) ||
                 (c[0] == 0xF0 && c[1] < 0x90) || (c[0] == 0xF4 && c[1] > 0x8F);
    return wrong ? 0 : length;
}

/* Room for `more` bytes and a final NUL. */
static bool reserve(struct text *text, size_t more)
{
    if (text->failed)
        return false;
    if (more > SIZE_MAX / 4 - text->size)
        text->failed = true;
    else if (text->size + more + 1 > text->room) {
        size_t room = 2 * (text->size + more + 1) + 256;
        char *bytes = realloc(text->bytes, room);
        if (bytes) {
            text->bytes = bytes;
            text->room = room;
        } else {
            text->failed = true;
        }
    }
    return !text->failed;
}
