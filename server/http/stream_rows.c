/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "stream_rows.h"

#include <stdlib.h>
#include <string.h>

struct pending {
    struct rows rows;
    struct text text; /* written and not handed out: from `used` on */
    size_t used;
    bool ended, failed;
};

static ssize_t read_rows(void *state, char *to, size_t size);
static void free_rows(void *state);

struct stream stream_rows_take(const struct rows *rows)
{
    struct pending *pending = calloc(1, sizeof(*pending));
    if (!pending) {
        if (rows->free)
            rows->free(rows->state);
        return (struct stream){0};
    }
    pending->rows = *rows;
    return (struct stream){.read = read_rows, .free = free_rows, .state = pending};
}

static ssize_t read_rows(void *state, char *to, size_t size)
{
    struct pending *pending = state;
    struct text *text = &pending->text;
    while (!pending->ended && text->size - pending->used < size) {
        if (pending->used > 0)
            memmove(text->bytes, text->bytes + pending->used, text->size - pending->used);
        text->size -= pending->used;
        pending->used = 0;
        pending->ended = !pending->rows.next(pending->rows.state, text, &pending->failed);
        if (text->failed || pending->failed)
            return STREAM_FAILED;
    }
    size_t left = text->size - pending->used;
    size_t given = left < size ? left : size;
    if (given == 0)
        return STREAM_END;
    memcpy(to, text->bytes + pending->used, given);
    pending->used += given;
    return (ssize_t)given;
}

static void free_rows(void *state)
{
    struct pending *pending = state;
    free(pending->text.bytes);
    if (pending->rows.free)
        pending->rows.free(pending->rows.state);
    free(pending);
}
