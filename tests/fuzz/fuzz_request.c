/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz.h"

#include "server/stage.h"

#include "http_guard.h"
#include "limits.h"
#include "text.h"

#include <jansson.h>
#include <string.h>

enum { AGE_MAX = 400 }; /* requests to one stage, so that what they leave does not grow for ever */

/* As http.c would send it, as far as it goes on without anything happening. */
static void read_stream(struct stream *stream)
{
    char piece[4096];
    for (int i = 0; i < 50; i++) {
        if (stream->ready)
            stream->ready(stream->state);
        ssize_t got = stream->read(stream->state, piece, sizeof(piece));
        FUZZ_CHECK(got <= (ssize_t)sizeof(piece) && got != STREAM_FAILED);
        if (got == STREAM_END || (got == STREAM_LATER && stream->ready))
            return;
        FUZZ_CHECK(got > 0);
    }
}

static void check_reply(struct reply *reply, const char *target)
{
    bool json = reply->content_type && (strstr(reply->content_type, "/json") != NULL ||
                                        strstr(reply->content_type, "+json") != NULL);
    if (reply->hold.ready) {
        reply->hold.ready(reply->hold.state);
        return;
    }
    if (reply->status == 500)
        fprintf(stderr, "%s: %s\n", target, reply->body ? reply->body : "-");
    FUZZ_CHECK(reply->status >= 200 && reply->status < 504 && reply->status != 500);
    if (reply->stream.read)
        read_stream(&reply->stream);
    FUZZ_CHECK(reply->status != 405 || reply->allow[0]);
    FUZZ_CHECK(reply->body || reply->stream.read || reply->status == 304);
    if (!json || !reply->body)
        return;
    json_error_t error;
    json_t *body =
        json_loadb(reply->body, reply->body_size, JSON_DECODE_ANY | JSON_ALLOW_NUL, &error);
    if (!body)
        fprintf(stderr, "%s\n%s: %s in line %d\n", reply->body, target, error.text, error.line);
    FUZZ_CHECK(body);
    FUZZ_CHECK(reply->status < 400 ||
               json_integer_value(json_object_get(body, "status")) == reply->status);
    json_decref(body);
}

/* The target as http.c takes it apart. */
static void dispatch(struct stage *stage, struct request *request, char *target)
{
    struct request_query query[LIMIT_QUERY_MAX];
    size_t count = 0;
    char *host = NULL, *question = strchr(target, '?');
    if (question)
        *question++ = '\0';
    const char *fault = http_guard_target(target, &host);
    if (host)
        http_guard_host(host, "127.0.0.1", NULL);
    free(host);
    if (!fault)
        fault = http_guard_query(question, query, LIMIT_QUERY_MAX, &count);
    if (fault)
        return;
    request->path = target;
    request->query = query;
    request->query_count = count;
    struct desk *desk = &stage->desk;
    reply_fini(&desk->reply);
    desk->reply = (struct reply){0};
    routes_dispatch(&desk->service, request, &desk->reply);
    check_reply(&desk->reply, target);
    reply_fini(&desk->reply);
    desk->reply = (struct reply){0};
}

/* The next line, ended; *rest goes on behind it. */
static char *line(char **rest)
{
    char *begin = *rest, *end = strchr(begin, '\n');
    if (end)
        *end = '\0';
    *rest = end ? end + 1 : begin + strlen(begin);
    return begin;
}

static void read_header(struct request *request, const char *header)
{
    const struct {
        const char *name;
        const char **value;
    } rows[] = {{"idempotency-key: ", &request->idempotency_key},
                {"content-type: ", &request->content_type},
                {"authorization: ", &request->authorization},
                {"if-none-match: ", &request->if_none_match},
                {"last-event-id: ", &request->last_event_id},
                {"accept-encoding: ", &request->accept_encoding}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
        if (strncmp(header, rows[i].name, strlen(rows[i].name)) == 0)
            *rows[i].value = header + strlen(rows[i].name);
}

/* One for many inputs: to set it up takes longer than they do. */
static struct stage *held_stage(void)
{
    static struct stage stage;
    static int age = AGE_MAX;
    static bool open;
    if (++age > AGE_MAX) {
        if (open)
            stage_close(&stage);
        stage_open(&stage);
        open = true;
        age = 0;
    }
    return &stage;
}

void fuzz_request(const uint8_t *data, size_t size)
{
    struct stage *stage = held_stage();
    char *raw = fuzz_text(data, size), *text = stage_with_ids(stage, raw), *rest = text, *header;
    char *method = line(&rest), *target = strchr(method, ' ');
    struct request request = {.last = true};
    if (target) {
        *target++ = '\0';
        while (*(header = line(&rest)))
            read_header(&request, header);
        request.method = method;
        request.body = rest;
        request.body_size = strlen(rest);
        dispatch(stage, &request, target);
    }
    free(text);
    free(raw);
}

void fuzz_find(const uint8_t *data, size_t size)
{
    struct stage *stage = held_stage();
    char *raw = fuzz_text(data, size), *query = stage_with_ids(stage, raw);
    struct text target = {0};
    text_add(&target, "/v1/jobs?%s", query);
    char *taken = text_take(&target);
    struct request request = {.method = "GET", .last = true, .body = ""};
    FUZZ_CHECK(taken);
    dispatch(stage, &request, taken);
    free(taken);
    free(query);
    free(raw);
}
