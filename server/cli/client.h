/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * client.h - one server, asked over HTTP by libcurl (client.c alone knows it).
 *
 * A request whose connection is lost is sent again until patience ends, so that a
 * restart goes unnoticed; what must not happen twice needs a key (Idempotency-Key) or `once`. A
 * server that was never met is given up at once.
 *
 * THREADS  One. While a client exists the signals that end the program are blocked and make
 *          client_ask and client_wait return, so that whoever asked can clean up.
 */
#ifndef CLIENT_H
#define CLIENT_H

#include "text.h"

#include <stdint.h>

enum {
    CLIENT_CONNECT_MS = 5000,
    CLIENT_SILENCE_S = 60,      /* without a byte: a server has a minute for a long poll */
    CLIENT_PATIENCE_MS = 15000, /* for a server that went away */
    CLIENT_BODY_BYTES_MAX = 256 << 20,
    CLIENT_KEY_SIZE = 40
};

enum client_status {
    CLIENT_OK,          /* there is an answer, of any status */
    CLIENT_UNREACHABLE, /* no server, or it is gone; client_words() */
    CLIENT_LOST,        /* the answer broke off after `take` had seen part of it */
    CLIENT_STOPPED,     /* `take` said so */
    CLIENT_SIGNAL,      /* client_signal() */
};

struct client_options {
    const char *url;   /* http://host:port, or https; a path in front of /v1 is possible */
    const char *token; /* NULL = none */
    int64_t silence_s; /* 0 = CLIENT_SILENCE_S */
};

struct client;
/* NULL with words in reason. Strings are copied. */
struct client *client_create(const struct client_options *options, char *reason, size_t size);
void client_free(struct client *client);

struct client_request {
    const char *method;
    const char *path; /* "/v1/jobs?limit=5", encoded */
    const char *body; /* JSON, or NULL */
    size_t body_size;
    const char *key; /* Idempotency-Key, or NULL */
    bool once;       /* must not be sent a second time */
    bool events;     /* asks for an event stream */
    /* Of an answer 2xx: its bytes as they come instead of a body; false = enough. */
    bool (*take)(void *context, const char *bytes, size_t size);
    void (*tick)(void *context); /* several times a second, or NULL */
    void (*lost)(void *context); /* before the request is sent again, or NULL */
    void *context;
};

struct client_answer {
    int status; /* HTTP */
    char type[64];
    char *body; /* NUL-terminated, malloc'ed */
    size_t size;
};
void client_answer_fini(struct client_answer *answer);

/* Only with CLIENT_OK is there an answer, which the caller fini()s. */
enum client_status client_ask(struct client *client, const struct client_request *request,
                              struct client_answer *answer);

/* Sleeps, at most until the stream brought something; false when a signal came. */
bool client_wait(struct client *client, int64_t ms);

/* One answer may go on in the background while others are asked: a stream of events, which
 * request->take sees. The request must live until client_stream_end. False = it cannot be sent. */
bool client_stream_begin(struct client *client, const struct client_request *request);
/* HTTP status, 0 while there is none yet; whether it goes on. */
int client_stream_status(const struct client *client);
bool client_stream_open(const struct client *client);
void client_stream_end(struct client *client);

/* How long a server that was met is waited for, from now on. */
void client_patience(struct client *client, int64_t ms);

int client_signal(const struct client *client);        /* the signal that came, or 0 */
const char *client_words(const struct client *client); /* why the last request had no answer */
const char *client_url(const struct client *client);

/* A key that no other request has. */
void client_key(char key[CLIENT_KEY_SIZE]);

/* Adds "?name=value" or "&name=value" to a path, encoded. */
void client_add_query(struct text *path, const char *name, const char *value);

#endif
