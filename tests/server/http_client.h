/* SPDX-License-Identifier: GPL-3.0-or-later
 * http_client.h - raw bytes to a struct http on loopback, and what it answers. */
#ifndef HTTP_CLIENT_H
#define HTTP_CLIENT_H

#include "http.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CLIENT_ANSWER_SIZE = 1 << 16, CLIENT_WAIT_MS = 30000 };
#define CLIENT_HOST "Host: 127.0.0.1\r\n"

int client_dial(const struct http *http);
void client_say(int fd, const char *bytes, size_t size);
/* Reads until the server hangs up (true), or has said nothing for `quiet_ms`, or for a moment after
 * an answer is there as a whole (false); for who says "Connection: close" the end is waited for.
 * answer has CLIENT_ANSWER_SIZE bytes. */
bool client_listen(int fd, char *answer, int quiet_ms);
/* Reads until these words are there; fails the test after CLIENT_WAIT_MS. */
void client_await(int fd, char *answer, const char *words);

int64_t client_now_ms(void);
void client_sleep_ms(int ms);
/* Until a handler's thread has counted so far; fails the test after CLIENT_WAIT_MS. */
void client_wait_count(atomic_int *counter, int value);

#endif
