/* SPDX-License-Identifier: GPL-3.0-or-later
 * route_query.h - query parameters against the rows of a route. */
#ifndef ROUTE_QUERY_H
#define ROUTE_QUERY_H

#include "routes.h"

/* A fault for each parameter that does not fit; the parameter's name is the field. */
void route_query_check(const struct route *route, const struct request *request,
                       struct bcd_errors *errors);

/* Is it one of the words, which blanks keep apart? */
bool route_query_word(const char *words, const char *word);

#endif
