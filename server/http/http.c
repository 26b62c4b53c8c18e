/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * THREADS  libmicrohttpd runs LIMIT_HTTP_THREADS threads; each connection stays with one of them.
 *          `connections` and what hangs on it: under `mutex`. The reaper, one thread of ours, ends
 *          connections that are past their deadline with shutdown(): the library then closes them,
 *          and tells us (on_connection, under the same mutex) before it closes the descriptor, so
 *          the reaper never touches a descriptor that belongs to somebody else by now.
 *
 * The library's own timeout is of inactivity only; one byte per second would hold a connection for
 * ever. And it lets contradicting lengths pass, on which request smuggling lives. Both are seen to
 * here. A body is read only after its headers were found good.
 */
#include "http.h"
#include "http_guard.h"
#include "http_listen.h"
#include "limits.h"
#include "log.h"
#include "reply.h"

#include <microhttpd.h>

#include <arpa/inet.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { REAP_MS = 500, DRAIN_POLL_MS = 5 };

enum phase {
    PHASE_WAITING,   /* for the first byte, or somewhere in a request line */
    PHASE_RECEIVING, /* the rest of a request */
    PHASE_ANSWERING, /* from the handler's start on */
};

struct connection {
    struct connection *next, *previous;
    int fd;
    enum phase phase;
    bool hung_up; /* the other end had, when the reaper came by */
    int64_t deadline_ms;
    struct exchange *exchange; /* in progress; of the thread that serves the connection */
};

struct http {
    struct http_options options;
    char host[INET6_ADDRSTRLEN];
    uint16_t port;
    int listen_fd;
    struct MHD_Daemon *daemon;
    atomic_bool stopping;
    atomic_size_t body_bytes; /* held by all exchanges together */
    pthread_mutex_t mutex;
    pthread_cond_t wake_reaper;
    pthread_t reaper;
    bool reaper_stop;
    struct connection *connections;
};

/* One request and its answer. */
struct exchange {
    char *uri;
    char *query; /* part of uri, or NULL */
    bool headers_seen;
    bool refused; /* reply is filled already; the rest of the request is thrown away */
    char *body;
    size_t body_size, body_room;
    struct reply reply;
};

static struct MHD_Daemon *start_daemon(struct http *http);
static void *reap(void *context);
static void reap_late(struct http *http, int64_t now_ms);
static bool has_hung_up(const struct connection *c);
static size_t count_busy(struct http *http);
static void on_log(void *context, const char *format, va_list args);
static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
                          enum MHD_ConnectionNotificationCode code);
static void *on_uri(void *context, const char *uri, struct MHD_Connection *connection);
static enum MHD_Result on_access(void *context, struct MHD_Connection *connection, const char *url,
                                 const char *method, const char *version, const char *upload,
                                 size_t *upload_size, void **request_context);
static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
                         enum MHD_RequestTerminationCode code);
static void end_exchange(struct http *http, struct connection *c);
static size_t keep_escapes(void *context, struct MHD_Connection *connection, char *text);
static void check_headers(struct http *http, struct MHD_Connection *connection, const char *version,
                          struct exchange *exchange);
static void take_body(struct http *http, struct exchange *exchange, const char *bytes, size_t size);
static void drop_body(struct http *http, struct exchange *exchange);
static void handle(struct http *http, struct MHD_Connection *connection, const char *method,
                   struct exchange *exchange);
static enum MHD_Result answer(struct http *http, struct MHD_Connection *connection,
                              const char *method, struct exchange *exchange);
static void set_phase(struct http *http, struct MHD_Connection *connection, enum phase phase,
                      int64_t allowed_ms);
static struct connection *connection_of(struct MHD_Connection *connection);
static int64_t clock_ms(void);
static void sleep_ms(int64_t ms);

