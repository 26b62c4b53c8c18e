/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http.h - the only file that knows libmicrohttpd: sockets in, struct request out, struct reply
 * back. Limits on size, age and number of connections live here.
 */
#ifndef HTTP_H
#define HTTP_H

#include "identity.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/* One request, complete, as handlers see it: no socket, no library type. A test can make one. */
struct request_query {
    const char *name, *value; /* decoded */
};
struct request {
    const char *method;          /* "GET", "POST", "DELETE", ... */
    const char *path;            /* as sent, without the query */
    const char *idempotency_key; /* header, or NULL */
    const char *content_type;    /* header, or NULL */
    const char *authorization;   /* header, or NULL; a secret */
    const char *if_none_match;   /* header, or NULL */
    const char *last_event_id;   /* header, or NULL */
    const char *accept_encoding; /* header, or NULL */
    const char *id;              /* X-Request-Id: the client's own or made here; NULL in tests */
    int64_t waited_ms;           /* 0; asked again after a hold: since the first time */
    bool last;                   /* no hold will be granted (any more) */
    void *held;                  /* asked again: `state` of the hold, which is freed afterwards */
    const char *body;            /* NUL-terminated for convenience; size counts */
    size_t body_size;
    const struct request_query *query;
    size_t query_count;
};

/* A body that is made while it is sent, for answers too long to be held, or that go on for ever.
 * `read` is called from one thread at a time, not always the same, whenever the client has taken
 * what came before: it writes 1..size bytes and returns how many, or one of these. It must not wait
 * for anything but disk. */
enum {
    STREAM_END = 0,
    STREAM_FAILED = -1, /* the connection is ended, so that the client knows: not a short file */
    STREAM_LATER = -2,  /* nothing just now; only for a stream with `ready` */
};
struct stream {
    ssize_t (*read)(void *state, char *to, size_t size); /* NULL = there is no stream */
    /* NULL, or whether `read` has something by now. Called after http_pulse, and a few times a
     * second, from another thread than `read` but never at the same time, with a lock of http.c
     * held: must be quick, wait for nothing and not call http.h. When it is false `read` is called
     * all the same, once a second. */
    bool (*ready)(void *state);
    void (*free)(void *state); /* called once, sent or not; may be NULL */
    void *state;
};
void stream_fini(struct stream *stream);

/* An answer that is worth waiting for: the handler is asked again when `ready` (as above) or after
 * `wait_ms`, without a thread being kept meanwhile. */
struct hold {
    bool (*ready)(void *state); /* NULL = nothing to wait for: answer now */
    void (*free)(void *state);  /* may be NULL */
    void *state;
    int64_t wait_ms;
};
void hold_fini(struct hold *hold);

/* The answer; filled by handlers through reply.h, sent and freed by http.c. */
struct reply {
    int status;
    const char *content_type;
    char *body; /* malloc'ed */
    size_t body_size;
    struct stream stream; /* in the place of body, when it has a `read` */
    struct hold hold;     /* in the place of everything, when it has a `ready` */
    char location[96];    /* Location header, or "" */
    char allow[48];       /* Allow header (405), or "" */
    const char *cache_control;
    const char *retry_after; /* seconds, or NULL */
    char etag[64];           /* ETag with its quotes, or "" */
    const char *encoding;    /* "gzip", or "identity" of what can be had as gzip too; or NULL */
    bool routine;            /* for the log, a read: of workers there may be hundreds a second */
    bool live;               /* an event stream: proxies are not to collect it */
    const char *route;       /* for log and counters: the pattern that the path met, or NULL */
    char owner[OWNER_SIZE];  /* for the log: who asked, "" = not known */
};
void reply_fini(struct reply *reply);

/* A request that is over, for logs and counters. */
struct http_done {
    const struct reply *reply; /* without its body */
    const char *method, *path, *id;
    uint64_t bytes; /* of the body, made for the client if not taken by it */
    int64_t us;     /* from the request's line to the answer's last byte */
    bool held;      /* it waited for something */
    bool cut;       /* the answer was not sent to its end */
};
typedef void http_observer(void *context, const struct http_done *done);

typedef void http_handler(void *context, const struct request *request, struct reply *reply);

struct http_options {
    const char *host; /* numeric address */
    const char *const
        *names;              /* other names of this server, borrowed; NULL ends them. May be NULL */
    uint16_t port;           /* 0 = pick a free one */
    int64_t request_age_ms;  /* 0 = LIMIT_REQUEST_AGE_MS_MAX; less is for tests */
    int64_t stream_stall_ms; /* 0 = LIMIT_STREAM_STALL_MS_MAX */
    http_handler *handler;
    bool log_reads;          /* a line in the log for each read that goes well, too */
    http_observer *observer; /* may be NULL */
    void *context;           /* handed to both; shared by all threads of the server */
};

struct http;
/* Listens; NULL with words in reason when it cannot. */
struct http *http_start(const struct http_options *options, char *reason, size_t size);
uint16_t http_port(const struct http *http);
/* Something has changed that streams or holds may wait for. Any thread; not from `ready`. */
void http_pulse(struct http *http);

/* What is open at the moment. */
struct http_counts {
    size_t connections, streams, holds;
};
void http_count(struct http *http, struct http_counts *counts);

/* Takes no new connection, lets requests in progress end (bounded), stops. */
void http_stop(struct http *http);

#endif
