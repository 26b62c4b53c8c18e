/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * log.h - one structured line per event to stderr:
 *
 *   time=2026-01-31T12:00:00.123Z level=info event=job_started job=jabc chunks=4
 *
 * Values that hold anything but harmless characters are quoted, and every byte of them that is not
 * printable ASCII is escaped, so that nothing from outside can forge a line or reach a terminal.
 * Never hand in a secret.
 *
 *   log_write(LOG_LEVEL_INFO, "job_started", LOG_FIELDS(log_text("job", id), log_integer("chunks",
 * n))); log_write(LOG_LEVEL_INFO, "stopping", NULL);
 *
 * THREADS  Any thread; one write() per line, so lines never mix.
 */
#ifndef LOG_H
#define LOG_H

#include <stddef.h>
#include <stdint.h>

enum log_level { LOG_LEVEL_INFO, LOG_LEVEL_WARNING, LOG_LEVEL_ERROR };

enum log_kind { LOG_KIND_TEXT, LOG_KIND_INTEGER, LOG_KIND_NUMBER };
struct log_field {
    const char *key; /* [a-z_]+; NULL ends a list */
    enum log_kind kind;
    const char *text; /* NULL is shown as "-" */
    int64_t integer;
    double number;
};

static inline struct log_field log_text(const char *key, const char *text)
{
    return (struct log_field){.key = key, .kind = LOG_KIND_TEXT, .text = text};
}

static inline struct log_field log_integer(const char *key, int64_t integer)
{
    return (struct log_field){.key = key, .kind = LOG_KIND_INTEGER, .integer = integer};
}

static inline struct log_field log_number(const char *key, double number)
{
    return (struct log_field){.key = key, .kind = LOG_KIND_NUMBER, .number = number};
}

#define LOG_FIELDS(...) ((const struct log_field[]){__VA_ARGS__, {.key = NULL}})

/* fields may be NULL. A line that would grow too long is cut off, never split. errno is kept. */
void log_write(enum log_level level, const char *event, const struct log_field *fields);

/* The line as log_write would send it, newline included, at `time_ms` since 1970 UTC. Writes at
 * most size - 1 bytes and a NUL (size > 1); returns the length written. */
size_t log_print(char *line, size_t size, int64_t time_ms, enum log_level level, const char *event,
                 const struct log_field *fields);

#endif