struct http *http_start(const struct http_options *options, char *reason, size_t size)
{
    struct http *http = calloc(1, sizeof(*http));
    if (!http) {
        snprintf(reason, size, "out of memory");
        return NULL;
    }
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&http->wake_reaper, &monotonic);
    pthread_condattr_destroy(&monotonic);
    pthread_mutex_init(&http->mutex, NULL);
    http->options = *options;
    snprintf(http->host, sizeof(http->host), "%s", options->host);
    http->options.host = http->host;
    if (http->options.request_age_ms <= 0)
        http->options.request_age_ms = LIMIT_REQUEST_AGE_MS_MAX;
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
    if (pthread_create(&http->reaper, NULL, reap, http) == 0)
        return http;
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
    int64_t deadline_ms = clock_ms() + LIMIT_DRAIN_MS;
    while (count_busy(http) > 0 && clock_ms() < deadline_ms)
        sleep_ms(DRAIN_POLL_MS);
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

static void *reap(void *context)
{
    struct http *http = context;
    pthread_mutex_lock(&http->mutex);
    while (!http->reaper_stop) {
        int64_t now_ms = clock_ms(), wake_ms = now_ms + REAP_MS;
        reap_late(http, now_ms);
        struct timespec wake = {.tv_sec = wake_ms / 1000, .tv_nsec = wake_ms % 1000 * 1000000};
        pthread_cond_timedwait(&http->wake_reaper, &http->mutex, &wake);
    }
    pthread_mutex_unlock(&http->mutex);
    return NULL;
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

/* Connections with a request in progress. */
static size_t count_busy(struct http *http)
{
    size_t busy = 0;
    pthread_mutex_lock(&http->mutex);
    for (const struct connection *c = http->connections; c; c = c->next)
        busy += c->phase != PHASE_WAITING && !has_hung_up(c);
    pthread_mutex_unlock(&http->mutex);
    return busy;
}

static void on_log(void *context, const char *format, va_list args)
{
    (void)context;
    char text[256];
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
        c->fd = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
        c->deadline_ms = clock_ms() + http->options.request_age_ms;
        pthread_mutex_lock(&http->mutex);
        c->next = http->connections;
        if (c->next)
            c->next->previous = c;
        http->connections = c;
        pthread_mutex_unlock(&http->mutex);
        return;
    }
    struct connection *c = *socket_context;
    if (!c)
        return;
    pthread_mutex_lock(&http->mutex);
    if (c->next)
        c->next->previous = c->previous;
    if (c->previous)
        c->previous->next = c->next;
    else
        http->connections = c->next;
    pthread_mutex_unlock(&http->mutex);
    end_exchange(http, c);
    free(c);
    *socket_context = NULL;
}

/* The request line is there: a request begins, and this becomes its context. NULL (no memory) makes
 * on_access hang up. The library does not tell us of the end of a request whose line or headers it
 * could not hold: the connection keeps its exchange, and takes it along. */
static void *on_uri(void *context, const char *uri, struct MHD_Connection *connection)
{
    struct http *http = context;
    struct connection *c = connection_of(connection);
    set_phase(http, connection, PHASE_RECEIVING, http->options.request_age_ms);
    if (!c)
        return NULL;
    end_exchange(http, c);
    struct exchange *exchange = calloc(1, sizeof(*exchange));
    if (!exchange)
        return NULL;
    c->exchange = exchange;
    exchange->uri = strdup(uri);
    if (!exchange->uri) {
        end_exchange(http, c);
        return NULL;
    }
    exchange->query = strchr(exchange->uri, '?');
    if (exchange->query)
        *exchange->query++ = '\0';
    return exchange;
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
    if (!exchange->headers_seen) {
        exchange->headers_seen = true;
        check_headers(http, connection, version, exchange);
        return exchange->refused ? answer(http, connection, method, exchange) : MHD_YES;
    }
    if (*upload_size > 0) {
        take_body(http, exchange, upload, *upload_size);
        *upload_size = 0;
        return MHD_YES;
    }
    if (!exchange->refused)
        handle(http, connection, method, exchange);
    return answer(http, connection, method, exchange);
}

static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
                         enum MHD_RequestTerminationCode code)
{
    struct http *http = context;
    struct connection *c = connection_of(connection);
    (void)code;
    /* Idle time is the library's business. Whoever sends something in that time, and then no
     * complete request line, is caught by this. */
    set_phase(http, connection, PHASE_WAITING, LIMIT_IDLE_MS_MAX + http->options.request_age_ms);
    *request_context = NULL;
    if (c)
        end_exchange(http, c);
}

