/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reply.h"
#include "text.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DETAIL_SIZE = 512 };

#define TYPE "urn:problem-type:bcdd:"

static const struct {
    int status;
    const char *type, *title;
} problems[PROBLEMS] = {
    [PROBLEM_BAD_REQUEST] = {400, TYPE "bad-request", "The request cannot be understood"},
    [PROBLEM_QUERY] = {400, TYPE "bad-query", "The query parameters cannot be accepted"},
    [PROBLEM_NOT_JSON] = {400, TYPE "not-json", "The body is not JSON"},
    [PROBLEM_WHO] = {401, TYPE "unauthenticated", "This needs a token"},
    [PROBLEM_ROLE] = {403, TYPE "not-allowed", "This token does not allow this"},
    [PROBLEM_FORBIDDEN] = {403, TYPE "forbidden", "Not from here"},
    [PROBLEM_NOT_FOUND] = {404, TYPE "not-found", "There is no such thing"},
    [PROBLEM_METHOD] = {405, TYPE "method-not-allowed", "This path has no such method"},
    [PROBLEM_STATE] = {409, TYPE "wrong-state", "The job's state does not allow this"},
    [PROBLEM_TOKENS] = {409, TYPE "tokens", "The tokens that there are do not allow this"},
    [PROBLEM_MEASURING] = {409, TYPE "measuring", "The report's state does not allow this"},
    [PROBLEM_TOO_LARGE] = {413, TYPE "too-large", "The body is too large"},
    [PROBLEM_MEDIA_TYPE] = {415, TYPE "media-type", "The body must be JSON"},
    [PROBLEM_WRONG_HOST] = {421, TYPE "wrong-host", "This server does not go by that name"},
    [PROBLEM_INVALID_JOB] = {422, TYPE "invalid-job", "The job has faults"},
    [PROBLEM_TOO_COSTLY] = {422, TYPE "too-costly", "The job is beyond this server's limits"},
    [PROBLEM_QUOTA] = {429, TYPE "over-quota", "This is more than its owner may have"},
    [PROBLEM_KEY_REUSED] = {422, TYPE "key-reused", "The idempotency key belongs to another job"},
    [PROBLEM_INTERNAL] = {500, TYPE "internal", "The server failed"},
    [PROBLEM_BUSY] = {503, TYPE "busy", "The server cannot take this now"},
    [PROBLEM_DISK_FULL] = {507, TYPE "disk-full", "The server's disk is full"},
};

static void begin(struct reply *reply);
static void fill_take(struct reply *reply, int status, const char *content_type, char *body);
static struct text begin_problem(enum problem problem, const char *detail);
static void end_problem(struct reply *reply, enum problem problem, struct text *text);

int reply_problem_status(enum problem problem)
{
    return problems[problem].status;
}

const char *reply_problem_type(enum problem problem)
{
    return problems[problem].type;
}

const char *reply_problem_title(enum problem problem)
{
    return problems[problem].title;
}

void reply_fini(struct reply *reply)
{
    free(reply->body);
    stream_fini(&reply->stream);
    hold_fini(&reply->hold);
    *reply = (struct reply){0};
}

void stream_fini(struct stream *stream)
{
    if (stream->read && stream->free)
        stream->free(stream->state);
    *stream = (struct stream){0};
}

void hold_fini(struct hold *hold)
{
    if (hold->ready && hold->free)
        hold->free(hold->state);
    *hold = (struct hold){0};
}

void reply_json_take(struct reply *reply, char *json)
{
    fill_take(reply, 200, "application/json", json);
}

void reply_accepted_take(struct reply *reply, const char *location, char *json)
{
    fill_take(reply, 202, "application/json", json);
    snprintf(reply->location, sizeof(reply->location), "%s", location);
}

void reply_created_take(struct reply *reply, const char *location, char *json)
{
    fill_take(reply, 201, "application/json", json);
    snprintf(reply->location, sizeof(reply->location), "%s", location);
}

void reply_later_take(struct reply *reply, const char *location, char *json)
{
    reply_accepted_take(reply, location, json);
    reply->retry_after = "1";
}

void reply_text_take(struct reply *reply, const char *content_type, char *text)
{
    fill_take(reply, 200, content_type, text);
}

void reply_bytes(struct reply *reply, const char *content_type, const char *encoding,
                 const void *bytes, size_t size)
{
    char *copy = malloc(size + 1);
    if (copy) {
        memcpy(copy, bytes, size);
        copy[size] = '\0';
    }
    fill_take(reply, 200, content_type, copy);
    if (copy) {
        reply->body_size = size;
        reply->encoding = encoding;
    }
}

void reply_stream_take(struct reply *reply, const char *content_type, const struct stream *stream)
{
    fill_take(reply, 503, content_type, NULL);
    reply->stream = *stream;
    if (stream->read)
        reply->status = 200;
}

void reply_events_take(struct reply *reply, const struct stream *stream)
{
    reply_stream_take(reply, "text/event-stream", stream);
    reply->live = true;
}

void reply_hold_take(struct reply *reply, const struct hold *hold)
{
    begin(reply);
    reply->hold = *hold;
}

void reply_immutable(struct reply *reply, const char *etag)
{
    if (reply->status != 200 && reply->status != 304)
        return;
    reply->cache_control = "private, max-age=86400, immutable";
    if (etag)
        snprintf(reply->etag, sizeof(reply->etag), "\"%s\"", etag);
}

