/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http.c - the server's life, and a request's way through it.
 *
 * THREADS  libmicrohttpd runs LIMIT_HTTP_THREADS threads; each connection stays with one of them.
 *
 * The library's own timeout is of inactivity only; one byte per second would hold a connection for
 * ever: http_reap.c sees to that. A body is read only after its headers were found good.
 */
#include "http_guard.h"
#include "deadline.h"
#include "http_internal.h"
#include "http_listen.h"
#include "limits.h"
#include "log.h"
#include "reply.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

enum {
    DRAIN_POLL_MS = 5,
    CLOSE_POLL_MS = 1,
    FORGOTTEN_MS = 1000,
    LOG_LINES_MAX = 10, /* a second */
};

static struct MHD_Daemon *start_daemon(struct http *http);
static void on_log(void *context, const char *format, va_list args);
static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
                          enum MHD_ConnectionNotificationCode code);
static void *on_uri(void *context, const char *uri, struct MHD_Connection *connection);
static enum MHD_Result on_access(void *context, struct MHD_Connection *connection, const char *url,
                                 const char *method, const char *version, const char *upload,
                                 size_t *upload_size, void **request_context);
static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
                         enum MHD_RequestTerminationCode code);
static size_t count_of(const char *text, char c);
static void end_exchange(struct http *http, struct connection *c);
static size_t keep_escapes(void *context, struct MHD_Connection *connection, char *text);
static bool handle(struct http *http, struct connection *c);
static bool ask(struct http *http, struct connection *c, bool last, void *held);
static const char *header(const struct connection *c, const char *name);
static bool rest(struct http *http, struct connection *c, unsigned long pulses);
static void let_go(struct http *http, struct exchange *exchange);
static void sleep_ms(int64_t ms);

struct http *http_start(const struct http_options *options, char *reason, size_t size)
{
    struct http *http = calloc(1, sizeof(*http));
    if (!http) {
        snprintf(reason, size, "out of memory");
        return NULL;
    }
    deadline_condition(&http->wake_reaper);
    pthread_mutex_init(&http->mutex, NULL);
    http->options = *options;
    snprintf(http->host, sizeof(http->host), "%s", options->host);
    http->options.host = http->host;
    if (http->options.request_age_ms <= 0)
        http->options.request_age_ms = LIMIT_REQUEST_AGE_MS_MAX;
    if (http->options.stream_stall_ms <= 0)
        http->options.stream_stall_ms = LIMIT_STREAM_STALL_MS_MAX;
    if (getrandom(&http->id_base, sizeof(http->id_base), 0) < 0)
        http->id_base = (uint64_t)http_clock_us();
    http->listen_fd = http_listen(options->host, options->port, &http->port);
    if (http->listen_fd < 0) {
        snprintf(reason, size, "cannot listen on %s port %d: %s", options->host, options->port,
                 strerror(errno));
        goto fail;
    }
    http->daemon = start_daemon(http);
    if (!http->daemon) {
        http->listen_fd = -1; /* the library had it and may have closed it */
        snprintf(reason, size, "the HTTP library does not start, the log says why");
        goto fail;
    }
    if (pthread_create(&http->reaper, NULL, http_reap, http) == 0) {
        pthread_setname_np(http->reaper, "http-reaper");
        return http;
    }
    snprintf(reason, size, "no thread to be had");
    MHD_stop_daemon(http->daemon);
    http->listen_fd = -1; /* closed with the daemon */
fail:
    if (http->listen_fd >= 0)
        close(http->listen_fd);
    pthread_cond_destroy(&http->wake_reaper);
    pthread_mutex_destroy(&http->mutex);
    free(http);
    return NULL;
}

uint16_t http_port(const struct http *http)
{
    return http->port;
}

