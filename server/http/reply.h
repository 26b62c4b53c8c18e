/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * reply.h - answers. The only place that knows HTTP status numbers: handlers say what happened.
 * Every function fills an empty struct reply; a reply whose text could not be allocated becomes a
 * bare 503.
 */
#ifndef REPLY_H
#define REPLY_H

#include "bcd.h"
#include "http.h"
#include "store.h"

/* What can be wrong with a request or with us; each has its status, title and type (RFC 9457). */
enum problem {
    PROBLEM_BAD_REQUEST,
    PROBLEM_QUERY, /* faults name query parameters instead of JSON pointers */
    PROBLEM_NOT_JSON,
    PROBLEM_WHO,  /* no token, or none that is good */
    PROBLEM_ROLE, /* a good token of somebody who may not do this */
    PROBLEM_FORBIDDEN,
    PROBLEM_NOT_FOUND,
    PROBLEM_METHOD,
    PROBLEM_STATE, /* the job is not in a state that allows this */
    PROBLEM_TOKENS, /* nor are the tokens: nobody could make another */
    PROBLEM_MEASURING, /* neither is the report: it is, or is not, being measured */
    PROBLEM_TOO_LARGE,
    PROBLEM_MEDIA_TYPE,
    PROBLEM_WRONG_HOST,
    PROBLEM_INVALID_JOB,
    PROBLEM_TOO_COSTLY, /* a sound job beyond what this server takes */
    PROBLEM_QUOTA, /* a sound job, but its owner has enough already */
    PROBLEM_KEY_REUSED, /* Idempotency-Key of another job */
    PROBLEM_INTERNAL,
    PROBLEM_BUSY,
    PROBLEM_DISK_FULL,
    PROBLEMS
};

/* What a problem is to a client. */
int reply_problem_status(enum problem problem);
const char *reply_problem_type(enum problem problem);
const char *reply_problem_title(enum problem problem);

/* Texts are malloc'ed and taken over; NULL = out of memory. */
void reply_json_take(struct reply *reply, char *json);
void reply_accepted_take(struct reply *reply, const char *location, char *json);
void reply_created_take(struct reply *reply, const char *location, char *json);
/* Not there yet: a client asks `location` again in a moment. */
void reply_later_take(struct reply *reply, const char *location, char *json);
/* Bytes, in an encoding that the client takes ("gzip", or "identity"). */
void reply_bytes(struct reply *reply, const char *content_type, const char *encoding,
                 const void *bytes, size_t size);
void reply_text_take(struct reply *reply, const char *content_type, char *text);
/* A body made while it is sent, taken over; one without `read` = out of memory. */
void reply_stream_take(struct reply *reply, const char *content_type, const struct stream *stream);
/* Events as they come (text/event-stream), taken over. */
void reply_events_take(struct reply *reply, const struct stream *stream);
/* No answer yet: the handler is asked again. Taken over. */
void reply_hold_take(struct reply *reply, const struct hold *hold);

enum { ETAG_SIZE = 62 }; /* with its NUL */
/* What was answered never changes: clients may keep it. etag (without quotes, [a-z0-9.-]; NULL =
 * none) names these bytes and no others. */
void reply_immutable(struct reply *reply, const char *etag);
/* The same for what may change at any time: clients ask whether it has. */
void reply_revalidate(struct reply *reply, const char *etag);
/* True, and the reply is a 304, when the client has what `etag` names. Before the body is made. */
bool reply_unchanged(struct reply *reply, const struct request *request, const char *etag);

/* detail is printf-style, words for the user. */
void reply_problem(struct reply *reply, enum problem problem, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* All faults at once. `more` (may be NULL) is further members as JSON text: "\"estimate\":{...}".
 */
void reply_faults(struct reply *reply, enum problem problem, const struct bcd_errors *errors,
                  const char *more);

/* Allow: the methods that this path has. */
void reply_method(struct reply *reply, const char *method, const char *allow);

/* A failed call of the store about `what` ("job jx3f"), or of the engine. */
void reply_store(struct reply *reply, enum store_status status, const char *what);
void reply_bcd(struct reply *reply, enum bcd_status status, const struct bcd_errors *errors);

#endif
