/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "json_lines.h"
#include "text.h"

#include <stdlib.h>

enum { LINE_COLUMNS = 100 }; /* an object or list that is shorter stays on one line */

static size_t skip_string(const char *json, size_t at);
static size_t end_of_value(const char *json, size_t at);
static void add_inline(struct text *text, const char *json, size_t from, size_t to);

char *json_lines_take(char *json)
{
    struct text text = {0};
    size_t indent = 0;
    for (size_t at = 0; json && json[at];) {
        char c = json[at];
        size_t end = at + 1;
        if (c == '"') {
            end = skip_string(json, at);
            text_add_bytes(&text, json + at, end - at);
        } else if (c == '{' || c == '[') {
            size_t whole = end_of_value(json, at);
            if (whole - at + 2 * indent <= LINE_COLUMNS) {
                add_inline(&text, json, at, whole);
                end = whole;
            } else {
                text_add(&text, "%c\n%*s", c, (int)(2 * ++indent), "");
            }
        } else if (c == '}' || c == ']') {
            text_add(&text, "\n%*s%c", (int)(2 * --indent), "", c);
        } else if (c == ',') {
            text_add(&text, ",\n%*s", (int)(2 * indent), "");
        } else if (c == ':') {
            text_add(&text, ": ");
        } else if (c != '\n') {
            text_add_bytes(&text, json + at, 1);
        }
        at = end;
    }
    bool given = json != NULL;
    free(json);
    text_add(&text, "\n");
    char *lines = text_take(&text);
    if (given)
        return lines;
    free(lines);
    return NULL;
}

/* Past the string that begins here. */
static size_t skip_string(const char *json, size_t at)
{
    for (at++; json[at] && json[at] != '"'; at++)
        at += json[at] == '\\' && json[at + 1];
    return json[at] ? at + 1 : at;
}

/* Past the object or list that begins here. */
static size_t end_of_value(const char *json, size_t at)
{
    size_t depth = 0;
    do {
        if (json[at] == '"') {
            at = skip_string(json, at);
            continue;
        }
        depth += json[at] == '{' || json[at] == '[';
        depth -= json[at] == '}' || json[at] == ']';
        at++;
    } while (json[at] && depth > 0);
    return at;
}

static void add_inline(struct text *text, const char *json, size_t from, size_t to)
{
    while (from < to) {
        size_t end = json[from] == '"' ? skip_string(json, from) : from + 1;
        text_add_bytes(text, json + from, end - from);
        if (json[from] == ',' || json[from] == ':')
            text_add_bytes(text, " ", 1);
        from = end;
    }
}