void http_stop(struct http *http)
{
    if (!http)
        return;
    atomic_store(&http->stopping, true);
    MHD_socket quiet = MHD_quiesce_daemon(http->daemon);
    pthread_mutex_lock(&http->mutex);
    http_rest_wake(http, 0);
    pthread_mutex_unlock(&http->mutex);
    int64_t deadline_ms = http_clock_ms() + LIMIT_DRAIN_MS;
    while (http_reap_busy(http) > 0 && http_clock_ms() < deadline_ms)
        sleep_ms(DRAIN_POLL_MS);
    /* A request too large for the library, looked at while that stops, would be the end of us: it
     * queues no answer then, and goes on as if it had. */
    deadline_ms = http_clock_ms() + LIMIT_DRAIN_MS;
    while (http_reap_all(http) && http_clock_ms() < deadline_ms)
        sleep_ms(CLOSE_POLL_MS);
    MHD_stop_daemon(http->daemon);
    if (quiet != MHD_INVALID_SOCKET)
        close(quiet);
    pthread_mutex_lock(&http->mutex);
    http->reaper_stop = true;
    pthread_cond_signal(&http->wake_reaper);
    pthread_mutex_unlock(&http->mutex);
    pthread_join(http->reaper, NULL);
    pthread_cond_destroy(&http->wake_reaper);
    pthread_mutex_destroy(&http->mutex);
    free(http);
}

static struct MHD_Daemon *start_daemon(struct http *http)
{
    unsigned flags = MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG;
    if (strchr(http->host, ':'))
        flags |= MHD_USE_IPv6;
    /* clang-format off */
    return MHD_start_daemon(
        flags, 0, NULL, NULL, on_access, http,
        MHD_OPTION_EXTERNAL_LOGGER, on_log, http, /* first, for it sees faults of the others */
        MHD_OPTION_LISTEN_SOCKET, http->listen_fd,
        MHD_OPTION_THREAD_POOL_SIZE, (unsigned)LIMIT_HTTP_THREADS,
        MHD_OPTION_CONNECTION_LIMIT, (unsigned)LIMIT_CONNECTIONS_MAX,
        MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)(LIMIT_IDLE_MS_MAX / 1000),
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)LIMIT_HEADER_BYTES_MAX,
        MHD_OPTION_STRICT_FOR_CLIENT, 1,
        MHD_OPTION_UNESCAPE_CALLBACK, keep_escapes, NULL,
        MHD_OPTION_URI_LOG_CALLBACK, on_uri, http,
        MHD_OPTION_NOTIFY_CONNECTION, on_connection, http,
        MHD_OPTION_NOTIFY_COMPLETED, on_completed, http,
        MHD_OPTION_END);
    /* clang-format on */
}

/* Its words on what clients do wrong, as far as they do not fill the log. */
static void on_log(void *context, const char *format, va_list args)
{
    struct http *http = context;
    char text[256];
    int64_t now_ms = http_clock_ms(), since_ms = atomic_load(&http->told_ms);
    if (now_ms >= since_ms + 1000 &&
        atomic_compare_exchange_strong(&http->told_ms, &since_ms, now_ms)) {
        size_t untold = atomic_exchange(&http->told, 0);
        if (untold > LOG_LINES_MAX)
            log_write(LOG_LEVEL_WARNING, "http_library",
                      LOG_FIELDS(log_integer("untold", (int64_t)(untold - LOG_LINES_MAX))));
    }
    if (atomic_fetch_add(&http->told, 1) >= LOG_LINES_MAX)
        return;
    vsnprintf(text, sizeof(text), format, args);
    text[strcspn(text, "\n")] = '\0';
    log_write(LOG_LEVEL_WARNING, "http_library", LOG_FIELDS(log_text("text", text)));
}

static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
                          enum MHD_ConnectionNotificationCode code)
{
    struct http *http = context;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        struct connection *c = calloc(1, sizeof(*c));
        *socket_context = c; /* without one, on_uri refuses all requests */
        if (!c)
            return;
        c->handle = connection;
        c->fd = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
        c->phase_ms = http_clock_ms();
        c->deadline_ms = c->phase_ms + http->options.request_age_ms;
        pthread_mutex_lock(&http->mutex);
        http_crowd_add(http, c);
        pthread_mutex_unlock(&http->mutex);
        return;
    }
    struct connection *c = *socket_context;
    if (!c)
        return;
    pthread_mutex_lock(&http->mutex);
    http_crowd_remove(http, c);
    pthread_mutex_unlock(&http->mutex);
    end_exchange(http, c);
    free(c);
    *socket_context = NULL;
}

/* The request line is there: a request begins, and this becomes its context. NULL (no memory) makes
 * on_access hang up. The library does not tell us of the end of a request whose line or headers it
 * could not hold: the connection keeps its exchange, and takes it along. With so many parameters
 * that it lacks memory for an answer it forgets the request: such ones, refused in any case, have
 * little time. */
