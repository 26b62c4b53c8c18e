/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "http_client.h"

#include <arpa/inet.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#include <cmocka.h>

enum { MORE_MS = 40 };

int client_dial(const struct http *http)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(http_port(http))};
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_true(fd >= 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof(address)), 0);
    return fd;
}

void client_say(int fd, const char *bytes, size_t size)
{
    while (size > 0) {
        ssize_t sent = send(fd, bytes, size, MSG_NOSIGNAL);
        if (sent <= 0)
            return; /* the server hung up; what it said is looked at by the caller */
        bytes += sent;
        size -= (size_t)sent;
    }
}

/* All that its length speaks of, or the last of its chunks; and nobody will hang up behind it. */
static bool is_whole(const char *answer, size_t size)
{
    const char *end = strstr(answer, "\r\n\r\n");
    if (!end || size < 5)
        return false;
    const char *length = strstr(answer, "Content-Length: ");
    const char *close = strstr(answer, "Connection: close\r\n");
    if (close && close < end)
        return false;
    if (length && length < end)
        return size >= (size_t)(end + 4 - answer) + strtoul(length + 16, NULL, 10);
    return memcmp(answer + size - 5, "0\r\n\r\n", 5) == 0;
}

bool client_listen(int fd, char *answer, int quiet_ms)
{
    size_t size = 0;
    struct pollfd poller = {.fd = fd, .events = POLLIN};
    answer[0] = '\0';
    while (poll(&poller, 1, is_whole(answer, size) ? MORE_MS : quiet_ms) == 1) {
        ssize_t got = recv(fd, answer + size, CLIENT_ANSWER_SIZE - 1 - size, 0);
        if (got <= 0)
            return true;
        size += (size_t)got;
        answer[size] = '\0';
    }
    return false;
}

void client_await(int fd, char *answer, const char *words)
{
    size_t size = 0;
    struct pollfd poller = {.fd = fd, .events = POLLIN};
    answer[0] = '\0';
    while (!strstr(answer, words)) {
        assert_int_equal(poll(&poller, 1, CLIENT_WAIT_MS), 1);
        ssize_t got = recv(fd, answer + size, CLIENT_ANSWER_SIZE - 1 - size, 0);
        assert_true(got > 0);
        size += (size_t)got;
        answer[size] = '\0';
    }
}

int64_t client_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

void client_sleep_ms(int ms)
{
    nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L}, NULL);
}

void client_wait_count(atomic_int *counter, int value)
{
    int64_t until_ms = client_now_ms() + CLIENT_WAIT_MS;
    while (atomic_load(counter) < value && client_now_ms() < until_ms)
        client_sleep_ms(2);
    assert_int_equal(atomic_load(counter), value);
}