static void end_exchange(struct http *http, struct connection *c)
{
    struct exchange *exchange = c->exchange;
    c->exchange = NULL;
    if (!exchange)
        return;
    drop_body(http, exchange);
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

struct headers {
    int lengths, encodings, hosts, blanks;
    const char *length, *encoding, *host, *origin;
};

static enum MHD_Result note_header(void *context, enum MHD_ValueKind kind, const char *key,
                                   const char *value)
{
    struct headers *headers = context;
    (void)kind;
    headers->blanks += key[strcspn(key, " \t")] != '\0'; /* "Transfer-Encoding :" */
    if (!value)
        return MHD_YES;
    if (strcasecmp(key, "Content-Length") == 0) {
        headers->lengths++;
        headers->length = value;
    } else if (strcasecmp(key, "Transfer-Encoding") == 0) {
        headers->encodings++;
        headers->encoding = value;
    } else if (strcasecmp(key, "Host") == 0) {
        headers->hosts++;
        headers->host = value;
    } else if (strcasecmp(key, "Origin") == 0) {
        headers->origin = value;
    }
    return MHD_YES;
}

/* Fills the reply and sets refused if the request may not go on. */
static void check_headers(struct http *http, struct MHD_Connection *connection, const char *version,
                          struct exchange *exchange)
{
    struct headers seen = {0};
    struct reply *reply = &exchange->reply;
    MHD_get_connection_values(connection, MHD_HEADER_KIND, note_header, &seen);
    bool digits = !seen.length ||
                  (seen.length[0] && strspn(seen.length, "0123456789") == strlen(seen.length));
    exchange->refused = true;
    if (seen.lengths + seen.encodings > 1 || !digits ||
        (seen.encoding && strcasecmp(seen.encoding, "chunked") != 0))
        reply_problem(reply, PROBLEM_BAD_REQUEST,
                      "Content-Length and Transfer-Encoding contradict each other");
    else if (seen.blanks > 0)
        reply_problem(reply, PROBLEM_BAD_REQUEST, "the name of a header has blanks in it");
    else if (seen.hosts > 1 || (seen.hosts == 0 && strcmp(version, MHD_HTTP_VERSION_1_0) != 0))
        reply_problem(reply, PROBLEM_BAD_REQUEST, "there must be one Host header");
    else if (seen.host && !http_guard_host(seen.host, http->host))
        reply_problem(reply, PROBLEM_WRONG_HOST, "on loopback, ask for localhost or 127.0.0.1");
    else if (seen.origin && !http_guard_origin(seen.origin, seen.host))
        reply_problem(reply, PROBLEM_FORBIDDEN, "pages of other origins have no access");
    else if (seen.length && strtoull(seen.length, NULL, 10) > LIMIT_BODY_BYTES_MAX)
        reply_problem(reply, PROBLEM_TOO_LARGE, "a body may have at most %d bytes, this has %.32s",
                      LIMIT_BODY_BYTES_MAX, seen.length);
    else
        exchange->refused = false;
}

/* Keeps a piece of the body. What a refused request goes on sending is not kept; the reaper's
 * deadline bounds it. */
static void take_body(struct http *http, struct exchange *exchange, const char *bytes, size_t size)
{
    if (exchange->refused)
        return;
    size_t needed = exchange->body_size + size + 1; /* a final NUL, for convenience */
    if (needed - 1 > LIMIT_BODY_BYTES_MAX) {
        exchange->refused = true;
        reply_problem(&exchange->reply, PROBLEM_TOO_LARGE, "a body may have at most %d bytes",
                      LIMIT_BODY_BYTES_MAX);
    } else if (needed > exchange->body_room) {
        size_t room = 2 * needed;
        size_t more = room - exchange->body_room;
        char *body = NULL;
        if (atomic_fetch_add(&http->body_bytes, more) + more <= LIMIT_BODIES_BYTES_MAX)
            body = realloc(exchange->body, room);
        if (body) {
            exchange->body = body;
            exchange->body_room = room;
        } else {
            atomic_fetch_sub(&http->body_bytes, more);
            exchange->refused = true;
            reply_problem(&exchange->reply, PROBLEM_BUSY, "too many large requests at once");
        }
    }
    if (exchange->refused) {
        drop_body(http, exchange);
        return;
    }
    memcpy(exchange->body + exchange->body_size, bytes, size);
    exchange->body_size += size;
    exchange->body[exchange->body_size] = '\0';
}

static void drop_body(struct http *http, struct exchange *exchange)
{
    atomic_fetch_sub(&http->body_bytes, exchange->body_room);
    free(exchange->body);
    exchange->body = NULL;
    exchange->body_size = exchange->body_room = 0;
}

static void handle(struct http *http, struct MHD_Connection *connection, const char *method,
                   struct exchange *exchange)
{
    struct request_query query[LIMIT_QUERY_MAX];
    struct request request = {
        .method = method,
        .path = exchange->uri,
        .idempotency_key =
            MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Idempotency-Key"),
        .content_type =
            MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_TYPE),
        .body = exchange->body ? exchange->body : "",
        .body_size = exchange->body_size,
        .query = query,
    };
    set_phase(http, connection, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
    const char *fault =
        http_guard_query(exchange->query, query, LIMIT_QUERY_MAX, &request.query_count);
    if (fault)
        reply_problem(&exchange->reply, PROBLEM_BAD_REQUEST, "%s", fault);
    else
        http->options.handler(http->options.context, &request, &exchange->reply);
    drop_body(http, exchange);
}

/* Sends the exchange's reply, which gives its body away. */
static enum MHD_Result answer(struct http *http, struct MHD_Connection *connection,
                              const char *method, struct exchange *exchange)
{
    struct reply *reply = &exchange->reply;
    struct MHD_Response *response =
        reply->body
            ? MHD_create_response_from_buffer(reply->body_size, reply->body, MHD_RESPMEM_MUST_FREE)
            : MHD_create_response_from_buffer(0, NULL, MHD_RESPMEM_PERSISTENT);
    if (!response)
        return MHD_NO;
    reply->body = NULL;
    bool drawing = reply->content_type && strcmp(reply->content_type, "image/svg+xml") == 0;
    const struct {
        const char *name, *value;
    } headers[] = {
        {MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type},
        {MHD_HTTP_HEADER_CACHE_CONTROL, reply->cache_control},
        {MHD_HTTP_HEADER_LOCATION, reply->location[0] ? reply->location : NULL},
        {MHD_HTTP_HEADER_ALLOW, reply->allow[0] ? reply->allow : NULL},
        {MHD_HTTP_HEADER_RETRY_AFTER, reply->status == 503 ? "1" : reply->retry_after},
        {MHD_HTTP_HEADER_CONNECTION,
         exchange->refused || atomic_load(&http->stopping) ? "close" : NULL},
        {"Content-Security-Policy", drawing ? "default-src 'none'; style-src 'unsafe-inline'"
                                            : "default-src 'none'; frame-ancestors 'none'"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Referrer-Policy", "no-referrer"},
        {"X-Content-Type-Options", "nosniff"},
    };
    enum MHD_Result sound = MHD_YES;
    for (size_t i = 0; i < sizeof(headers) / sizeof(headers[0]) && sound == MHD_YES; i++)
        if (headers[i].value)
            sound = MHD_add_response_header(response, headers[i].name, headers[i].value);
    set_phase(http, connection, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
    if (sound == MHD_YES)
        sound = MHD_queue_response(connection, (unsigned)reply->status, response);
    MHD_destroy_response(response);
    bool reads = strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0;
    if (reply->status >= 400 || !reads)
        log_write(LOG_LEVEL_INFO, "request",
                  LOG_FIELDS(log_text("method", method), log_text("path", exchange->uri),
                             log_integer("status", reply->status)));
    return sound;
}

static void set_phase(struct http *http, struct MHD_Connection *connection, enum phase phase,
                      int64_t allowed_ms)
{
    struct connection *c = connection_of(connection);
    if (!c)
        return;
    pthread_mutex_lock(&http->mutex);
    c->phase = phase;
    c->deadline_ms = clock_ms() + allowed_ms;
    pthread_mutex_unlock(&http->mutex);
}

/* NULL when there was no memory for it. */
static struct connection *connection_of(struct MHD_Connection *connection)
{
    return MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context;
}

static int64_t clock_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void sleep_ms(int64_t ms)
{
    nanosleep(&(struct timespec){.tv_nsec = ms * 1000000}, NULL);
}
