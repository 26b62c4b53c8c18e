/* SPDX-License-Identifier: GPL-3.0-or-later
 * Bodies made while they are sent: whole, or seen to be cut off.
 * Waits: for who stalls. */
#include "http.h"
#include "http_client.h"
#include "limits.h"
#include "reply.h"
#include "stream_rows.h"

#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

enum { STALL_MS = 700 };

/* What the handler streams: rows "0\n", "1\n", ... */
struct fixture {
    struct http *http;
    atomic_long rows, fails_at; /* fails_at < 0: never */
    atomic_int freed;
    atomic_long made;
};

struct counter {
    struct fixture *f;
    long next;
};

static bool next_row(void *state, struct text *text, bool *failed)
{
    struct counter *counter = state;
    if (counter->next == counter->f->fails_at)
        *failed = true;
    if (*failed || counter->next == counter->f->rows)
        return false;
    text_add(text, "%ld\n", counter->next++);
    atomic_store(&counter->f->made, counter->next);
    return true;
}

static void free_counter(void *state)
{
    struct counter *counter = state;
    atomic_fetch_add(&counter->f->freed, 1);
    free(counter);
}

static void stream(void *context, const struct request *request, struct reply *reply)
{
    struct counter *counter = calloc(1, sizeof(*counter));
    (void)request;
    counter->f = context;
    const struct rows rows = {.next = next_row, .free = free_counter, .state = counter};
    const struct stream made = stream_rows_take(&rows);
    reply_stream_take(reply, "text/plain", &made);
}

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    char reason[256];
    const struct http_options options = {
        .host = "127.0.0.1", .stream_stall_ms = STALL_MS, .handler = stream, .context = f};
    f->fails_at = -1;
    f->http = http_start(&options, reason, sizeof(reason));
    *state = f;
    return f->http ? 0 : -1;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    http_stop(f->http);
    free(f);
    return 0;
}

/* As curl does it: the status line in `answer`; the body's bytes are counted. */
struct seen {
    char head[CLIENT_ANSWER_SIZE];
    size_t bytes;
    bool last_chunk, reset;
};

static void ask(struct fixture *f, const char *request, struct seen *seen)
{
    char block[4096];
    ssize_t got;
    char tail[5] = "";
    int fd = client_dial(f->http);
    *seen = (struct seen){0};
    client_say(fd, request, strlen(request));
    while ((got = recv(fd, block, sizeof(block), 0)) > 0) {
        size_t kept = sizeof(seen->head) - 1 - seen->bytes;
        if (seen->bytes < sizeof(seen->head) - 1)
            memcpy(seen->head + seen->bytes, block, (size_t)got < kept ? (size_t)got : kept);
        seen->bytes += (size_t)got;
        if (got >= 5)
            memcpy(tail, block + got - 5, 5);
    }
    seen->reset = got < 0;
    seen->last_chunk = memcmp(tail, "0\r\n\r\n", 5) == 0;
    close(fd);
}

/* The server frees a stream when it is done with the connection, a moment after the client is. */
static void assert_freed(struct fixture *f, int count)
{
    client_wait_count(&f->freed, count);
}

#define GET "GET / HTTP/1.1\r\n" CLIENT_HOST "Connection: close\r\n\r\n"
#define GET_OLD "GET / HTTP/1.0\r\n\r\n"

static void short_stream(void **state)
{
    struct fixture *f = *state;
    struct seen seen;
    f->rows = 3;
    ask(f, GET, &seen);
    assert_non_null(strstr(seen.head, "HTTP/1.1 200"));
    assert_non_null(strstr(seen.head, "Transfer-Encoding: chunked\r\n"));
    assert_non_null(strstr(seen.head, "Content-Type: text/plain\r\n"));
    assert_non_null(strstr(seen.head, "\r\n\r\n6\r\n0\n1\n2\n\r\n0\r\n\r\n"));
    assert_freed(f, 1);
}

