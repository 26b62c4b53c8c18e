/* SPDX-License-Identifier: GPL-3.0-or-later
 * Answers that wait for something to happen: held ones, and streams of events. No thread waits.
 * Waits: for what is held. */
#include "http.h"
#include "http_client.h"
#include "limits.h"
#include "reply.h"

#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

enum { WAIT_MS = CLIENT_WAIT_MS, HOLD_MS = 700, LONG_MS = 60000, MANY = 40 };

/* GET /hold waits for `happened` to be more than it was at the start of the test; GET /events tells
 * every change of it; anything else is answered at once. */
struct fixture {
    struct http *http;
    atomic_long happened;
    atomic_int asked, again, freed, done, cut;
    long hold_ms;
};

struct watcher {
    struct fixture *f;
    long seen;
};

static bool has_happened(void *state)
{
    const struct watcher *watcher = state;
    return atomic_load(&watcher->f->happened) > watcher->seen;
}

static ssize_t tell(void *state, char *to, size_t size)
{
    struct watcher *watcher = state;
    long now = atomic_load(&watcher->f->happened);
    if (now < 0)
        return STREAM_END;
    if (now == watcher->seen)
        return STREAM_LATER;
    watcher->seen = now;
    return snprintf(to, size, "data: %ld\n\n", now);
}

static void free_watcher(void *state)
{
    struct watcher *watcher = state;
    atomic_fetch_add(&watcher->f->freed, 1);
    free(watcher);
}

static void answer(void *context, const struct request *request, struct reply *reply)
{
    struct fixture *f = context;
    struct watcher *watcher = calloc(1, sizeof(*watcher));
    watcher->f = f;
    atomic_fetch_add(&f->asked, 1);
    const struct watcher *held = request->held; /* still there */
    if (held && held->f == f)
        atomic_fetch_add(&f->again, 1);
    if (strcmp(request->path, "/events") == 0) {
        reply_events_take(reply, &(const struct stream){.read = tell,
                                                        .ready = has_happened,
                                                        .free = free_watcher,
                                                        .state = watcher});
    } else if (strcmp(request->path, "/hold") == 0 && request->waited_ms < f->hold_ms &&
               !request->last && atomic_load(&f->happened) == 0) {
        reply_hold_take(reply, &(const struct hold){.ready = has_happened,
                                                    .free = free_watcher,
                                                    .state = watcher,
                                                    .wait_ms = f->hold_ms - request->waited_ms});
    } else {
        char text[64];
        snprintf(text, sizeof(text), "happened %ld last %d", atomic_load(&f->happened),
                 request->last);
        reply_text_take(reply, "text/plain", strdup(text));
        free(watcher);
    }
}

static void observe(void *context, const struct http_done *done)
{
    struct fixture *f = context;
    atomic_fetch_add(&f->cut, done->cut);
    atomic_fetch_add(&f->done, 1);
}

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    char reason[256];
    const struct http_options options = {
        .host = "127.0.0.1", .handler = answer, .observer = observe, .context = f};
    f->hold_ms = HOLD_MS;
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

static int ask(const struct fixture *f, const char *path)
{
    char request[256];
    int size = snprintf(request, sizeof(request), "GET %s HTTP/1.1\r\n" CLIENT_HOST "\r\n", path);
    int fd = client_dial(f->http);
    client_say(fd, request, (size_t)size);
    return fd;
}

static void happen(struct fixture *f)
{
    atomic_fetch_add(&f->happened, 1);
    http_pulse(f->http);
}

/* So many answers are held, and streams open: a moment after handlers have asked for it. */
static void await_resting(const struct fixture *f, int64_t holds, int64_t streams)
{
    struct http_counts counts;
    for (int64_t end_ms = client_now_ms() + WAIT_MS; client_now_ms() < end_ms;) {
        http_count(f->http, &counts);
        if ((int64_t)counts.holds == holds && (int64_t)counts.streams == streams)
            return;
        client_sleep_ms(2);
    }
    fail_msg("%d holds, %d streams", (int)counts.holds, (int)counts.streams);
}

/* More than there are threads, and somebody else is served meanwhile. */
static void held_until_it_happens(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    int fds[MANY];
    f->hold_ms = LONG_MS;
    for (int i = 0; i < MANY; i++)
        fds[i] = ask(f, "/hold");
    client_wait_count(&f->asked, MANY);
    await_resting(f, MANY, 0);
    assert_false(client_listen(fds[0], text, 50));
    assert_string_equal(text, "");
    int other = ask(f, "/");
    client_listen(other, text, WAIT_MS);
    assert_non_null(strstr(text, "happened 0"));
    close(other);
    int64_t begin_ms = client_now_ms();
    happen(f);
    for (int i = 0; i < MANY; i++) {
        struct pollfd poller = {.fd = fds[i], .events = POLLIN};
        assert_int_equal(poll(&poller, 1, WAIT_MS), 1);
    }
    assert_true(client_now_ms() - begin_ms < LONG_MS / 2);
    for (int i = 0; i < MANY; i++) {
        client_listen(fds[i], text, WAIT_MS);
        assert_non_null(strstr(text, "happened 1"));
        close(fds[i]);
    }
    await_resting(f, 0, 0);
    client_wait_count(&f->freed, MANY);
    assert_int_equal(f->again, MANY); /* with what each had left in its hold */
}