static void *on_uri(void *context, const char *uri, struct MHD_Connection *connection)
{
    struct http *http = context;
    struct connection *c = http_connection(connection);
    http_set_phase(http, connection, PHASE_RECEIVING, http->options.request_age_ms);
    if (!c)
        return NULL;
    end_exchange(http, c);
    struct exchange *exchange = calloc(1, sizeof(*exchange));
    if (!exchange)
        return NULL;
    c->exchange = exchange;
    exchange->began_us = http_clock_us();
    exchange->uri = strdup(uri);
    if (!exchange->uri) {
        end_exchange(http, c);
        return NULL;
    }
    exchange->query = strchr(exchange->uri, '?');
    if (exchange->query)
        *exchange->query++ = '\0';
    if (count_of(exchange->query, '&') >= LIMIT_QUERY_MAX)
        http_set_phase(http, connection, PHASE_RECEIVING, FORGOTTEN_MS);
    return exchange;
}

static size_t count_of(const char *text, char c)
{
    size_t count = 0;
    while (text && (text = strchr(text, c)))
        count++, text++;
    return count;
}

/* Called once when the headers are there, then for every piece of the body, then once more. An
 * answer in the first call closes the connection, so that what follows is never taken for another
 * request. */
static enum MHD_Result on_access(void *context, struct MHD_Connection *connection, const char *url,
                                 const char *method, const char *version, const char *upload,
                                 size_t *upload_size, void **request_context)
{
    struct http *http = context;
    struct exchange *exchange = *request_context;
    (void)url; /* the library has had its hands on it; exchange->uri is as sent */
    if (!exchange)
        return MHD_NO;
    struct connection *c = http_connection(connection);
    if (!exchange->headers_seen) {
        exchange->headers_seen = true;
        snprintf(exchange->method, sizeof(exchange->method), "%s", method);
        http_receive_id(http, connection, exchange);
        http_receive_headers(http, connection, version, exchange);
        return exchange->refused ? http_answer(http, c) : MHD_YES;
    }
    if (*upload_size > 0) {
        http_receive_body(http, exchange, upload, *upload_size);
        *upload_size = 0;
        return MHD_YES;
    }
    if (exchange->held) {
        enum woken woken = http_rest_end(http, c);
        if (woken == WOKEN_LEFT)
            return MHD_NO;
        /* Whether it is ready was seen before the library came back: it is to be seen again. */
        if (woken == WOKEN_LOOK && rest(http, c, atomic_load(&http->pulses) - 1))
            return MHD_YES;
    }
    if (!exchange->refused && !handle(http, c))
        return MHD_YES;
    return http_answer(http, c);
}

static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
                         enum MHD_RequestTerminationCode code)
{
    struct http *http = context;
    struct connection *c = http_connection(connection);
    /* Idle time is the library's business. Whoever sends something in that time, and then no
     * complete request line, is caught by this. */
    http_set_phase(http, connection, PHASE_WAITING,
                   LIMIT_IDLE_MS_MAX + http->options.request_age_ms);
    *request_context = NULL;
    if (!c)
        return;
    if (c->exchange)
        http_answer_done(http, c->exchange, code != MHD_REQUEST_TERMINATED_COMPLETED_OK);
    end_exchange(http, c);
}

static void end_exchange(struct http *http, struct connection *c)
{
    struct exchange *exchange = c->exchange;
    c->exchange = NULL;
    if (!exchange)
        return;
    http_receive_drop(http, exchange);
    let_go(http, exchange);
    atomic_fetch_sub(&http->answers_bytes, exchange->answer_held);
    reply_fini(&exchange->reply);
    free(exchange->uri);
    free(exchange);
}

/* Paths are compared as sent and queries are decoded by http_guard.c. */
static size_t keep_escapes(void *context, struct MHD_Connection *connection, char *text)
{
    (void)context, (void)connection;
    return strlen(text);
}

/* Has the handler fill the reply; false when the answer is held and the connection rests. */
static bool handle(struct http *http, struct connection *c)
{
    struct exchange *exchange = c->exchange;
    for (;;) {
        unsigned long pulses = atomic_load(&http->pulses);
        bool last = atomic_load(&http->stopping);
        struct hold before = exchange->reply.hold;
        exchange->reply.hold = (struct hold){0};
        let_go(http, exchange);
        reply_fini(&exchange->reply);
        bool again = ask(http, c, last, before.state);
        hold_fini(&before);
        if (!again)
            return true;
        exchange->held = exchange->was_held = true;
        exchange->hold_until_ms = http_clock_ms() + exchange->reply.hold.wait_ms;
        if (atomic_fetch_add(&http->holds, 1) >= LIMIT_HOLDS_MAX) {
            let_go(http, exchange);
            reply_problem(&exchange->reply, PROBLEM_BUSY,
                          "%d requests wait for something already (LIMIT_HOLDS_MAX)",
                          LIMIT_HOLDS_MAX);
            return true;
        }
        if (rest(http, c, pulses))
            return false;
    }
}

