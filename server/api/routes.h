/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * routes.h - the table of everything the service can be asked, and the way from a request to its
 * handler. A new endpoint is one row in route_table.c: from the rows come the dispatch, the checks
 * of roles and query parameters, the list at /v1 and openapi.json. A schema that a row names stands
 * in schema/components.json.
 */
#ifndef ROUTES_H
#define ROUTES_H

#include "handle.h"
#include "reply.h"

/* A query parameter. It is refused before the handler is called when it does not fit its row, is
 * given twice or has no row at all; handlers read it with call_query(). */
enum query_type {
    QUERY_TEXT,    /* anything; the handler tells */
    QUERY_LABEL,   /* a text that can be a label: not empty, not too long */
    QUERY_OWNER,   /* what an owner can be called */
    QUERY_TAG,     /* what a tag can be */
    QUERY_ID,      /* what an id of ours looks like; the handler tells whose */
    QUERY_WORD,    /* one of `words` */
    QUERY_BOOLEAN, /* true or false */
    QUERY_INTEGER, /* min..max */
    QUERY_NUMBER,  /* min..max */
    QUERY_TIME,    /* ISO 8601, or ms since 1970; the handler tells */
};
struct query_row {
    const char *name; /* NULL ends a list */
    enum query_type type;
    const char *words; /* "queued running done" */
    double min, max;
    const char *doc;
    bool many; /* may be given several times */
};

/* An answer that is no problem. */
struct route_answer {
    int status;
    const char *type;   /* without parameters; "" = no body, as of a 304; NULL ends a list */
    const char *schema; /* of JSON: name of a component; NULL = none */
};
enum { ROUTE_ANSWERS_MAX = 4 };

/* Problems as a set: ROUTE_PROBLEM(STATE) | ROUTE_PROBLEM(DISK_FULL). */
#define ROUTE_PROBLEM(name) (UINT64_C(1) << PROBLEM_##name)

struct route {
    const char *method; /* "GET" stands for HEAD too */
    /* Literal text with {id} for [a-z0-9-]+, {name} for [a-z0-9_]+, {owner} for both and {file}
     * for a name with an ending. No other path can match, so nothing needs decoding or cleaning. */
    const char *pattern;
    enum role role; /* the least that may ask; ROLE_NONE = anybody */
    handler *handle;
    const char *id;                /* how programs call it: "submitJob" */
    const char *doc;               /* one line */
    const char *more;              /* what else is to be said; NULL = nothing */
    const struct query_row *query; /* NULL = none */
    /* Other parameters too: filters on what jobs hold, which the handler refuses or not. */
    bool filters;
    bool idempotency_key; /* the handler reads that header */
    enum lane lane;       /* it may take seconds */
    const char *body;     /* schema of the request body; NULL = none is read */
    const char *example;  /* of the body, JSON */
    struct route_answer answers[ROUTE_ANSWERS_MAX];
    /* Beside those that any request can meet, and that a {id}, a body or a role bring with them. */
    uint64_t problems;
};

/* What may stand for {name} in a path: some characters, fewer than CALL_ARG_SIZE. */
struct route_arg {
    const char *name, *characters, *set; /* set: the same as in a regular expression */
};
const struct route_arg *routes_arg(size_t index); /* NULL past the last */

/* In the order of the documentation; NULL past the last. */
const struct route *routes_at(size_t index);

/* What of `problems` a route can answer with, all counted. */
uint64_t routes_problems(const struct route *route);

/* Answers any request. `service` is a struct service; this is an http_handler. */
void routes_dispatch(void *service, const struct request *request, struct reply *reply);

#endif
