/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base64.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

char *base64_print(const void *bytes, size_t size)
{
    const unsigned char *from = bytes;
    char *text = malloc((size + 2) / 3 * 4 + 1), *to = text;
    if (!text)
        return NULL;
    for (size_t i = 0; i < size; i += 3) {
        size_t left = size - i < 3 ? size - i : 3;
        uint32_t three = (uint32_t)from[i] << 16;
        three |= left > 1 ? (uint32_t)from[i + 1] << 8 : 0;
        three |= left > 2 ? from[i + 2] : 0;
        *to++ = letters[three >> 18];
        *to++ = letters[three >> 12 & 63];
        *to++ = left > 1 ? letters[three >> 6 & 63] : '=';
        *to++ = left > 2 ? letters[three & 63] : '=';
    }
    *to = '\0';
    return text;
}

bool base64_parse(const char *text, size_t length, void **bytes, size_t *size)
{
    signed char value[256];
    size_t padding = length >= 4 && text[length - 1] == '=' ? 1 + (text[length - 2] == '=') : 0;
    unsigned char *made = length % 4 == 0 ? malloc(length / 4 * 3 + 1) : NULL, *to = made;
    if (!made)
        return false;
    memset(value, -1, sizeof(value));
    for (int i = 0; i < 64; i++)
        value[(unsigned char)letters[i]] = (signed char)i;
    for (size_t i = 0; i < length; i += 4) {
        uint32_t four = 0;
        size_t pad = i + 4 == length ? padding : 0;
        bool good = true;
        for (size_t j = 0; j < 4; j++) {
            int digit = j < 4 - pad ? value[(unsigned char)text[i + j]] : 0;
            good = good && digit >= 0;
            four = four << 6 | (uint32_t)(digit & 63);
        }
        /* Bits that no byte needs are zero, or two texts would stand for the same bytes. */
        if (!good || (pad == 1 && (four & 0xff)) || (pad == 2 && (four & 0xffff))) {
            free(made);
            return false;
        }
        *to++ = (unsigned char)(four >> 16);
        *to++ = (unsigned char)(four >> 8);
        *to++ = (unsigned char)four;
        to -= pad;
    }
    *bytes = made;
    *size = (size_t)(to - made);
    return true;
}
