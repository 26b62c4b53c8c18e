/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * request_check.h - what is asked of requests whatever they are about. False with the reply filled.
 */
#ifndef REQUEST_CHECK_H
#define REQUEST_CHECK_H

#include "http.h"

/* Content-Type: JSON, none, or what `curl -d` says when it is not told otherwise. */
bool request_check_json(const struct request *request, struct reply *reply);

/* Idempotency-Key: none, or printable ASCII of bounded length. */
bool request_check_key(const struct request *request, struct reply *reply);

#endif
