/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * routes.h - the table of everything the service can be asked, and the way from a request to its
 * handler. A new endpoint is one line in routes.c.
 */
#ifndef ROUTES_H
#define ROUTES_H

#include "handle.h"

struct route {
    const char *method; /* "GET" stands for HEAD too */
    /* Literal text with {id} for [a-z0-9-]+ and {name} for [a-z0-9_]+. No other path can match, so
     * nothing needs decoding or cleaning. */
    const char *pattern;
    enum role role;  /* the least that may ask; ROLE_NONE = anybody */
    bool free_query; /* the handler reads query parameters; else any is refused */
    handler *handle;
    const char *doc;
};

/* In the order of the documentation; NULL past the last. */
const struct route *routes_at(size_t index);

/* Answers any request. `service` is a struct service; this is an http_handler. */
void routes_dispatch(void *service, const struct request *request, struct reply *reply);

#endif
