/* SPDX-License-Identifier: GPL-3.0-or-later
 * http.c against raw bytes on a socket: what curl would never send.
 * Waits: for deadlines. */
#include "http.h"
#include "http_client.h"
#include "limits.h"

#include <dirent.h>
#include <malloc.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

enum { AGE_MS = 400, ANSWER_SIZE = CLIENT_ANSWER_SIZE, WAIT_MS = CLIENT_WAIT_MS };

struct fixture {
    struct http *http;
    pthread_mutex_t mutex; /* of what the handler notes */
    atomic_int begun, handled;
    char path[64], query[256], body[64], type[64];
    size_t body_size;
    int handler_ms; /* how long it takes its time */
};

#define HOST CLIENT_HOST

static void note(void *context, const struct request *request, struct reply *reply)
{
    struct fixture *f = context;
    pthread_mutex_lock(&f->mutex);
    snprintf(f->path, sizeof(f->path), "%s", request->path);
    snprintf(f->body, sizeof(f->body), "%.*s", (int)request->body_size, request->body);
    snprintf(f->type, sizeof(f->type), "%s", request->content_type ? request->content_type : "-");
    f->query[0] = '\0';
    for (size_t i = 0; i < request->query_count; i++) {
        size_t used = strlen(f->query);
        snprintf(f->query + used, sizeof(f->query) - used, "[%s|%s]", request->query[i].name,
                 request->query[i].value);
    }
    f->body_size = request->body_size;
    pthread_mutex_unlock(&f->mutex);
    atomic_fetch_add(&f->begun, 1);
    client_sleep_ms(f->handler_ms);
    reply->status = 200;
    reply->content_type = "text/plain";
    reply->body = strdup("seen");
    reply->body_size = 4;
    atomic_fetch_add(&f->handled, 1);
}

static struct http *start(struct fixture *f, int64_t age_ms)
{
    char reason[256];
    const struct http_options options = {
        .host = "127.0.0.1", .request_age_ms = age_ms, .handler = note, .context = f};
    return http_start(&options, reason, sizeof(reason));
}

static int setup_with(void **state, int64_t age_ms)
{
    struct fixture *f = calloc(1, sizeof(*f));
    pthread_mutex_init(&f->mutex, NULL);
    f->http = start(f, age_ms);
    *state = f;
    return f->http ? 0 : -1;
}

static int setup(void **state)
{
    return setup_with(state, 0);
}

/* Requests have little time. */
static int setup_hasty(void **state)
{
    return setup_with(state, AGE_MS);
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    http_stop(f->http);
    pthread_mutex_destroy(&f->mutex);
    free(f);
    return 0;
}

/* The status of an answer, 0 if there is none. Afterwards this thread sees what the handler noted.
 */
static int status_of(struct fixture *f, const char *answer)
{
    int status = 0;
    pthread_mutex_lock(&f->mutex);
    pthread_mutex_unlock(&f->mutex);
    sscanf(answer, "HTTP/1.1 %d", &status);
    return status;
}

/* One request on a connection of its own; the status, 0 if there was none. *closed: the server hung
 * up without being asked to. */
static int ask(struct fixture *f, const char *request, char *answer, bool *closed)
{
    int fd = client_dial(f->http);
    client_say(fd, request, strlen(request));
    *closed = client_listen(fd, answer, WAIT_MS);
    close(fd);
    return status_of(f, answer);
}

static void plain_request(void **state)
{
    struct fixture *f = *state;
    char answer[ANSWER_SIZE];
    bool closed;
    assert_int_not_equal(http_port(f->http), 0);
    assert_int_equal(
        ask(f, "GET /a/b?x=1&y=%41+%c3%a9&z HTTP/1.1\r\n" HOST "\r\n", answer, &closed), 200);
    assert_false(closed);
    assert_string_equal(f->path, "/a/b");
    assert_string_equal(f->query, "[x|1][y|A \xc3\xa9][z|]");
    assert_non_null(strstr(answer, "\r\n\r\nseen"));
    assert_non_null(strstr(answer, "X-Content-Type-Options: nosniff\r\n"));
    assert_non_null(strstr(answer, "Content-Security-Policy: default-src 'none'"));
    assert_non_null(strstr(answer, "Referrer-Policy: no-referrer\r\n"));
}

static void head_has_no_body(void **state)
{
    char answer[ANSWER_SIZE];
    bool closed;
    assert_int_equal(
        ask(*state, "HEAD / HTTP/1.1\r\n" HOST "Connection: close\r\n\r\n", answer, &closed), 200);
    assert_non_null(strstr(answer, "Content-Length: 4\r\n"));
    assert_null(strstr(answer, "seen"));
}

