/* SPDX-License-Identifier: GPL-3.0-or-later
 * http_answer.c - what goes out: headers that every answer has, and the body. */
#include "http_internal.h"
#include "limits.h"
#include "log.h"

#include <string.h>

static struct MHD_Response *make_response(struct http *http, struct MHD_Connection *connection,
                                          struct reply *reply);

enum MHD_Result http_answer(struct http *http, struct MHD_Connection *connection,
                            const char *method, struct exchange *exchange)
{
    struct reply *reply = &exchange->reply;
    struct MHD_Response *response = make_response(http, connection, reply);
    if (!response)
        return MHD_NO;
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
    http_set_phase(http, connection, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
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

/* Takes body or stream out of the reply; NULL = no memory. */
static struct MHD_Response *make_response(struct http *http, struct MHD_Connection *connection,
                                          struct reply *reply)
{
    if (reply->stream.read)
        return http_stream_take(http, connection, &reply->stream);
    if (!reply->body)
        return MHD_create_response_from_buffer(0, NULL, MHD_RESPMEM_PERSISTENT);
    struct MHD_Response *response =
        MHD_create_response_from_buffer(reply->body_size, reply->body, MHD_RESPMEM_MUST_FREE);
    if (response)
        reply->body = NULL;
    return response;
}
