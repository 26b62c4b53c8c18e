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
#include "limits.h"

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

/* A connection whose answer waits for something to happen. */
enum rest {
    REST_NOT,
    REST_SUSPENDED, /* the library does not look at it */
    REST_RESUMED,   /* the library was told to, and will call us */
};

enum woken {
    WOKEN_LOOK, /* it was time for a look */
    WOKEN_DUE,  /* what it waited for may be there, or it is late enough */
    WOKEN_LEFT, /* the client has left */
};

struct connection {
    struct connection *next, *previous;
    struct MHD_Connection *handle;
    int fd;
    enum phase phase;
    int64_t phase_ms; /* since when */
    int64_t deadline_ms;
    size_t thread;      /* of http->threads */
    bool hung_up;       /* the other end had, when the reaper came by */
    uint64_t acked;     /* bytes that the other end has, as far as known when the reaper came by */
    int64_t stalled_ms; /* since when it takes nothing of its answer; 0 = it does */
    struct exchange *exchange; /* in progress; of the thread that serves the connection */
    enum rest rest;
    bool (*ready)(void *state); /* while it rests */
    void *ready_state;
    int64_t rest_until_ms, resume_ms; /* when it is due anyway; when it is looked after */
    enum woken woken;                 /* why it was resumed */
};

/* A thread of the library, which takes no more than its share of connections. */
struct http_thread {
    pthread_t id;
    size_t connections; /* that are not being ended */
};

struct http {
    struct http_options options;
    char host[INET6_ADDRSTRLEN];
    uint16_t port;
    int listen_fd;
    struct MHD_Daemon *daemon;
    atomic_bool stopping;
    atomic_size_t body_bytes;    /* held by all exchanges together */
    atomic_size_t answers_bytes; /* likewise, of answers on their way */
    atomic_size_t streams, holds;
    atomic_uint_least64_t next_id;
    atomic_int_least64_t told_ms; /* of the library's words: a second of the log, */
    atomic_size_t told;           /* and how many there were in it */
    uint64_t id_base;
    pthread_mutex_t mutex;
    pthread_cond_t wake_reaper;
    pthread_t reaper;
    bool reaper_stop;
    struct connection *connections;
    struct http_thread threads[LIMIT_HTTP_THREADS];
    size_t thread_count;
    size_t open;         /* connections of all threads that are not being ended */
    bool crowded;        /* a thread has hardly room for more connections */
    size_t resting;      /* of them: suspended */
    atomic_ulong pulses; /* since the start */
    bool pulsed;         /* the reaper has not seen all of them */
};

enum { REQUEST_ID_SIZE = LIMIT_REQUEST_ID_BYTES_MAX + 1 };

/* One request and its answer. In the hands of the thread that serves the connection. */
struct exchange {
    char *uri;
    char *query; /* part of uri, or NULL */
    char id[REQUEST_ID_SIZE];
    char method[16];
    bool headers_seen;
    bool refused; /* reply is filled already; the rest of the request is thrown away */
    bool query_read;
    bool held; /* and counted in http->holds */
    bool was_held;
    int64_t asked_ms, hold_until_ms;
    struct request_query pairs[LIMIT_QUERY_MAX];
    size_t pair_count;
    char *body;
    size_t body_size, body_room;
    struct reply reply;
    int64_t began_us;
    uint64_t answer_bytes;
    size_t answer_held; /* and counted in http->answers_bytes */
    bool answered;
};

/* http.c: what the connection is at, and how long it may be so. */
void http_set_phase(struct http *http, struct MHD_Connection *connection, enum phase phase,
                    int64_t allowed_ms);
/* NULL when there was no memory for it. */
struct connection *http_connection(struct MHD_Connection *connection);
int64_t http_clock_ms(void);
int64_t http_clock_us(void);

/* What every answer that does not come from the library has; and no body. */
#define HTTP_REAP_HEADERS                                                                          \
    "Connection: close\r\nContent-Length: 0\r\nCache-Control: no-store\r\n"                        \
    "Content-Security-Policy: default-src 'none'; frame-ancestors 'none'\r\n"                      \
    "Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n"     \
    "Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n"

/* http_reap.c: the thread that ends late connections; `context` is the struct http. */
void *http_reap(void *context);
/* Connections with a request in progress. */
size_t http_reap_busy(struct http *http);
/* Ends all of them; whether there is one that the library has not closed yet. */
bool http_reap_all(struct http *http);
/* Ends one, in `words` to a client that is in the middle of a request (NULL = without any). Mutex
 * held. */
void http_reap_end(struct http *http, struct connection *c, const char *words);

/* http_crowd.c: a connection begins, or is gone. Mutex held. */
void http_crowd_add(struct http *http, struct connection *c);
void http_crowd_remove(struct http *http, struct connection *c);
/* It is being ended: it does not count any more. Mutex held. */
void http_crowd_leave(struct http *http, struct connection *c);
/* Makes room where a thread has too many. Mutex held, by the reaper. */
void http_crowd_thin(struct http *http, int64_t now_ms);

/* http_rest.c: lets a connection rest until `ready`, or `until_ms`. Called from the library's
 * thread that serves it, which then has nothing to answer yet; `pulses` is http->pulses from before
 * it looked. False when the server is stopping: the time for answers is now. */
struct resting {
    bool (*ready)(void *state);
    void *state;
    int64_t until_ms;
    unsigned long pulses;
};
bool http_rest_begin(struct http *http, struct connection *c, const struct resting *resting);
/* The library has come back to it: why. */
enum woken http_rest_end(struct http *http, struct connection *c);
/* Wakes those that are due, all when stopping. Mutex held. */
void http_rest_wake(struct http *http, int64_t now_ms);
/* Wakes a suspended one whose client has left. Mutex held. */
void http_rest_drop(struct http *http, struct connection *c);

/* http_receive.c: the id that the request goes by. */
void http_receive_id(struct http *http, struct MHD_Connection *connection,
                     struct exchange *exchange);
/* Fills the reply and sets refused if the request may not go on. */
void http_receive_headers(struct http *http, struct MHD_Connection *connection, const char *version,
                          struct exchange *exchange);
/* Keeps a piece of the body. What a refused request goes on sending is not kept; the reaper's
 * deadline bounds it. */
void http_receive_body(struct http *http, struct exchange *exchange, const char *bytes,
                       size_t size);
void http_receive_drop(struct http *http, struct exchange *exchange);

/* http_answer.c: sends the reply of the connection's exchange, which gives its body or stream
 * away. */
enum MHD_Result http_answer(struct http *http, struct connection *c);
/* The exchange is over, if it had an answer: tells the observer. */
void http_answer_done(struct http *http, struct exchange *exchange, bool cut);

/* http_stream.c: the response that pulls the stream of the connection's reply, which is taken over,
 * and counted in http->streams already if it has a `ready`. NULL = no memory. */
struct MHD_Response *http_stream_take(struct http *http, struct connection *c);

#endif
