/* SPDX-License-Identifier: GPL-3.0-or-later
 * http_listen.h - the socket that http.c gives the library. */
#ifndef HTTP_LISTEN_H
#define HTTP_LISTEN_H

#include <stdint.h>

/* A listening socket, non-blocking, on a numeric IPv4 or IPv6 address; port 0 picks a free one.
 * *bound is the port it has. -1 with errno. The caller closes it. */
int http_listen(const char *host, uint16_t port, uint16_t *bound);

#endif
