/* SPDX-License-Identifier: GPL-3.0-or-later
 * log.c - see log.h. A line is put together on the stack and leaves with one write(). */
#include "log.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { LOG_LINE_BYTES = 4096, LOG_MS_PER_S = 1000 };

/* A line being built: used <= size - 2, so that newline and NUL always fit. */
struct line {
    char *text;
    size_t used, size;
};

static void add_char(struct line *line, char c)
{
    if (line->used + 2 < line->size)
        line->text[line->used++] = c;
}

static void add_text(struct line *line, const char *text)
{
    for (; *text; text++)
        add_char(line, *text);
}

static bool is_plain(const char *text)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "-_./:,+@%*";

    return *text && text[strspn(text, plain)] == '\0';
}

/* Whatever the bytes are, the value stays one value on one line. */
static void add_value(struct line *line, const char *text)
{
    static const char hex[] = "0123456789abcdef";

    if (!text)
        text = "-";
    if (is_plain(text)) {
        add_text(line, text);
        return;
    }
    add_char(line, '"');
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;

        if (c == '"' || c == '\\') {
            add_char(line, '\\');
            add_char(line, (char)c);
        } else if (c == '\n') {
            add_text(line, "\\n");
        } else if (c < 0x20 || c > 0x7e) {
            add_text(line, "\\x");
            add_char(line, hex[c >> 4]);
            add_char(line, hex[c & 15]);
        } else {
            add_char(line, (char)c);
        }
    }
    add_char(line, '"');
}

static void add_field(struct line *line, const struct log_field *field)
{
    char number[40];

    add_char(line, ' ');
    add_text(line, field->key);
    add_char(line, '=');
    switch (field->kind) {
    case LOG_KIND_TEXT:
        add_value(line, field->text);
        break;
    case LOG_KIND_INTEGER:
        snprintf(number, sizeof number, "%lld", (long long)field->integer);
        add_text(line, number);
        break;
    case LOG_KIND_NUMBER:
        snprintf(number, sizeof number, "%.6g", field->number);
        add_text(line, number);
        break;
    }
}

static void add_time(struct line *line, int64_t time_ms)
{
    time_t seconds = (time_t)(time_ms / LOG_MS_PER_S);
    struct tm utc;
    char date[32], text[48];

    if (!gmtime_r(&seconds, &utc) || !strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &utc))
        snprintf(date, sizeof date, "-");
    snprintf(text, sizeof text, "time=%s.%03dZ", date, (int)(time_ms % LOG_MS_PER_S));
    add_text(line, text);
}

size_t log_print(char *text, size_t size, int64_t time_ms, enum log_level level, const char *event,
                 const struct log_field *fields)
{
    static const char *const levels[] = {"info", "warning", "error"};
    struct line line = {.text = text, .size = size};

    add_time(&line, time_ms);
    add_text(&line, " level=");
    add_text(&line, levels[level]);
    add_text(&line, " event=");
    add_value(&line, event);
    for (; fields && fields->key; fields++)
        add_field(&line, fields);
    text[line.used++] = '\n';
    text[line.used] = '\0';
    return line.used;
}

void log_write(enum log_level level, const char *event, const struct log_field *fields)
{
    int kept = errno;
    struct timespec now;
    char text[LOG_LINE_BYTES];
    size_t length;
    ssize_t written;

    clock_gettime(CLOCK_REALTIME, &now);
    length =
        log_print(text, sizeof text, (int64_t)now.tv_sec * LOG_MS_PER_S + now.tv_nsec / 1000000,
                  level, event, fields);
    do
        written = write(STDERR_FILENO, text, length);
    while (written < 0 && errno == EINTR);
    /* A log that cannot be written has nobody left to be told. */
    errno = kept;
}
