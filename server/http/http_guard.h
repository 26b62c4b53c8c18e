/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_guard.h - what a request's address and headers must look like before anybody reads it.
 * Plain functions on strings, so that tests need no socket.
 */
#ifndef HTTP_GUARD_H
#define HTTP_GUARD_H

#include "http.h"

#include <stdbool.h>

/* A numeric address of this machine's loopback interface: 127.0.0.0/8 or ::1, without brackets. */
bool http_guard_loopback(const char *address);

/* Whether a Host header ("localhost:8080", "[::1]") names this server, which goes by `names` (may
 * be NULL, NULL ends them), by its address, and on loopback by loopback names and addresses: a page
 * from elsewhere whose name was made to resolve to 127.0.0.1 (DNS rebinding) still sends its own
 * name. Off loopback, without names, any will do: nobody gets in without a token, and pages have
 * none. Any port will do, for tunnels. */
bool http_guard_host(const char *host, const char *listen_address, const char *const *names);

/* Takes "http://HOST" from the beginning of what a request asks for, as proxies are asked (RFC
 * 9112, 3.2.2). NULL, and the path is left, which begins with a slash; else in words why it is no
 * path. *host is HOST, NULL when there was none: to be freed. */
const char *http_guard_target(char *target, char **host);

/* Whether a page from `origin` (Origin header) may change things here: only pages of this server.
 */
bool http_guard_origin(const char *origin, const char *host);

/* Splits and decodes (%41, +) what follows the "?" in place, into at most `room` pairs. NULL, or in
 * words why it cannot be read: bad escapes, NUL bytes, text that is not UTF-8, too many pairs. */
const char *http_guard_query(char *raw, struct request_query *query, size_t room, size_t *count);

#endif
