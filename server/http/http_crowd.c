/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_crowd.c - room for those who come. The library takes so many connections and no more, each
 * of its threads an equal share, and whoever comes then waits for another to go: idle connections,
 * or slow ones, would keep everybody else out until their time is over. So it is over early where
 * there is hardly room: whoever has been idle for a moment goes first, then whoever is slow with a
 * request, then whoever does not take an answer, each the longest first. Nobody who has just come
 * is ended by this, and no request whose answer is made, held or taken: where there are too many of
 * those, others wait.
 */
#include "http_internal.h"
#include "log.h"

#include <stdlib.h>

enum {
    SHARE_MAX = LIMIT_CONNECTIONS_MAX / LIMIT_HTTP_THREADS,
    SHARE_CROWDED = SHARE_MAX * 4 / 5, /* threads do not have equal shares of them */
    SHARE_KEPT = SHARE_MAX * 2 / 3,
};
_Static_assert(LIMIT_CONNECTIONS_KEPT < LIMIT_CONNECTIONS_CROWDED &&
                   LIMIT_CONNECTIONS_CROWDED < LIMIT_CONNECTIONS_MAX,
               "room is kept");

/* One that can go; a smaller turn goes first, of equal ones the older. */
struct leaver {
    struct connection *c;
    int turn;
};

static size_t thread_of_caller(struct http *http);
static bool is_crowded(const struct http *http, size_t thread);
static bool is_kept(const struct http *http, size_t thread);
static int turn_of(const struct connection *c, int64_t now_ms);
static int compare(const void *a, const void *b);

void http_crowd_add(struct http *http, struct connection *c)
{
    c->next = http->connections;
    if (c->next)
        c->next->previous = c;
    http->connections = c;
    c->thread = thread_of_caller(http);
    http->threads[c->thread].connections++;
    http->open++;
    bool crowded = is_crowded(http, c->thread);
    http->crowded |= crowded;
    if (!c->next || crowded)
        pthread_cond_signal(&http->wake_reaper); /* it may sleep for good */
}

void http_crowd_remove(struct http *http, struct connection *c)
{
    if (c->deadline_ms != INT64_MAX)
        http_crowd_leave(http, c);
    if (c->next)
        c->next->previous = c->previous;
    if (c->previous)
        c->previous->next = c->next;
    else
        http->connections = c->next;
}

void http_crowd_leave(struct http *http, struct connection *c)
{
    http->threads[c->thread].connections--;
    http->open--;
}

/* Connections begin on the thread of the library that will serve them. */
static size_t thread_of_caller(struct http *http)
{
    pthread_t id = pthread_self();
    size_t i = 0;
    while (i < http->thread_count && !pthread_equal(http->threads[i].id, id))
        i++;
    if (i == http->thread_count && i < LIMIT_HTTP_THREADS)
        http->threads[http->thread_count++].id = id;
    return i < LIMIT_HTTP_THREADS ? i : 0;
}

void http_crowd_thin(struct http *http, int64_t now_ms)
{
    static const char busy[] = "HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\n" //
        HTTP_REAP_HEADERS "\r\n";
    struct leaver leavers[LIMIT_CONNECTIONS_MAX];
    size_t count = 0, ended = 0;
    bool crowded[LIMIT_HTTP_THREADS] = {false};
    if (!http->crowded)
        return;
    for (size_t i = 0; i < http->thread_count; i++)
        crowded[i] = is_crowded(http, i);
    for (struct connection *c = http->connections; c && count < LIMIT_CONNECTIONS_MAX;
         c = c->next) {
        int turn = crowded[c->thread] && c->deadline_ms != INT64_MAX ? turn_of(c, now_ms) : 0;
        if (turn > 0)
            leavers[count++] = (struct leaver){.c = c, .turn = turn};
    }
    qsort(leavers, count, sizeof(leavers[0]), compare);
    http->crowded = false;
    for (size_t i = 0; i < count; i++) {
        if (is_kept(http, leavers[i].c->thread))
            continue;
        http_reap_end(http, leavers[i].c, busy);
        ended++;
    }
    for (size_t i = 0; i < http->thread_count; i++)
        http->crowded |= is_crowded(http, i);
    if (ended > 0)
        log_write(LOG_LEVEL_WARNING, "connections_crowded",
                  LOG_FIELDS(log_integer("ended", (int64_t)ended)));
}

/* All together, or those of a thread, are too many. */
static bool is_crowded(const struct http *http, size_t thread)
{
    return http->open >= LIMIT_CONNECTIONS_CROWDED ||
           http->threads[thread].connections >= SHARE_CROWDED;
}

/* There is room enough again. */
static bool is_kept(const struct http *http, size_t thread)
{
    return http->open <= LIMIT_CONNECTIONS_KEPT && http->threads[thread].connections <= SHARE_KEPT;
}

/* 0 = not at all. */
static int turn_of(const struct connection *c, int64_t now_ms)
{
    bool answers = c->phase == PHASE_ANSWERING;
    int64_t since_ms = answers ? c->stalled_ms : c->phase_ms;
    if (since_ms == 0 || now_ms < since_ms + LIMIT_CROWDED_IDLE_MS)
        return 0;
    return answers ? 3 : c->phase == PHASE_RECEIVING ? 2 : 1;
}

static int compare(const void *a, const void *b)
{
    const struct leaver *x = a, *y = b;
    if (x->turn != y->turn)
        return x->turn < y->turn ? -1 : 1;
    return (x->c->phase_ms > y->c->phase_ms) - (x->c->phase_ms < y->c->phase_ms);
}
