/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "dump_json.h"

#include <jansson.h>

#include <stdlib.h>
#include <string.h>

/* The library writes 17 digits; they are read and written anew, all else is copied. */
void dump_json_add(struct text *text, const json_t *value)
{
    char *json = json_dumps(value, JSON_ENCODE_ANY | JSON_COMPACT | JSON_REAL_PRECISION(17));
    text->failed |= !json;
    for (const char *c = json; c && *c;) {
        size_t size = strcspn(c, "\"-0123456789"); /* brackets, commas, words */
        if (size == 0 && *c == '"') {
            for (size = 1; c[size] != '"'; size++)
                size += c[size] == '\\';
            size++;
        } else if (size == 0) {
            size = strspn(c, "+-0123456789.eE");
            if (strcspn(c, ".eE") < size) {
                text_add_number(text, strtod(c, NULL));
                c += size;
                continue;
            }
        }
        text_add_bytes(text, c, size);
        c += size;
    }
    free(json);
}