static void path_is_as_sent(void **state)
{
    struct fixture *f = *state;
    char answer[ANSWER_SIZE];
    bool closed;
    assert_int_equal(ask(f, "GET /%2e%2e/..//x%00 HTTP/1.1\r\n" HOST "\r\n", answer, &closed), 200);
    assert_string_equal(f->path, "/%2e%2e/..//x%00");
}

static void bad_queries(void **state)
{
    static const char *const bad[] = {"x=%", "x=%4", "x=%zz", "x=%00", "x=%ff", "%C3=1"};
    struct fixture *f = *state;
    char request[4096], answer[ANSWER_SIZE];
    bool closed;
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        snprintf(request, sizeof(request), "GET /?%s HTTP/1.1\r\n" HOST "\r\n", bad[i]);
        assert_int_equal(ask(f, request, answer, &closed), 400);
    }
    size_t used = (size_t)snprintf(request, sizeof(request), "GET /?a");
    for (int i = 1; i < LIMIT_QUERY_MAX; i++)
        used += (size_t)snprintf(request + used, sizeof(request) - used, "&a");
    snprintf(request + used, sizeof(request) - used, " HTTP/1.1\r\n" HOST "\r\n");
    assert_int_equal(ask(f, request, answer, &closed), 200);
    snprintf(request + used, sizeof(request) - used, "&a HTTP/1.1\r\n" HOST "\r\n");
    assert_int_equal(ask(f, request, answer, &closed), 400);
}

static void header_limit(void **state)
{
    struct fixture *f = *state;
    char answer[ANSWER_SIZE];
    char *request = malloc(2 * LIMIT_HEADER_BYTES_MAX);
    bool closed;
    size_t used = (size_t)sprintf(request, "GET / HTTP/1.1\r\n" HOST "X: ");
    memset(request + used, 'x', LIMIT_HEADER_BYTES_MAX);
    strcpy(request + used + LIMIT_HEADER_BYTES_MAX, "\r\n\r\n");
    assert_int_equal(ask(f, request, answer, &closed), 431);
    free(request);
    assert_int_equal(f->handled, 0);
}

/* So many parameters that the library lacks memory for an answer, and forgets the request. */
static size_t too_many_parameters(char request[LIMIT_HEADER_BYTES_MAX])
{
    strcpy(request, "GET /?");
    while (strlen(request) < LIMIT_HEADER_BYTES_MAX - 6000)
        strcat(request, "a=1&");
    return strlen(strcat(request, " HTTP/1.1\r\n" HOST "\r\n"));
}

static void forgotten_requests(void **state)
{
    char request[LIMIT_HEADER_BYTES_MAX];
    size_t size = too_many_parameters(request), used = 0;
    for (int i = 0; i < 60; i++) {
        int fd = client_dial(((struct fixture *)*state)->http);
        client_say(fd, request, size);
        client_sleep_ms(10);
        close(fd);
        used = i < 20 ? mallinfo2().uordblks : used;
    }
    for (int i = 0; i < WAIT_MS / 100 && mallinfo2().uordblks > used + 10 * size; i++)
        client_sleep_ms(100);
    assert_true(mallinfo2().uordblks <= used + 10 * size);
}

/* Each of these lets two servers disagree about where a request ends: refused, and the connection
 * with it, so that the GET behind it is never answered. */
static void contradicting_lengths(void **state)
{
    static const char *const heads[] = {
        "Content-Length: 2\r\nContent-Length: 2\r\n",
        "Content-Length: 2\r\nContent-Length: 40\r\n",
        "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: chunked\r\nContent-Length: 2\r\n",
        "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: gzip, chunked\r\n",
        "Transfer-Encoding: identity\r\n",
        "Content-Length: -2\r\n",
        "Content-Length: +2\r\n",
        "Content-Length: 2 2\r\n",
        "Content-Length: 0x2\r\n",
        "Content-Length: 99999999999999999999999\r\n",
        "Transfer-Encoding : chunked\r\nContent-Length: 2\r\n",
        "Content-Length\t: 40\r\nContent-Length: 2\r\n",
        "Content-Length:\r\n 2\r\n",
        "Content-Length: 2\r\n 0\r\n",
        "Content-Length: 2\r\nTransfer-Encoding:\r\n chunked\r\n",
        "Transfer-Encoding:\r\n\tchunked\r\nContent-Length: 2\r\n",
        "Transfer-Encoding: chunked\r\n x\r\n",
    };
    struct fixture *f = *state;
    char request[1024], answer[ANSWER_SIZE];
    bool closed;
    enum { HEADS = sizeof(heads) / sizeof(heads[0]) };
    for (size_t k = 0; k < 2 * HEADS; k++) {
        size_t i = k / 2;
        snprintf(request, sizeof(request),
                 "%s / HTTP/1.1\r\n" HOST "%s\r\n{}GET /smuggled HTTP/1.1\r\n" HOST "\r\n",
                 k % 2 ? "GET" : "POST", heads[i]);
        int status = ask(f, request, answer, &closed);
        if (!(status == 400 || status == 413) || !closed || strstr(answer, "seen"))
            fail_msg("%s gave %d, closed %d:\n%s", heads[i], status, closed, answer);
    }
    assert_int_equal(f->handled, 0);
}

