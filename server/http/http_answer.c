/* SPDX-License-Identifier: GPL-3.0-or-later
 * http_answer.c - what goes out: headers that every answer has, the body, and the line in the log.
 */
#include "http_internal.h"
#include "log.h"
#include "reply.h"
#include "secret.h"

#include <stdio.h>
#include <string.h>

static void hold_answer(struct http *http, struct exchange *exchange);
static struct MHD_Response *make_response(struct http *http, struct connection *c);
static struct MHD_Response *make_head(struct reply *reply);
static enum MHD_Result add_headers(const struct http *http, const struct exchange *exchange,
                                   struct MHD_Response *response);
static const char *without_secret(const char *path, char *shown, size_t size);

enum MHD_Result http_answer(struct http *http, struct connection *c)
{
    struct exchange *exchange = c->exchange;
    struct reply *reply = &exchange->reply;
    http_receive_drop(http, exchange);
    bool head = strcmp(exchange->method, "HEAD") == 0;
    if (!head && reply->stream.ready && atomic_fetch_add(&http->streams, 1) >= LIMIT_STREAMS_MAX) {
        atomic_fetch_sub(&http->streams, 1);
        reply_problem(reply, PROBLEM_BUSY, "%d event streams are open already (LIMIT_STREAMS_MAX)",
                      LIMIT_STREAMS_MAX);
    }
    hold_answer(http, exchange);
    exchange->answer_bytes = head ? 0 : reply->body_size;
    struct MHD_Response *response =
        head && reply->stream.read ? make_head(reply) : make_response(http, c);
    if (!response)
        return MHD_NO;
    enum MHD_Result sound = add_headers(http, exchange, response);
    http_set_phase(http, c->handle, PHASE_ANSWERING, LIMIT_ANSWER_AGE_MS_MAX);
    if (sound == MHD_YES)
        sound = MHD_queue_response(c->handle, (unsigned)reply->status, response);
    MHD_destroy_response(response);
    exchange->answered = true;
    return sound;
}

/* Who reads answers slowly, or not at all, has them kept here: all together within bounds. The only
 * one may be as long as it likes. */
static void hold_answer(struct http *http, struct exchange *exchange)
{
    struct reply *reply = &exchange->reply;
    size_t size = reply->body_size;
    size_t others = atomic_fetch_add(&http->answers_bytes, size);
    if (others > 0 && others + size > LIMIT_ANSWERS_BYTES_MAX) {
        atomic_fetch_sub(&http->answers_bytes, size);
        reply_problem(reply, PROBLEM_BUSY,
                      "%zu bytes of answers wait to be taken already (LIMIT_ANSWERS_BYTES_MAX)",
                      others);
        size = 0;
    }
    exchange->answer_held = size;
}

/* Takes body or stream out of the reply; NULL = no memory. */
static struct MHD_Response *make_response(struct http *http, struct connection *c)
{
    struct reply *reply = &c->exchange->reply;
    if (reply->stream.read) {
        bool counted = reply->stream.ready != NULL;
        struct MHD_Response *response = http_stream_take(http, c);
        if (!response && counted)
            atomic_fetch_sub(&http->streams, 1);
        return response;
    }
    if (!reply->body)
        return MHD_create_response_from_buffer(0, NULL, MHD_RESPMEM_PERSISTENT);
    struct MHD_Response *response =
        MHD_create_response_from_buffer(reply->body_size, reply->body, MHD_RESPMEM_MUST_FREE);
    if (response)
        reply->body = NULL;
    return response;
}

static ssize_t read_nothing(void *state, uint64_t position, char *to, size_t size)
{
    (void)state, (void)position, (void)to, (void)size;
    return MHD_CONTENT_READER_END_OF_STREAM;
}

/* The headers of a stream alone. Not as chunks: the library would send the last one. */
static struct MHD_Response *make_head(struct reply *reply)
{
    stream_fini(&reply->stream);
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, 1, read_nothing, NULL, NULL);
    if (response)
        MHD_set_response_options(response, MHD_RF_HTTP_VERSION_1_0_ONLY, MHD_RO_END);
    return response;
}

/* What an answer may do when somebody opens it: a picture may have its styles, the page the
 * scripts, styles and answers of this server (and pictures that it made of them), all else nothing.
 */