/* Calls the handler; true if it wants to be asked again. */
static bool ask(struct http *http, struct connection *c, bool last, void *held)
{
    struct exchange *exchange = c->exchange;
    struct reply *reply = &exchange->reply;
    const char *fault = NULL;
    http_set_phase(http, c->handle, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
    if (!exchange->query_read)
        fault = http_guard_query(exchange->query, exchange->pairs, LIMIT_QUERY_MAX,
                                 &exchange->pair_count);
    exchange->query_read = true;
    if (exchange->asked_ms == 0)
        exchange->asked_ms = http_clock_ms();
    struct request request = {
        .method = exchange->method,
        .path = exchange->uri,
        .idempotency_key = header(c, "Idempotency-Key"),
        .content_type = header(c, MHD_HTTP_HEADER_CONTENT_TYPE),
        .authorization = header(c, MHD_HTTP_HEADER_AUTHORIZATION),
        .if_none_match = header(c, MHD_HTTP_HEADER_IF_NONE_MATCH),
        .last_event_id = header(c, "Last-Event-ID"),
        .accept_encoding = header(c, MHD_HTTP_HEADER_ACCEPT_ENCODING),
        .id = exchange->id,
        .body = exchange->body ? exchange->body : "",
        .body_size = exchange->body_size,
        .query = exchange->pairs,
        .query_count = exchange->pair_count,
        .waited_ms = http_clock_ms() - exchange->asked_ms,
        .last = last,
        .held = held,
    };
    if (fault)
        reply_problem(reply, PROBLEM_BAD_REQUEST, "%s", fault);
    else
        http->options.handler(http->options.context, &request, reply);
    if (last && reply->hold.ready)
        reply_problem(reply, PROBLEM_BUSY, "the server is stopping");
    return reply->hold.ready != NULL;
}

static const char *header(const struct connection *c, const char *name)
{
    return MHD_lookup_connection_value(c->handle, MHD_HEADER_KIND, name);
}

static bool rest(struct http *http, struct connection *c, unsigned long pulses)
{
    const struct exchange *exchange = c->exchange;
    const struct resting resting = {.ready = exchange->reply.hold.ready,
                                    .state = exchange->reply.hold.state,
                                    .until_ms = exchange->hold_until_ms,
                                    .pulses = pulses};
    return http_rest_begin(http, c, &resting);
}

/* The answer is not held any more. */
static void let_go(struct http *http, struct exchange *exchange)
{
    if (exchange->held)
        atomic_fetch_sub(&http->holds, 1);
    exchange->held = false;
}

void http_count(struct http *http, struct http_counts *counts)
{
    *counts = (struct http_counts){.streams = atomic_load(&http->streams),
                                   .holds = atomic_load(&http->holds)};
    pthread_mutex_lock(&http->mutex);
    for (const struct connection *c = http->connections; c; c = c->next)
        counts->connections++;
    pthread_mutex_unlock(&http->mutex);
}

void http_set_phase(struct http *http, struct MHD_Connection *connection, enum phase phase,
                    int64_t allowed_ms)
{
    struct connection *c = http_connection(connection);
    if (!c)
        return;
    pthread_mutex_lock(&http->mutex);
    if (c->deadline_ms != INT64_MAX) /* else it is being ended */
        c->deadline_ms = http_clock_ms() + allowed_ms;
    c->phase = phase;
    c->phase_ms = http_clock_ms();
    c->stalled_ms = 0;
    pthread_mutex_unlock(&http->mutex);
}

struct connection *http_connection(struct MHD_Connection *connection)
{
    return MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context;
}

int64_t http_clock_ms(void)
{
    return http_clock_us() / 1000;
}

int64_t http_clock_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static void sleep_ms(int64_t ms)
{
    nanosleep(&(struct timespec){.tv_nsec = ms * 1000000}, NULL);
}
