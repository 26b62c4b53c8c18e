/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_stream.c - bodies that are made while they are sent, in pieces of what the connection's
 * memory holds. The library asks for a piece when the one before has left.
 */
#include "http_internal.h"
#include "limits.h"
#include "log.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum { BLOCK_BYTES = 32 << 10 };

/* A stream on its way out; freed with the response. */
struct pull {
    struct http *http;
    struct MHD_Connection *connection;
    struct stream stream;
};

static ssize_t pull(void *context, uint64_t position, char *to, size_t size);
static ssize_t give_up(const struct pull *pull);
static void free_pull(void *context);

struct MHD_Response *http_stream_take(struct http *http, struct MHD_Connection *connection,
                                      struct stream *stream)
{
    struct pull *made = malloc(sizeof(*made));
    if (!made)
        return NULL;
    *made = (struct pull){.http = http, .connection = connection, .stream = *stream};
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, BLOCK_BYTES, pull, made, free_pull);
    if (response)
        *stream = (struct stream){0};
    else
        free(made);
    return response;
}

static ssize_t pull(void *context, uint64_t position, char *to, size_t size)
{
    struct pull *pull = context;
    (void)position;
    http_set_phase(pull->http, pull->connection, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
    ssize_t got = pull->stream.read(pull->stream.state, to, size);
    http_set_phase(pull->http, pull->connection, PHASE_ANSWERING,
                   pull->http->options.stream_stall_ms);
    if (got > 0)
        return got;
    return got == STREAM_END ? MHD_CONTENT_READER_END_OF_STREAM : give_up(pull);
}

/* The client must see that something is missing. The library leaves out the end of a chunked body,
 * but a client of HTTP/1.0 takes the connection's end for the body's: it is reset, not closed. */
static ssize_t give_up(const struct pull *pull)
{
    const struct sockaddr nowhere = {.sa_family = AF_UNSPEC};
    const struct connection *c = http_connection(pull->connection);
    log_write(LOG_LEVEL_ERROR, "stream_failed", NULL);
    if (c)
        (void)!connect(c->fd, &nowhere, sizeof(nowhere));
    return MHD_CONTENT_READER_END_WITH_ERROR;
}

static void free_pull(void *context)
{
    struct pull *pull = context;
    stream_fini(&pull->stream);
    free(pull);
}
