/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_internal.h - what the http*.c files share. Nobody else includes this.
 *
 * THREADS  `connections` and what hangs on it: under `mutex`. An exchange belongs to the thread of
 *          the library that serves its connection.
 */
#ifndef HTTP_INTERNAL_H
#define HTTP_INTERNAL_H

#include "http.h"

#include <microhttpd.h>

#include <netinet/in.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

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

/* http.c: what the connection is at, and how long it may be so. */
void http_set_phase(struct http *http, struct MHD_Connection *connection, enum phase phase,
                    int64_t allowed_ms);
/* NULL when there was no memory for it. */
struct connection *http_connection(struct MHD_Connection *connection);
int64_t http_clock_ms(void);

/* http_reap.c: the thread that ends late connections; `context` is the struct http. */
void *http_reap(void *context);
/* Connections with a request in progress. */
size_t http_reap_busy(struct http *http);

/* http_receive.c. Fills the reply and sets refused if the request may not go on. */
void http_receive_headers(struct http *http, struct MHD_Connection *connection, const char *version,
                          struct exchange *exchange);
/* Keeps a piece of the body. What a refused request goes on sending is not kept; the reaper's
 * deadline bounds it. */
void http_receive_body(struct http *http, struct exchange *exchange, const char *bytes,
                       size_t size);
void http_receive_drop(struct http *http, struct exchange *exchange);

/* http_answer.c: sends the exchange's reply, which gives its body or stream away. */
enum MHD_Result http_answer(struct http *http, struct MHD_Connection *connection,
                            const char *method, struct exchange *exchange);

/* http_stream.c: the response that pulls the stream, which is taken over. NULL = no memory. */
struct MHD_Response *http_stream_take(struct http *http, struct MHD_Connection *connection,
                                      struct stream *stream);

#endif