static void hosts_and_origins(void **state)
{
    static const struct {
        int status;
        const char *head;
    } cases[] = {
        {200, "Host: localhost:8080\r\n"},
        {200, "Host: [::1]:9\r\n"},
        {421, "Host: evil.example\r\n"},
        {421, "Host: 127.0.0.1.evil.example\r\n"},
        {400, ""},
        {400, "Host: localhost\r\nHost: localhost\r\n"},
        {200, "Host: localhost:1\r\nOrigin: http://localhost:1\r\n"},
        {403, "Host: localhost:1\r\nOrigin: http://localhost:2\r\n"},
        {403, "Host: localhost:1\r\nOrigin: https://evil.example\r\n"},
        {403, "Host: localhost:1\r\nOrigin: null\r\n"},
    };
    char request[512], answer[ANSWER_SIZE];
    bool closed;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        snprintf(request, sizeof(request), "GET / HTTP/1.1\r\n%s\r\n", cases[i].head);
        int status = ask(*state, request, answer, &closed);
        if (status != cases[i].status)
            fail_msg("%s gave %d", cases[i].head, status);
    }
}

static void old_clients_name_no_host(void **state)
{
    char answer[ANSWER_SIZE];
    bool closed;
    assert_int_equal(ask(*state, "GET / HTTP/1.0\r\n\r\n", answer, &closed), 200);
    assert_true(closed);
    assert_int_equal(ask(*state, "GET / HTTP/1.0\r\nHost: evil.example\r\n\r\n", answer, &closed),
                     421);
}

/* A POST with a body of `size` bytes, as one piece or in chunks. */
static int post(struct fixture *f, size_t size, bool chunked, char *answer)
{
    char head[256];
    int fd = client_dial(f->http);
    char *body = malloc(size + 1);
    memset(body, ' ', size);
    snprintf(head, sizeof(head), "POST / HTTP/1.1\r\n" HOST "%s %zu\r\n\r\n",
             chunked ? "Transfer-Encoding: chunked\r\nX-Size:" : "Content-Length:", size);
    client_say(fd, head, strlen(head));
    for (size_t at = 0; at < size;) {
        size_t piece = size - at < 65536 ? size - at : 65536;
        snprintf(head, sizeof(head), "%zx\r\n", piece);
        if (chunked)
            client_say(fd, head, strlen(head));
        client_say(fd, body + at, piece);
        if (chunked)
            client_say(fd, "\r\n", 2);
        at += piece;
    }
    if (chunked)
        client_say(fd, "0\r\n\r\n", 5);
    client_listen(fd, answer, WAIT_MS);
    close(fd);
    free(body);
    return status_of(f, answer);
}

static void body_limit(void **state)
{
    struct fixture *f = *state;
    char answer[ANSWER_SIZE];
    bool closed;
    assert_int_equal(post(f, LIMIT_BODY_BYTES_MAX, false, answer), 200);
    assert_int_equal(f->body_size, LIMIT_BODY_BYTES_MAX);
    assert_int_equal(post(f, LIMIT_BODY_BYTES_MAX, true, answer), 200);
    assert_int_equal(f->body_size, LIMIT_BODY_BYTES_MAX);
    assert_int_equal(post(f, LIMIT_BODY_BYTES_MAX + 1, true, answer), 413);
    /* Told before the first byte of the body. */
    snprintf(answer, sizeof(answer), "POST / HTTP/1.1\r\n" HOST "Content-Length: %d\r\n\r\n",
             LIMIT_BODY_BYTES_MAX + 1);
    char *request = strdup(answer);
    assert_int_equal(ask(f, request, answer, &closed), 413);
    free(request);
    assert_true(closed);
    assert_int_equal(f->handled, 2);
}