static void empty_stream(void **state)
{
    struct fixture *f = *state;
    struct seen seen;
    ask(f, GET, &seen);
    assert_non_null(strstr(seen.head, "\r\n\r\n0\r\n\r\n"));
    ask(f, GET_OLD, &seen);
    assert_non_null(strstr(seen.head, "HTTP/1.1 200"));
    assert_false(seen.reset);
    assert_freed(f, 2);
}

static void head_makes_nothing(void **state)
{
    struct fixture *f = *state;
    struct seen seen;
    f->rows = 100;
    ask(f, "HEAD / HTTP/1.1\r\n" CLIENT_HOST "Connection: close\r\n\r\n", &seen);
    assert_non_null(strstr(seen.head, "HTTP/1.1 200"));
    assert_null(strstr(seen.head, "1\n2\n"));
    assert_int_equal(f->made, 0);
    assert_freed(f, 1);
}

/* Much more than any buffer: whole, and in constant memory. */
static void long_stream(void **state)
{
    struct fixture *f = *state;
    struct seen seen;
    f->rows = 4000000;
    size_t before = mallinfo2().uordblks + mallinfo2().hblkhd;
    ask(f, GET_OLD, &seen);
    size_t after = mallinfo2().uordblks + mallinfo2().hblkhd;
    const char *body = strstr(seen.head, "\r\n\r\n");
    assert_non_null(body);
    assert_int_equal(seen.bytes - (size_t)(body + 4 - seen.head), 30888890);
    assert_true(after <= before + (1 << 20));
    ask(f, GET, &seen);
    assert_true(seen.last_chunk);
    assert_true(seen.bytes > 30888890);
}

/* The end of a chunked body stays away; a connection of HTTP/1.0 is reset. */
static void failure_is_seen(void **state)
{
    struct fixture *f = *state;
    struct seen seen;
    f->rows = 1000000;
    f->fails_at = 500000;
    ask(f, GET, &seen);
    assert_false(seen.last_chunk);
    ask(f, GET_OLD, &seen);
    assert_true(seen.reset);
    f->fails_at = 0;
    ask(f, GET, &seen);
    assert_false(seen.last_chunk);
    assert_freed(f, 3);
}

/* A client that leaves in the middle: the stream is freed soon. */
static void client_leaves(void **state)
{
    struct fixture *f = *state;
    char some[1000];
    f->rows = 100000000;
    int fd = client_dial(f->http);
    client_say(fd, GET, strlen(GET));
    assert_true(recv(fd, some, sizeof(some), 0) > 0);
    close(fd);
    assert_freed(f, 1);
    assert_true(f->made < f->rows);
}

/* A client that does not read holds nothing for long; one that reads slowly may take its time. */
static void client_stalls(void **state)
{
    struct fixture *f = *state;
    char some[100000];
    f->rows = 100000000;
    int fd = client_dial(f->http);
    client_say(fd, GET, strlen(GET));
    for (int64_t until_ms = client_now_ms() + 3 * STALL_MS; client_now_ms() < until_ms;) {
        assert_true(recv(fd, some, sizeof(some), 0) > 0);
        client_sleep_ms(1);
    }
    assert_int_equal(f->freed, 0);
    int64_t begin_ms = client_now_ms();
    assert_freed(f, 1);
    assert_true(client_now_ms() - begin_ms >= STALL_MS / 2);
    close(fd);
}

/* A stream that is not sent is freed, too; one that could not be made is a 503. */
static void unsent_streams(void **state)
{
    struct fixture *f = *state;
    struct reply reply = {0};
    stream(f, NULL, &reply);
    assert_int_equal(reply.status, 200);
    reply_problem(&reply, PROBLEM_BUSY, "changed my mind");
    assert_freed(f, 1);
    reply_stream_take(&reply, "text/plain", &(const struct stream){0});
    assert_int_equal(reply.status, 503);
    reply_fini(&reply);
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(short_stream),    TEST(empty_stream),  TEST(head_makes_nothing), TEST(long_stream),
        TEST(failure_is_seen), TEST(client_leaves), TEST(client_stalls),      TEST(unsent_streams),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