void reply_revalidate(struct reply *reply, const char *etag)
{
    if (reply->status != 200 && reply->status != 304)
        return;
    reply->cache_control = "private, no-cache";
    if (etag)
        snprintf(reply->etag, sizeof(reply->etag), "\"%s\"", etag);
}

bool reply_unchanged(struct reply *reply, const struct request *request, const char *etag)
{
    const char *rest = request->if_none_match;
    size_t length = strlen(etag);
    bool same = false;
    /* "a", W/"b", ...: weak comparison, and the tags hold no commas of their own */
    while (rest && *rest && !same) {
        rest += strspn(rest, " \t,");
        rest += strncmp(rest, "W/", 2) == 0 ? 2 : 0;
        same = rest[0] == '"' && strncmp(rest + 1, etag, length) == 0 && rest[1 + length] == '"';
        rest += strcspn(rest, ",");
    }
    if (same) {
        begin(reply);
        reply->status = 304;
    }
    return same;
}

void reply_problem(struct reply *reply, enum problem problem, const char *format, ...)
{
    char detail[DETAIL_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(detail, sizeof(detail), format, args);
    va_end(args);
    struct text text = begin_problem(problem, detail);
    end_problem(reply, problem, &text);
}

void reply_faults(struct reply *reply, enum problem problem, const struct bcd_errors *errors,
                  const char *more)
{
    char detail[DETAIL_SIZE];
    size_t count = errors->count + errors->dropped;
    const struct bcd_error *first = &errors->items[0];
    assert(errors->count > 0);
    snprintf(detail, sizeof(detail), "%s%s%s", first->field, first->field[0] ? ": " : "",
             first->text);
    if (count > 1)
        snprintf(detail, sizeof(detail), "%zu faults; the first: %s%s%s", count, first->field,
                 first->field[0] ? ": " : "", first->text);
    struct text text = begin_problem(problem, detail);
    text_add(&text, ",\"errors\":[");
    for (size_t i = 0; i < errors->count; i++) {
        const struct bcd_error *error = &errors->items[i];
        text_add(&text, "%s{\"%s\":", i ? "," : "",
                 problem == PROBLEM_QUERY ? "parameter" : "pointer");
        text_add_json_string(&text, error->field);
        text_add(&text, ",\"detail\":");
        text_add_json_string(&text, error->text);
        text_add(&text, "}");
    }
    text_add(&text, "]");
    if (more)
        text_add(&text, ",%s", more);
    end_problem(reply, problem, &text);
}

void reply_method(struct reply *reply, const char *method, const char *allow)
{
    reply_problem(reply, PROBLEM_METHOD, "%.32s is not possible here; %s is", method, allow);
    snprintf(reply->allow, sizeof(reply->allow), "%s", allow);
}

void reply_store(struct reply *reply, enum store_status status, const char *what)
{
    switch (status) {
    case STORE_NOT_FOUND:
        reply_problem(reply, PROBLEM_NOT_FOUND, "there is no %s", what);
        break;
    case STORE_CONFLICT:
        reply_problem(reply, PROBLEM_STATE, "%s is in another state than this needs", what);
        break;
    case STORE_QUOTA:
        reply_problem(reply, PROBLEM_QUOTA, "%s is more than its owner may have", what);
        break;
    case STORE_FULL:
        reply_problem(reply, PROBLEM_DISK_FULL, "nothing was changed: %s", what);
        break;
    case STORE_OK:
    case STORE_BROKEN:
        reply_problem(reply, PROBLEM_INTERNAL, "the store failed, the log says how: %s", what);
        break;
    }
}

void reply_bcd(struct reply *reply, enum bcd_status status, const struct bcd_errors *errors)
{
    if (status == BCD_INVALID && errors && errors->count > 0)
        reply_faults(reply,
                     errors->items[0].code == BCD_CORRUPT ? PROBLEM_NOT_JSON : PROBLEM_INVALID_JOB,
                     errors, NULL);
    else if (status == BCD_NO_MEMORY)
        reply_problem(reply, PROBLEM_BUSY, "out of memory");
    else
        reply_problem(reply, PROBLEM_INTERNAL, "the engine failed: %s", bcd_status_text(status));
}

/* Empty but for who asked for what. */
static void begin(struct reply *reply)
{
    struct reply kept = {.route = reply->route};
    memcpy(kept.owner, reply->owner, sizeof(kept.owner));
    reply_fini(reply);
    *reply = kept;
}

static void fill_take(struct reply *reply, int status, const char *content_type, char *body)
{
    begin(reply);
    reply->status = body ? status : 503;
    reply->content_type = content_type;
    reply->body = body;
    reply->body_size = body ? strlen(body) : 0;
    reply->cache_control = "no-store";
}

static struct text begin_problem(enum problem problem, const char *detail)
{
    struct text text = {0};
    text_add(&text,
             "{\"type\":\"%s\",\"title\":\"%s\",\"status\":%d,\"detail\":", problems[problem].type,
             problems[problem].title, problems[problem].status);
    text_add_json_string(&text, detail);
    return text;
}

static void end_problem(struct reply *reply, enum problem problem, struct text *text)
{
    text_add(text, "}\n");
    fill_take(reply, problems[problem].status, "application/problem+json", text_take(text));
}