/* All bodies together: whoever would exceed the budget is told to come again; when the others are
 * gone there is room again. */
static void bodies_limit(void **state)
{
    enum { CLIENTS = 4 * (LIMIT_BODIES_BYTES_MAX / LIMIT_BODY_BYTES_MAX), SENT = 1000000 };
    static const char head[] = "POST / HTTP/1.1\r\n" HOST "Content-Length: 1000001\r\n\r\n";
    struct fixture *f = *state;
    char answer[ANSWER_SIZE], *body = calloc(1, SENT);
    int fds[CLIENTS], count = 0, status = 0;
    /* One that meets the limit lets go what it had: there may be room again, for a while. */
    while (status != 503 && count < CLIENTS) {
        fds[count] = client_dial(f->http);
        client_say(fds[count], head, sizeof(head) - 1);
        client_say(fds[count++], body, SENT);
        if (count > LIMIT_BODIES_BYTES_MAX / LIMIT_BODY_BYTES_MAX)
            status = post(f, LIMIT_BODY_BYTES_MAX, false, answer);
    }
    free(body);
    assert_int_equal(status, 503);
    assert_non_null(strstr(answer, "Retry-After: "));
    for (int i = 0; i < count; i++)
        close(fds[i]);
    for (int64_t end_ms = client_now_ms() + WAIT_MS; status != 200 && client_now_ms() < end_ms;)
        status = post(f, LIMIT_BODY_BYTES_MAX, false, answer);
    assert_int_equal(status, 200);
}

/* One byte at a time is activity, but no request. */
static void trickle(const struct fixture *f, const char *head, const char *expected)
{
    char answer[ANSWER_SIZE];
    int64_t start = client_now_ms();
    int fd = client_dial(f->http);
    bool closed = false;
    client_say(fd, head, strlen(head));
    while (!closed && client_now_ms() - start < WAIT_MS) {
        client_say(fd, "x", 1);
        closed = client_listen(fd, answer, 50) || answer[0];
    }
    close(fd);
    assert_true(closed);
    assert_in_range(client_now_ms() - start, AGE_MS - 50, WAIT_MS);
    if (strncmp(answer, expected, strlen(expected)) != 0)
        fail_msg("not %s: %s", expected, answer);
}

static void slow_requests_end(void **state)
{
    trickle(*state, "", "");
    trickle(*state, "GET / HTTP/1.1\r\n" HOST "X-Slow: ", "");
    trickle(*state, "POST / HTTP/1.1\r\n" HOST "Content-Length: 1000\r\n\r\n", "HTTP/1.1 408");
    assert_int_equal(((struct fixture *)*state)->handled, 0);
}

/* A slow request does not stand in the way of others, and a connection kept alive is not reaped. */
static void keep_alive_outlives_the_age(void **state)
{
    struct fixture *f = *state;
    char answer[ANSWER_SIZE];
    static const char get[] = "GET / HTTP/1.1\r\n" HOST "\r\n";
    int fd = client_dial(f->http);
    for (int i = 0; i < 3; i++) {
        client_say(fd, get, sizeof(get) - 1);
        assert_false(client_listen(fd, answer, WAIT_MS));
        assert_non_null(strstr(answer, "seen"));
        client_sleep_ms(AGE_MS / 2);
    }
    close(fd);
}

struct late {
    struct fixture *f;
    char answer[ANSWER_SIZE];
    bool closed;
};

static void *ask_late(void *context)
{
    struct late *late = context;
    ask(late->f, "GET / HTTP/1.1\r\n" HOST "\r\n", late->answer, &late->closed);
    return NULL;
}

static void stop_lets_requests_end(void **state)
{
    struct fixture *f = *state;
    static struct late late;
    late.f = f;
    f->handler_ms = 600;
    pthread_t thread;
    int idle = client_dial(f->http);
    assert_int_equal(pthread_create(&thread, NULL, ask_late, &late), 0);
    client_wait_count(&f->begun, 1);
    int64_t start = client_now_ms();
    http_stop(f->http);
    int64_t took = client_now_ms() - start;
    pthread_join(thread, NULL);
    assert_non_null(strstr(late.answer, "seen"));
    assert_non_null(strstr(late.answer, "Connection: close"));
    assert_true(late.closed);
    assert_true(took <
                LIMIT_DRAIN_MS -
                    500); /* neither the idle connection nor the drain's limit was waited for */
    close(idle);
    f->http = NULL;
}

