/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "stream_events.h"
#include "limits.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

struct live {
    struct events events;
    struct text text; /* written and not handed out: from `used` on */
    size_t used;
    enum events_next then;
    int64_t next_ms, ping_ms;
};

static ssize_t read_live(void *state, char *to, size_t size);
static bool write_more(struct live *live);
static bool is_ready(void *state);
static void free_live(void *state);
static int64_t now_ms(void);

struct stream stream_events_take(const struct events *events)
{
    struct live *live = calloc(1, sizeof(*live));
    if (!live) {
        events->free(events->state);
        return (struct stream){0};
    }
    live->events = *events;
    live->then = EVENTS_MORE; /* the first */
    live->ping_ms = now_ms() + LIMIT_PING_MS;
    return (struct stream){.read = read_live, .ready = is_ready, .free = free_live, .state = live};
}

static ssize_t read_live(void *state, char *to, size_t size)
{
    struct live *live = state;
    if (live->used == live->text.size && live->then != EVENTS_END && !write_more(live))
        return STREAM_FAILED;
    size_t left = live->text.size - live->used;
    size_t given = left < size ? left : size;
    if (given == 0)
        return live->then == EVENTS_END ? STREAM_END : STREAM_LATER;
    memcpy(to, live->text.bytes + live->used, given);
    live->used += given;
    return (ssize_t)given;
}

/* False = out of memory. */
static bool write_more(struct live *live)
{
    int64_t now = now_ms();
    live->text.size = live->used = 0;
    if (live->then == EVENTS_MORE || now >= live->next_ms) {
        do
            live->then = live->events.next(live->events.state, &live->text);
        while (live->then == EVENTS_MORE && live->text.size == 0 && !live->text.failed);
        live->next_ms = now + LIMIT_EVENTS_GAP_MS;
    }
    if (live->text.size == 0 && live->then == EVENTS_LATER && now >= live->ping_ms)
        text_add(&live->text, ": ping\n\n");
    if (live->text.size > 0)
        live->ping_ms = now + LIMIT_PING_MS;
    return !live->text.failed;
}

static bool is_ready(void *state)
{
    struct live *live = state;
    int64_t now = now_ms();
    return now >= live->next_ms && (now >= live->ping_ms || live->events.fresh(live->events.state));
}

static void free_live(void *state)
{
    struct live *live = state;
    free(live->text.bytes);
    live->events.free(live->events.state);
    free(live);
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
