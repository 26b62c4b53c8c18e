/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_reap.c - the thread that ends connections past their deadline with shutdown(): the library
 * then closes them, and tells us (on_connection, under the same mutex) before it closes the
 * descriptor, so the reaper never touches a descriptor that belongs to somebody else by now.
 */
#include "http_internal.h"
#include "log.h"

#include <linux/tcp.h> /* the C library's own struct tcp_info ends too early */
#include <string.h>
#include <sys/socket.h>
#include <time.h>

enum {
    REAP_MS = 500,
    CROWD_MS = 100, /* in a crowd */
    LOOK_MS = 200,  /* resting connections are asked whether they are ready, without a pulse */
    PULSE_MS = 10,  /* and at most this often with one */
};

static void wait_until(struct http *http, int64_t wake_ms);
static void reap_late(struct http *http, int64_t now_ms);
static void look_whether_stalled(struct connection *c, int64_t now_ms);
static bool has_hung_up(const struct connection *c);

void *http_reap(void *context)
{
    struct http *http = context;
    int64_t reap_ms = 0, crowd_ms = 0, look_ms = 0, pulse_ms = 0;
    pthread_mutex_lock(&http->mutex);
    while (!http->reaper_stop) {
        int64_t now_ms = http_clock_ms();
        if (now_ms >= reap_ms || (http->crowded && now_ms >= crowd_ms)) {
            reap_late(http, now_ms);
            http_crowd_thin(http, now_ms);
            reap_ms = now_ms + REAP_MS;
            crowd_ms = now_ms + CROWD_MS;
        }
        if (now_ms >= look_ms || (http->pulsed && now_ms >= pulse_ms)) {
            http->pulsed = false;
            http_rest_wake(http, now_ms);
            look_ms = now_ms + LOOK_MS;
            pulse_ms = now_ms + PULSE_MS;
        }
        int64_t wake_ms = !http->connections ? INT64_MAX : http->crowded ? crowd_ms : reap_ms;
        if (http->resting > 0 && look_ms < wake_ms)
            wake_ms = look_ms;
        if (http->resting > 0 && http->pulsed && pulse_ms < wake_ms)
            wake_ms = pulse_ms;
        wait_until(http, wake_ms);
    }
    pthread_mutex_unlock(&http->mutex);
    return NULL;
}

/* Or until somebody signals. A server without connections sleeps for good. */
static void wait_until(struct http *http, int64_t wake_ms)
{
    struct timespec wake = {.tv_sec = wake_ms / 1000, .tv_nsec = wake_ms % 1000 * 1000000};
    if (wake_ms == INT64_MAX)
        pthread_cond_wait(&http->wake_reaper, &http->mutex);
    else
        pthread_cond_timedwait(&http->wake_reaper, &http->mutex, &wake);
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

bool http_reap_all(struct http *http)
{
    pthread_mutex_lock(&http->mutex);
    bool any = http->connections != NULL;
    for (struct connection *c = http->connections; c; c = c->next)
        if (c->deadline_ms != INT64_MAX)
            http_reap_end(http, c, NULL);
    pthread_mutex_unlock(&http->mutex);
    return any;
}

/* Ends what is past its deadline. Mutex held. Also what the other end has left: the library waits
 * for an edge of epoll that it may have had already, with the bytes before the end. Twice seen is
 * sure, for a request may end with the connection and be on its way to the handler. */
static void reap_late(struct http *http, int64_t now_ms)
{
    static const char late[] = "HTTP/1.1 408 Request Timeout\r\n" HTTP_REAP_HEADERS "\r\n";
    int64_t left = 0, old = 0, stalled = 0;
    for (struct connection *c = http->connections; c; c = c->next) {
        if (c->deadline_ms == INT64_MAX) /* done with */
            continue;
        bool hung_up = has_hung_up(c), seen = c->hung_up;
        c->hung_up = hung_up;
        look_whether_stalled(c, now_ms);
        bool stuck = c->stalled_ms > 0 && now_ms >= c->stalled_ms + http->options.stream_stall_ms;
        if (now_ms < c->deadline_ms && !(hung_up && seen) && !stuck)
            continue;
        if (c->rest != REST_SUSPENDED) { /* else the line of its request tells */
            left += hung_up;
            stalled += !hung_up && c->phase == PHASE_ANSWERING;
            old += !hung_up && c->phase != PHASE_ANSWERING;
        }
        http_reap_end(http, c, late);
    }
    /* One line for all of them: a thousand clients do not fill the log. */
    if (left > 0)
        log_write(LOG_LEVEL_WARNING, "connection_left", LOG_FIELDS(log_integer("count", left)));
    if (old > 0)
        log_write(LOG_LEVEL_WARNING, "connection_too_old", LOG_FIELDS(log_integer("count", old)));
    if (stalled > 0)
        log_write(LOG_LEVEL_WARNING, "connection_stalled",
                  LOG_FIELDS(log_integer("count", stalled)));
}

void http_reap_end(struct http *http, struct connection *c, const char *words)
{
    /* While a request is coming in, the library sends nothing that this could mix with. */
    if (c->phase == PHASE_RECEIVING && words)
        (void)!send(c->fd, words, strlen(words), MSG_DONTWAIT | MSG_NOSIGNAL);
    c->deadline_ms = INT64_MAX;
    http_crowd_leave(http, c);
    shutdown(c->fd, SHUT_RDWR);
    if (c->rest == REST_SUSPENDED)
        http_rest_drop(http, c);
}

/* Bytes wait for the other end, and it has taken none since the last look. */
static void look_whether_stalled(struct connection *c, int64_t now_ms)
{
    struct tcp_info info = {0};
    socklen_t size = sizeof(info);
    bool waits = c->phase == PHASE_ANSWERING && c->rest == REST_NOT &&
                 getsockopt(c->fd, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
                 (info.tcpi_unacked > 0 || info.tcpi_notsent_bytes > 0);
    if (!waits || info.tcpi_bytes_acked != c->acked)
        c->stalled_ms = 0;
    else if (c->stalled_ms == 0)
        c->stalled_ms = now_ms;
    c->acked = info.tcpi_bytes_acked;
}

/* Nothing more will come of a request that is not complete, nor be taken of an answer that waits:
 * there, who has sent all and closed that half is taken for gone. */
static bool has_hung_up(const struct connection *c)
{
    char byte;
    return (c->phase != PHASE_ANSWERING || c->rest == REST_SUSPENDED) &&
           recv(c->fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}