/* A library that is stopping queues no answer, and then looks for the one that it meant to give to
 * such a request: by that time none may be left. */
static void stop_amid_long_queries(void **state)
{
    enum { CLIENTS = 12, ROUNDS = 4 };
    struct fixture *f = *state;
    char request[LIMIT_HEADER_BYTES_MAX];
    size_t size = too_many_parameters(request);
    int fd[CLIENTS];
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < CLIENTS; i++)
            fd[i] = client_dial(f->http);
        for (int i = 0; i < CLIENTS; i++)
            client_say(fd[i], request, size);
        http_stop(f->http);
        for (int i = 0; i < CLIENTS; i++)
            close(fd[i]);
        f->http = start(f, AGE_MS);
        assert_non_null(f->http);
    }
}

/* Descriptors of this process, and so of the server's connections. */
static int descriptors(void)
{
    int count = 0;
    DIR *dir = opendir("/proc/self/fd");
    while (readdir(dir))
        count++;
    closedir(dir);
    return count;
}

/* Many clients that leave in the middle of a request. */
static void leave(struct fixture *f)
{
    enum { CLIENTS = 60, SENT = 300000 };
    static const char head[] = "POST / HTTP/1.1\r\n" HOST "Content-Length: 1000001\r\n\r\n";
    char answer[ANSWER_SIZE], *body = calloc(1, SENT);
    bool closed;
    int fds[CLIENTS];
    for (int i = 0; i < CLIENTS; i++) {
        fds[i] = client_dial(f->http);
        client_say(fds[i], head, sizeof(head) - 1);
        client_say(fds[i], body, SENT);
    }
    free(body);
    for (int i = 0; i < CLIENTS; i++)
        close(fds[i]);
    assert_int_equal(ask(f, "GET / HTTP/1.1\r\n" HOST "\r\n", answer, &closed), 200);
}

/* They are forgotten, though the library does not notice each of them. */
static void leavers_are_forgotten(void **state)
{
    struct fixture *f = *state;
    int before = descriptors();
    leave(f);
    for (int i = 0; i < WAIT_MS / 100 && descriptors() > before; i++)
        client_sleep_ms(100);
    assert_int_equal(descriptors(), before);
}

static void leavers_are_not_waited_for(void **state)
{
    struct fixture *f = *state;
    int64_t took = INT64_MAX;
    for (int i = 0; i < 8 && took >= 400; i++) { /* the reaper would take longer, each time */
        if (!f->http)
            f->http = start(f, 0);
        leave(f);
        int64_t begin_ms = client_now_ms();
        http_stop(f->http);
        f->http = NULL;
        took = client_now_ms() - begin_ms;
    }
    assert_true(took < 400);
}

/* As `nc -N` does it: the request is complete, only nothing more will follow. */
static void half_closed_is_answered(void **state)
{
    struct fixture *f = *state;
    static const char get[] = "GET / HTTP/1.1\r\n" HOST "\r\n";
    char answer[ANSWER_SIZE];
    f->handler_ms = 1200; /* the reaper comes by twice */
    int fd = client_dial(f->http);
    client_say(fd, get, sizeof(get) - 1);
    shutdown(fd, SHUT_WR);
    client_listen(fd, answer, WAIT_MS);
    close(fd);
    assert_non_null(strstr(answer, "seen"));
}

static void taken_port_is_told(void **state)
{
    struct fixture *f = *state;
    char reason[256] = "";
    const struct http_options options = {
        .host = "127.0.0.1", .port = http_port(f->http), .handler = note, .context = f};
    assert_null(http_start(&options, reason, sizeof(reason)));
    assert_non_null(strstr(reason, "Address already in use"));
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)
#define HASTY_TEST(function) cmocka_unit_test_setup_teardown(function, setup_hasty, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(plain_request),
        TEST(head_has_no_body),
        TEST(path_is_as_sent),
        TEST(bad_queries),
        TEST(header_limit),
        TEST(forgotten_requests),
        TEST(contradicting_lengths),
        TEST(hosts_and_origins),
        TEST(old_clients_name_no_host),
        TEST(body_limit),
        TEST(bodies_limit),
        HASTY_TEST(slow_requests_end),
        HASTY_TEST(keep_alive_outlives_the_age),
        TEST(stop_lets_requests_end),
        TEST(stop_amid_long_queries),
        TEST(leavers_are_forgotten),
        TEST(leavers_are_not_waited_for),
        TEST(half_closed_is_answered),
        TEST(taken_port_is_told),
    };
    return cmocka_run_group_tests_name("http", tests, NULL, NULL);
}
