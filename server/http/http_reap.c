/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_reap.c - the thread that ends connections past their deadline with shutdown(): the library
 * then closes them, and tells us (on_connection, under the same mutex) before it closes the
 * descriptor, so the reaper never touches a descriptor that belongs to somebody else by now.
 */
#include "http_internal.h"
#include "log.h"

#include <sys/socket.h>
#include <time.h>

enum { REAP_MS = 500 };

static void reap_late(struct http *http, int64_t now_ms);
static bool has_hung_up(const struct connection *c);

void *http_reap(void *context)
{
    struct http *http = context;
    pthread_mutex_lock(&http->mutex);
    while (!http->reaper_stop) {
        int64_t now_ms = http_clock_ms(), wake_ms = now_ms + REAP_MS;
        reap_late(http, now_ms);
        struct timespec wake = {.tv_sec = wake_ms / 1000, .tv_nsec = wake_ms % 1000 * 1000000};
        pthread_cond_timedwait(&http->wake_reaper, &http->mutex, &wake);
    }
    pthread_mutex_unlock(&http->mutex);
    return NULL;
}

size_t http_reap_busy(struct http *http)
{
    size_t busy = 0;
    pthread_mutex_lock(&http->mutex);
    for (const struct connection *c = http->connections; c; c = c->next)
        busy += c->phase != PHASE_WAITING && !has_hung_up(c);
    pthread_mutex_unlock(&http->mutex);
    return busy;
}

/* Ends what is past its deadline. Mutex held. Also what the other end has left: the library waits
 * for an edge of epoll that it may have had already, with the bytes before the end. Twice seen is
 * sure, for a request may end with the connection and be on its way to the handler. */
static void reap_late(struct http *http, int64_t now_ms)
{
    static const char late[] = "HTTP/1.1 408 Request Timeout\r\nConnection: close\r\n"
                               "Content-Length: 0\r\n\r\n";
    for (struct connection *c = http->connections; c; c = c->next) {
        if (c->deadline_ms == INT64_MAX) /* done with */
            continue;
        bool hung_up = has_hung_up(c), seen = c->hung_up;
        c->hung_up = hung_up;
        if (now_ms < c->deadline_ms && !(hung_up && seen))
            continue;
        /* While a request is coming in, the library sends nothing that this could mix with. */
        if (c->phase == PHASE_RECEIVING)
            (void)!send(c->fd, late, sizeof(late) - 1, MSG_DONTWAIT | MSG_NOSIGNAL);
        shutdown(c->fd, SHUT_RDWR);
        c->deadline_ms = INT64_MAX;
        log_write(LOG_LEVEL_WARNING, hung_up ? "connection_left" : "connection_too_old",
                  LOG_FIELDS(log_integer("phase", c->phase)));
    }
}

/* Nothing more will come of a request that is not complete. */
static bool has_hung_up(const struct connection *c)
{
    char byte;
    return c->phase != PHASE_ANSWERING && recv(c->fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}
