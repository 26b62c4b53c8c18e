/* SPDX-License-Identifier: GPL-3.0-or-later
 * http_crowd.c: more clients than there is room for, none of which leaves by itself.
 * Waits: for deadlines. */
#include "http.h"
#include "http_client.h"
#include "limits.h"

#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

enum { CLIENTS = LIMIT_CONNECTIONS_CROWDED + 700, BIG = 40 << 20, WAIT_MS = 20000 };

struct fixture {
    struct http *http;
    int fds[CLIENTS];
};

static const char get[] = "GET / HTTP/1.1\r\n" CLIENT_HOST "\r\n";
static const char get_big[] = "GET /big HTTP/1.1\r\n" CLIENT_HOST "\r\n";

static void answer(void *context, const struct request *request, struct reply *reply)
{
    (void)context;
    size_t size = strcmp(request->path, "/big") == 0 ? BIG : 4;
    reply->status = 200;
    reply->content_type = "text/plain";
    reply->body = calloc(1, size);
    memcpy(reply->body, "seen", 4);
    reply->body_size = size;
}

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    char reason[256];
    const struct http_options options = {
        .host = "127.0.0.1", .stream_stall_ms = 1500, .handler = answer, .context = f};
    for (int i = 0; i < CLIENTS; i++)
        f->fds[i] = -1;
    f->http = http_start(&options, reason, sizeof(reason));
    *state = f;
    return f->http ? 0 : -1;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    for (int i = 0; i < CLIENTS; i++)
        if (f->fds[i] >= 0)
            close(f->fds[i]);
    http_stop(f->http);
    free(f);
    return 0;
}

static void dial(struct fixture *f, int from, int to, const char *words)
{
    for (int i = from; i < to; i++) {
        f->fds[i] = client_dial(f->http);
        client_say(f->fds[i], words, strlen(words));
    }
}

/* How many of them the server has hung up on. */
static int ended(const struct fixture *f, int from, int to)
{
    int count = 0;
    char bytes[1024];
    for (int i = from; i < to; i++) {
        ssize_t got;
        while ((got = recv(f->fds[i], bytes, sizeof(bytes), MSG_DONTWAIT)) > 0)
            continue;
        count += got == 0;
    }
    return count;
}

/* Soon, at best of several: what else the machine does is no matter. */
static void is_served(const struct fixture *f)
{
    char text[CLIENT_ANSWER_SIZE];
    int64_t took = INT64_MAX;
    for (int i = 0; i < 5 && took >= 1500; i++) { /* sanitizers take their time */
        int64_t begin_ms = client_now_ms();
        int fd = client_dial(f->http);
        client_say(fd, get, sizeof(get) - 1);
        client_listen(fd, text, WAIT_MS);
        close(fd);
        assert_non_null(strstr(text, "seen"));
        took = client_now_ms() - begin_ms;
    }
    assert_true(took < 1500);
}

static void thin(struct fixture *f, const char *words)
{
    struct http_counts counts;
    dial(f, 0, CLIENTS, words);
    is_served(f);
    int64_t until_ms = client_now_ms() + WAIT_MS;
    http_count(f->http, &counts);
    while (counts.connections >= LIMIT_CONNECTIONS_CROWDED && client_now_ms() < until_ms) {
        client_sleep_ms(20); /* counting holds the mutex that those who end them want */
        http_count(f->http, &counts);
    }
    assert_true(counts.connections < LIMIT_CONNECTIONS_CROWDED);
    assert_true(ended(f, 0, CLIENTS) > CLIENTS - LIMIT_CONNECTIONS_CROWDED);
    is_served(f);
}

static void silent_clients_go(void **state)
{
    thin(*state, "");
}

static void idle_clients_go(void **state)
{
    thin(*state, get);
}

static void slow_clients_go(void **state)
{
    thin(*state, "GET / HTTP/1.1\r\n" CLIENT_HOST "X-Slow: ");
}

/* Below the limit nobody is ended early. */
static void others_stay(void **state)
{
    struct fixture *f = *state;
    dial(f, 0, LIMIT_CONNECTIONS_KEPT / 2, "");
    client_sleep_ms(LIMIT_CROWDED_IDLE_MS + 300);
    assert_int_equal(ended(f, 0, LIMIT_CONNECTIONS_KEPT / 2), 0);
}

/* Answers that nobody takes: all together within bounds, each for a while. */
static void answers_are_bounded(void **state)
{
    enum { HELD = LIMIT_ANSWERS_BYTES_MAX / BIG };
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    dial(f, 0, HELD, get_big);
    for (int i = 0; i < HELD; i++) {
        struct pollfd poller = {.fd = f->fds[i], .events = POLLIN};
        assert_int_equal(poll(&poller, 1, WAIT_MS), 1);
    }
    int fd = client_dial(f->http);
    client_say(fd, get_big, sizeof(get_big) - 1);
    client_listen(fd, text, WAIT_MS);
    close(fd);
    assert_non_null(strstr(text, "HTTP/1.1 503"));
    assert_non_null(strstr(text, "LIMIT_ANSWERS_BYTES_MAX"));
    is_served(f);
    struct http_counts counts = {.connections = HELD};
    int64_t until_ms = client_now_ms() + WAIT_MS;
    while (counts.connections > 0 && client_now_ms() < until_ms) {
        client_sleep_ms(20);
        http_count(f->http, &counts);
    }
    assert_int_equal(counts.connections,
                     0); /* each was ended when it had stalled for long enough */
    fd = client_dial(f->http);
    client_say(fd, get_big, sizeof(get_big) - 1);
    assert_int_equal(recv(fd, text, 15, MSG_WAITALL), 15);
    close(fd);
    assert_memory_equal(text, "HTTP/1.1 200 OK", 15);
}

/* A slow reader is none that has stalled. */
static void slow_readers_stay(void **state)
{
    struct fixture *f = *state;
    char bytes[1 << 16];
    dial(f, 0, 1, get_big);
    int room = 1 << 16;
    setsockopt(f->fds[0], SOL_SOCKET, SO_RCVBUF, &room, sizeof(room));
    for (int i = 0; i < 30; i++) {
        assert_true(recv(f->fds[0], bytes, sizeof(bytes), MSG_WAITALL) == sizeof(bytes));
        client_sleep_ms(100);
    }
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    setrlimit(RLIMIT_NOFILE, &(const struct rlimit){.rlim_cur = 8192, .rlim_max = 8192});
    const struct CMUnitTest tests[] = {
        TEST(silent_clients_go), TEST(idle_clients_go),     TEST(slow_clients_go),
        TEST(others_stay),       TEST(answers_are_bounded), TEST(slow_readers_stay),
    };
    return cmocka_run_group_tests_name("http_crowd", tests, NULL, NULL);
}
