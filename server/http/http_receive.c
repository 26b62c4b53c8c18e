/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_receive.c - what comes in: headers looked at before a body is read, bodies within limits.
 * The library lets contradicting lengths pass, on which request smuggling lives; that is seen to
 * here.
 */
#include "http_guard.h"
#include "http_internal.h"
#include "limits.h"
#include "reply.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void http_receive_id(struct http *http, struct MHD_Connection *connection,
                     struct exchange *exchange)
{
    static const char sane[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    const char *given = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "X-Request-Id");
    size_t length = given ? strlen(given) : 0;
    if (length > 0 && length < sizeof(exchange->id) && strspn(given, sane) == length) {
        memcpy(exchange->id, given, length + 1);
        return;
    }
    uint64_t number = http->id_base + atomic_fetch_add(&http->next_id, 1);
    number = (number ^ number >> 30) * UINT64_C(0xbf58476d1ce4e5b9); /* splitmix64: one to one */
    number = (number ^ number >> 27) * UINT64_C(0x94d049bb133111eb);
    snprintf(exchange->id, sizeof(exchange->id), "%016" PRIx64, number ^ number >> 31);
}

struct headers {
    int lengths, encodings, hosts, blanks, folded;
    const char *length, *encoding, *host, *origin;
};

/* A header that goes on in the next line: the library appends that to the name. */
static bool is_longer(const char *key, const char *name)
{
    size_t length = strlen(name);
    return strncasecmp(key, name, length) == 0 && key[length] != '\0';
}

static enum MHD_Result note_header(void *context, enum MHD_ValueKind kind, const char *key,
                                   const char *value)
{
    struct headers *headers = context;
    (void)kind;
    headers->blanks += key[strcspn(key, " \t")] != '\0'; /* "Transfer-Encoding :" */
    headers->folded += is_longer(key, "Content-Length") || is_longer(key, "Transfer-Encoding");
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

void http_receive_headers(struct http *http, struct MHD_Connection *connection, const char *version,
                          struct exchange *exchange)
{
    struct headers seen = {0};
    struct reply *reply = &exchange->reply;
    char *host = NULL;
    const char *fault = http_guard_target(exchange->uri, &host);
    MHD_get_connection_values(connection, MHD_HEADER_KIND, note_header, &seen);
    bool digits = !seen.length ||
                  (seen.length[0] && strspn(seen.length, "0123456789") == strlen(seen.length));
    exchange->refused = true;
    if (seen.lengths + seen.encodings > 1 || !digits ||
        (seen.encoding && strcasecmp(seen.encoding, "chunked") != 0))
        reply_problem(reply, PROBLEM_BAD_REQUEST,
                      "Content-Length and Transfer-Encoding contradict each other");
    else if (seen.blanks + seen.folded > 0)
        reply_problem(reply, PROBLEM_BAD_REQUEST,
                      "a header has blanks in its name, or goes on in a second line");
    else if (seen.hosts > 1 || (seen.hosts == 0 && strcmp(version, MHD_HTTP_VERSION_1_0) != 0))
        reply_problem(reply, PROBLEM_BAD_REQUEST, "there must be one Host header");
    else if (fault)
        reply_problem(reply, PROBLEM_BAD_REQUEST, "%s", fault);
    else if ((seen.host && !http_guard_host(seen.host, http->host, http->options.names)) ||
             (host && !http_guard_host(host, http->host, http->options.names)))
        reply_problem(reply, PROBLEM_WRONG_HOST,
                      "ask for localhost or 127.0.0.1, or a name that it was given by --host-name");
    else if (seen.origin && !http_guard_origin(seen.origin, seen.host))
        reply_problem(reply, PROBLEM_FORBIDDEN, "pages of other origins have no access");
    else if (seen.length && strtoull(seen.length, NULL, 10) > LIMIT_BODY_BYTES_MAX)
        reply_problem(reply, PROBLEM_TOO_LARGE, "a body may have at most %d bytes, this has %.32s",
                      LIMIT_BODY_BYTES_MAX, seen.length);
    else
        exchange->refused = false;
    free(host);
}

void http_receive_body(struct http *http, struct exchange *exchange, const char *bytes, size_t size)
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
        http_receive_drop(http, exchange);
        return;
    }
    memcpy(exchange->body + exchange->body_size, bytes, size);
    exchange->body_size += size;
    exchange->body[exchange->body_size] = '\0';
}

void http_receive_drop(struct http *http, struct exchange *exchange)
{
    atomic_fetch_sub(&http->body_bytes, exchange->body_room);
    free(exchange->body);
    exchange->body = NULL;
    exchange->body_size = exchange->body_room = 0;
}
