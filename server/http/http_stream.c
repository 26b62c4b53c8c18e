/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_stream.c - bodies that are made while they are sent, in pieces of what the connection's
 * memory holds. The library asks for a piece when the one before has left.
 */
#include "http_internal.h"
#include "log.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum { BLOCK_BYTES = 32 << 10 };

/* A stream on its way out; freed with the response. */
struct pull {
    struct http *http;
    struct connection *connection;
    struct exchange *exchange; /* is there as long as something is read */
    struct stream stream;
};

static ssize_t pull(void *context, uint64_t position, char *to, size_t size);
static ssize_t next_piece(struct pull *pull, char *to, size_t size);
static ssize_t give_up(const struct pull *pull);
static void free_pull(void *context);

struct MHD_Response *http_stream_take(struct http *http, struct connection *c)
{
    struct pull *made = malloc(sizeof(*made));
    if (!made)
        return NULL;
    *made = (struct pull){.http = http,
                          .connection = c,
                          .exchange = c->exchange,
                          .stream = c->exchange->reply.stream};
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, BLOCK_BYTES, pull, made, free_pull);
    if (!response) {
        free(made);
        return NULL;
    }
    c->exchange->reply.stream = (struct stream){0};
    return response;
}

static ssize_t pull(void *context, uint64_t position, char *to, size_t size)
{
    struct pull *pull = context;
    struct http *http = pull->http;
    struct MHD_Connection *connection = pull->connection->handle;
    (void)position;
    if (pull->stream.ready && http_rest_end(http, pull->connection) == WOKEN_LEFT)
        return MHD_CONTENT_READER_END_WITH_ERROR;
    http_set_phase(http, connection, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
    ssize_t got = next_piece(pull, to, size);
    if (got == STREAM_LATER)
        return 0;
    http_set_phase(http, connection, PHASE_ANSWERING, http->options.stream_stall_ms);
    if (got > 0)
        pull->exchange->answer_bytes += (uint64_t)got;
    else
        got = got == STREAM_END ? MHD_CONTENT_READER_END_OF_STREAM : give_up(pull);
    return got;
}

/* STREAM_LATER: the connection rests, and others may look at the stream now. */
static ssize_t next_piece(struct pull *pull, char *to, size_t size)
{
    const struct stream *stream = &pull->stream;
    struct resting resting = {
        .ready = stream->ready, .state = stream->state, .until_ms = INT64_MAX};
    resting.pulses = atomic_load(&pull->http->pulses);
    ssize_t got = stream->read(stream->state, to, size);
    if (got != STREAM_LATER)
        return got;
    if (!stream->ready)
        return STREAM_FAILED;
    if (http_rest_begin(pull->http, pull->connection, &resting))
        return STREAM_LATER;
    return STREAM_END; /* the server stops; the client will connect to the next one */
}

/* The client must see that something is missing. The library leaves out the end of a chunked body,
 * but a client of HTTP/1.0 takes the connection's end for the body's: it is reset, not closed. */
static ssize_t give_up(const struct pull *pull)
{
    const struct sockaddr nowhere = {.sa_family = AF_UNSPEC};
    log_write(
        LOG_LEVEL_ERROR, "stream_failed",
        LOG_FIELDS(log_text("path", pull->exchange->uri), log_text("request", pull->exchange->id)));
    (void)!connect(pull->connection->fd, &nowhere, sizeof(nowhere));
    return MHD_CONTENT_READER_END_WITH_ERROR;
}

static void free_pull(void *context)
{
    struct pull *pull = context;
    if (pull->stream.ready)
        atomic_fetch_sub(&pull->http->streams, 1);
    stream_fini(&pull->stream);
    free(pull);
}
