/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http.h - the only file that knows libmicrohttpd: sockets in, struct request out, struct reply
 * back. Limits on size, age and number of connections live here.
 */
#ifndef HTTP_H
#define HTTP_H

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
    const char *body;            /* NUL-terminated for convenience; size counts */
    size_t body_size;
    const struct request_query *query;
    size_t query_count;
};

/* A body that is made while it is sent, for answers too long to be held. `read` is called from one
 * thread at a time, not always the same, whenever the client has taken what came before: it writes
 * 1..size bytes and returns how many, or one of these. It must not wait for anything but disk. */
enum {
    STREAM_END = 0,
    STREAM_FAILED = -1, /* the connection is ended, so that the client knows: not a short file */
};
struct stream {
    ssize_t (*read)(void *state, char *to, size_t size); /* NULL = there is no stream */
    void (*free)(void *state);                           /* called once, sent or not; may be NULL */
    void *state;
};
void stream_fini(struct stream *stream);

/* The answer; filled by handlers through reply.h, sent and freed by http.c. */
struct reply {
    int status;
    const char *content_type;
    char *body; /* malloc'ed */
    size_t body_size;
    struct stream stream; /* in the place of body, when it has a `read` */
    char location[96]; /* Location header, or "" */
    char allow[48];    /* Allow header (405), or "" */
    const char *cache_control;
    const char *retry_after; /* seconds, or NULL */
};
void reply_fini(struct reply *reply);

typedef void http_handler(void *context, const struct request *request, struct reply *reply);

struct http_options {
    const char *host;       /* numeric address */
    uint16_t port;          /* 0 = pick a free one */
    int64_t request_age_ms; /* 0 = LIMIT_REQUEST_AGE_MS_MAX; less is for tests */
    int64_t stream_stall_ms; /* 0 = LIMIT_STREAM_STALL_MS_MAX */
    http_handler *handler;
    void *context; /* handed to handler; shared by all threads of the server */
};

struct http;
/* Listens; NULL with words in reason when it cannot. */
struct http *http_start(const struct http_options *options, char *reason, size_t size);
uint16_t http_port(const struct http *http);
/* Takes no new connection, lets requests in progress end (bounded), stops. */
void http_stop(struct http *http);

#endif