static const char *policy(const char *type)
{
    if (type && strcmp(type, "image/svg+xml") == 0)
        return "default-src 'none'; style-src 'unsafe-inline'";
    if (type && strncmp(type, "text/html", 9) == 0)
        return "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
               "img-src 'self' blob:; base-uri 'none'; form-action 'none'; "
               "frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types 'none'";
    return "default-src 'none'; frame-ancestors 'none'";
}

static enum MHD_Result add_headers(const struct http *http, const struct exchange *exchange,
                                   struct MHD_Response *response)
{
    const struct reply *reply = &exchange->reply;
    bool packed = reply->encoding && strcmp(reply->encoding, "identity") != 0;
    const struct {
        const char *name, *value;
    } headers[] = {
        {MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type},
        {MHD_HTTP_HEADER_CACHE_CONTROL, reply->cache_control},
        {MHD_HTTP_HEADER_ETAG, reply->etag[0] ? reply->etag : NULL},
        {MHD_HTTP_HEADER_LOCATION, reply->location[0] ? reply->location : NULL},
        {MHD_HTTP_HEADER_ALLOW, reply->allow[0] ? reply->allow : NULL},
        {MHD_HTTP_HEADER_RETRY_AFTER, reply->status == 503 ? "1" : reply->retry_after},
        {MHD_HTTP_HEADER_WWW_AUTHENTICATE, reply->status == 401 ? "Bearer realm=\"bcdd\"" : NULL},
        {MHD_HTTP_HEADER_CONNECTION,
         exchange->refused || atomic_load(&http->stopping) ? "close" : NULL},
        {MHD_HTTP_HEADER_CONTENT_ENCODING, packed ? reply->encoding : NULL},
        {MHD_HTTP_HEADER_VARY, reply->encoding ? "Accept-Encoding" : NULL},
        /* 304: that of the answer it stands for goes on to hold */
        {"Content-Security-Policy", reply->status == 304 ? NULL : policy(reply->content_type)},
        {"Cross-Origin-Opener-Policy", "same-origin"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Referrer-Policy", "no-referrer"},
        {"X-Accel-Buffering", reply->live ? "no" : NULL},
        {"X-Content-Type-Options", "nosniff"},
        {"X-Frame-Options", "DENY"},
        {"X-Request-Id", exchange->id},
    };
    enum MHD_Result sound = MHD_YES;
    for (size_t i = 0; i < sizeof(headers) / sizeof(headers[0]) && sound == MHD_YES; i++)
        if (headers[i].value)
            sound = MHD_add_response_header(response, headers[i].name, headers[i].value);
    return sound;
}

void http_answer_done(struct http *http, struct exchange *exchange, bool cut)
{
    const struct reply *reply = &exchange->reply;
    if (!exchange->answered)
        return;
    const struct http_done done = {.reply = reply,
                                   .method = exchange->method,
                                   .path = exchange->uri,
                                   .id = exchange->id,
                                   .bytes = exchange->answer_bytes,
                                   .us = http_clock_us() - exchange->began_us,
                                   .held = exchange->was_held,
                                   .cut = cut};
    if (http->options.observer)
        http->options.observer(http->options.context, &done);
    bool reads = strcmp(done.method, "GET") == 0 || strcmp(done.method, "HEAD") == 0 ||
                 reply->routine;
    if (!http->options.log_reads && reads && reply->status < 400)
        return;
    char shown[256];
    log_write(LOG_LEVEL_INFO, "request",
              LOG_FIELDS(log_text("method", done.method),
                         log_text("path", without_secret(done.path, shown, sizeof(shown))),
                         log_integer("status", reply->status),
                         log_integer("bytes", (int64_t)done.bytes),
                         log_number("ms", (double)done.us / 1000),
                         log_text("owner", reply->owner[0] ? reply->owner : NULL),
                         log_text("request", done.id), log_text("end", cut ? "cut" : "whole"),
                         log_text(reply->location[0] ? "location" : NULL, reply->location)));
}

/* A token put where an id belongs (to be revoked, say) must not get into the log. */
static const char *without_secret(const char *path, char *shown, size_t size)
{
    const char *secret = secret_find(path);
    if (!secret)
        return path;
    snprintf(shown, size, "%.*s...", (int)(secret - path), path);
    return shown;
}