/* Not before and not much later than asked for; the handler is not asked all the time. */
static void held_for_so_long(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    int64_t begin_ms = client_now_ms();
    int fd = ask(f, "/hold");
    struct pollfd poller = {.fd = fd, .events = POLLIN};
    assert_int_equal(poll(&poller, 1, WAIT_MS), 1);
    int64_t took = client_now_ms() - begin_ms;
    client_listen(fd, text, WAIT_MS);
    assert_non_null(strstr(text, "happened 0"));
    assert_in_range(took, HOLD_MS - 5, HOLD_MS + 10000);
    assert_int_equal(f->asked, 2);
    close(fd);
}

/* The connection lives on, and another request on it may be held, too. */
static void held_twice_on_a_connection(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    static const char again[] = "GET /hold HTTP/1.1\r\n" CLIENT_HOST "\r\n";
    f->hold_ms = 100;
    int fd = ask(f, "/hold");
    for (int i = 0; i < 3; i++) {
        client_listen(fd, text, WAIT_MS);
        assert_non_null(strstr(text, "happened 0"));
        client_say(fd, again, strlen(again));
    }
    close(fd);
}

static void leavers_are_noticed(void **state)
{
    struct fixture *f = *state;
    f->hold_ms = LONG_MS;
    int held = ask(f, "/hold"), stream = ask(f, "/events");
    client_wait_count(&f->asked, 2);
    await_resting(f, 1, 1);
    close(held);
    close(stream);
    client_wait_count(&f->freed, 2);
    await_resting(f, 0, 0);
}

static void events_come_as_they_happen(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE], expected[64];
    int fd = ask(f, "/events");
    int quick = 0;
    client_await(fd, text, "\r\n\r\n");
    assert_non_null(strstr(text, "Content-Type: text/event-stream\r\n"));
    assert_non_null(strstr(text, "X-Accel-Buffering: no\r\n"));
    assert_non_null(strstr(text, "Cache-Control: no-store\r\n"));
    for (int i = 1; i <= 30; i++) {
        int64_t begin_ms = client_now_ms();
        happen(f);
        struct pollfd poller = {.fd = fd, .events = POLLIN};
        assert_int_equal(poll(&poller, 1, WAIT_MS), 1);
        quick += client_now_ms() - begin_ms < 100;
        ssize_t got = recv(fd, text, sizeof(text) - 1, 0);
        assert_true(got > 0);
        text[got] = '\0';
        snprintf(expected, sizeof(expected), "data: %d\n\n", i);
        assert_non_null(strstr(text, expected));
    }
    assert_true(quick >= 10);       /* without a pulse they wait for the next look, LOOK_MS */
    atomic_store(&f->happened, -1); /* seen at the next look, without a pulse */
    client_listen(fd, text, WAIT_MS);
    assert_non_null(strstr(text, "0\r\n\r\n"));
    client_wait_count(&f->done, 1);
    assert_int_equal(f->cut, 0);
    close(fd);
}

/* The processor does next to nothing while nothing happens. */
static void resting_costs_little(void **state)
{
    struct fixture *f = *state;
    struct rusage before, after;
    int fds[MANY];
    for (int i = 0; i < MANY; i++)
        fds[i] = ask(f, i % 2 ? "/events" : "/hold");
    client_wait_count(&f->asked, MANY);
    await_resting(f, MANY / 2, MANY / 2);
    getrusage(RUSAGE_SELF, &before);
    client_sleep_ms(1000);
    getrusage(RUSAGE_SELF, &after);
    long us = (after.ru_utime.tv_sec - before.ru_utime.tv_sec) * 1000000L + after.ru_utime.tv_usec -
              before.ru_utime.tv_usec +
              (after.ru_stime.tv_sec - before.ru_stime.tv_sec) * 1000000L + after.ru_stime.tv_usec -
              before.ru_stime.tv_usec;
    for (int i = 0; i < MANY; i++)
        close(fds[i]);
    assert_true(us < 200000); /* a spinning reader takes a whole core or more */
}

