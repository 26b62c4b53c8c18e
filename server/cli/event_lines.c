/* SPDX-License-Identifier: GPL-3.0-or-later
 * As in the WHATWG's standard (html.spec.whatwg.org, 9.2.6), with the fields event and data alone.
 */
#include "event_lines.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void take_line(struct event_lines *lines, const char *line);
static void dispatch(struct event_lines *lines);

bool event_lines_add(struct event_lines *lines, const char *bytes, size_t size)
{
    while (size > 0) {
        const char *end = memchr(bytes, '\n', size);
        size_t length = end ? (size_t)(end - bytes) : size;
        if (lines->line.size + lines->data.size + length > EVENT_DATA_BYTES_MAX)
            return false;
        text_add_bytes(&lines->line, bytes, length);
        bytes += length + (end != NULL);
        size -= length + (end != NULL);
        if (!end)
            break;
        char *line = text_take(&lines->line);
        if (!line)
            return false;
        line[strcspn(line, "\r")] = '\0';
        take_line(lines, line);
        free(line);
    }
    return !lines->line.failed && !lines->data.failed;
}

void event_lines_fini(struct event_lines *lines)
{
    free(text_take(&lines->line));
    free(text_take(&lines->data));
    lines->name[0] = '\0';
    lines->any_data = false;
}

static void take_line(struct event_lines *lines, const char *line)
{
    size_t field = strcspn(line, ":");
    const char *value = line + field + (line[field] == ':');
    value += *value == ' ';
    if (*line == '\0') {
        dispatch(lines);
    } else if (field == 5 && memcmp(line, "event", 5) == 0) {
        snprintf(lines->name, sizeof lines->name, "%s", value);
    } else if (field == 4 && memcmp(line, "data", 4) == 0) {
        text_add(&lines->data, "%s%s", lines->any_data ? "\n" : "", value);
        lines->any_data = true;
    } /* comments have an empty field, and others are none of ours */
}

static void dispatch(struct event_lines *lines)
{
    char *data = text_take(&lines->data);
    if (data && lines->any_data)
        lines->take(lines->context, lines->name[0] ? lines->name : "message", data);
    free(data);
    lines->name[0] = '\0';
    lines->any_data = false;
}