static void limit_of_streams(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    int fds[LIMIT_STREAMS_MAX];
    for (int i = 0; i < LIMIT_STREAMS_MAX; i++)
        fds[i] = ask(f, "/events");
    for (int i = 0; i < LIMIT_STREAMS_MAX; i++) {
        struct pollfd poller = {.fd = fds[i], .events = POLLIN};
        assert_int_equal(poll(&poller, 1, WAIT_MS), 1);
    }
    int beyond = ask(f, "/events"), plain = ask(f, "/");
    client_listen(beyond, text, WAIT_MS);
    assert_non_null(strstr(text, "HTTP/1.1 503"));
    assert_non_null(strstr(text, "LIMIT_STREAMS_MAX"));
    assert_non_null(strstr(text, "Retry-After: 1\r\n"));
    client_listen(plain, text, WAIT_MS);
    assert_non_null(strstr(text, "HTTP/1.1 200"));
    close(fds[0]);
    client_wait_count(&f->freed, 2); /* the refused one's, too */
    await_resting(f, 0, LIMIT_STREAMS_MAX - 1);
    close(beyond);
    beyond = ask(f, "/events");
    client_await(beyond, text, "\r\n\r\n");
    assert_non_null(strstr(text, "HTTP/1.1 200"));
    close(beyond);
    close(plain);
    for (int i = 1; i < LIMIT_STREAMS_MAX; i++)
        close(fds[i]);
}

static void limit_of_holds(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    static int fds[LIMIT_HOLDS_MAX];
    f->hold_ms = LONG_MS;
    for (int i = 0; i < LIMIT_HOLDS_MAX; i++)
        fds[i] = ask(f, "/hold");
    client_wait_count(&f->asked, LIMIT_HOLDS_MAX);
    await_resting(f, LIMIT_HOLDS_MAX, 0);
    int beyond = ask(f, "/hold");
    client_listen(beyond, text, WAIT_MS);
    assert_non_null(strstr(text, "HTTP/1.1 503"));
    assert_non_null(strstr(text, "LIMIT_HOLDS_MAX"));
    happen(f);
    for (int i = 0; i < LIMIT_HOLDS_MAX; i++) {
        struct pollfd poller = {.fd = fds[i], .events = POLLIN};
        assert_int_equal(poll(&poller, 1, WAIT_MS), 1);
        close(fds[i]);
    }
    close(beyond);
}

/* Streams end, held requests are answered, and nobody waits for a limit. */
static void stop_wakes_everybody(void **state)
{
    struct fixture *f = *state;
    char text[CLIENT_ANSWER_SIZE];
    f->hold_ms = LONG_MS;
    int held = ask(f, "/hold"), stream = ask(f, "/events");
    client_wait_count(&f->asked, 2);
    await_resting(f, 1, 1);
    int64_t begin_ms = client_now_ms();
    http_stop(f->http);
    f->http = NULL;
    assert_true(client_now_ms() - begin_ms < LIMIT_DRAIN_MS - 500);
    assert_true(client_listen(held, text, WAIT_MS));
    assert_non_null(strstr(text, "happened 0 last 1"));
    assert_true(client_listen(stream, text, WAIT_MS));
    assert_non_null(strstr(text, "\r\n\r\n0\r\n\r\n"));
    close(held);
    close(stream);
}

/* An id of the client's is kept when it is sane; else there is one of ours, each time another. */
static void request_ids(void **state)
{
    struct fixture *f = *state;
    static const struct {
        const char *given;
        bool kept;
    } cases[] = {{"X-Request-Id: abc-1.2_3\r\n", true},
                 {"", false},
                 {"X-Request-Id: a b\r\n", false},
                 {"X-Request-Id: <script>\r\n", false},
                 {"X-Request-Id: 0123456789012345678901234567890123456789012345678901234567890123"
                  "\r\n",
                  true},
                 {"X-Request-Id: 01234567890123456789012345678901234567890123456789012345678901234"
                  "\r\n",
                  false}};
    char text[CLIENT_ANSWER_SIZE], request[512], ids[6][100];
    for (size_t i = 0; i < 6; i++) {
        int fd = client_dial(f->http);
        int size = snprintf(request, sizeof(request), "GET / HTTP/1.1\r\n" CLIENT_HOST "%s\r\n",
                            cases[i].given);
        client_say(fd, request, (size_t)size);
        client_listen(fd, text, WAIT_MS);
        close(fd);
        const char *line = strstr(text, "X-Request-Id: ");
        assert_non_null(line);
        snprintf(ids[i], sizeof(ids[i]), "%.*s", (int)(strcspn(line, "\n") + 1), line);
        assert_int_equal(strcmp(ids[i], cases[i].given) == 0, cases[i].kept);
        assert_true(strlen(ids[i]) > 20);
        for (size_t j = 0; j < i; j++)
            assert_string_not_equal(ids[i], ids[j]);
    }
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    setrlimit(RLIMIT_NOFILE, &(const struct rlimit){.rlim_cur = 4096, .rlim_max = 4096});
    const struct CMUnitTest tests[] = {
        TEST(held_until_it_happens),      TEST(held_for_so_long),
        TEST(held_twice_on_a_connection), TEST(leavers_are_noticed),
        TEST(events_come_as_they_happen), TEST(resting_costs_little),
        TEST(limit_of_streams),           TEST(limit_of_holds),
        TEST(stop_wakes_everybody),       TEST(request_ids),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
