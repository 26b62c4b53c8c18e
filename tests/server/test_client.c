/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_client.c - the client of the command line against servers that fail it: nothing is sent
 * twice that must not be, nothing that broke off passes for whole.
 * Waits: for who is silent. */
#include "client.h"
#include "event_lines.h"
#include "fake_server.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define OK_HEAD "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nConnection: close\r\n"
#define OK OK_HEAD "Content-Length: 2\r\n\r\n{}"
#define CUT OK_HEAD "Content-Length: 20\r\n\r\n{\"half\":"
#define BUSY                                                                                       \
    "HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\nConnection: close\r\n"                  \
    "Content-Length: 0\r\n\r\n"

static struct client *connect_to(const char *url, const char *token, int64_t silence_s)
{
    const struct client_options options = {.url = url, .token = token, .silence_s = silence_s};
    char reason[256];
    struct client *client = client_create(&options, reason, sizeof reason);
    assert_non_null(client);
    return client;
}

/* Asks a server that gives these answers; its requests stay in `server`. */
static enum client_status ask(struct fake_server *server, const char *const *answers,
                              const struct client_request *request, struct client_answer *answer)
{
    bool enough = true; /* to be patient with */
    for (size_t i = 0; answers[i]; i++)
        enough = enough && (strcmp(answers[i], BUSY) == 0 || strcmp(answers[i], "...") == 0);
    fake_server_start(server, answers);
    struct client *client = connect_to(server->url, "bcd_t0ken", 1);
    client_patience(client, enough ? 1500 : 30000);
    enum client_status status = client_ask(client, request, answer);
    client_free(client);
    fake_server_stop(server);
    return status;
}

static const struct client_request submission = {
    .method = "POST", .path = "/v1/jobs", .body = "{\"a\":1}", .body_size = 7, .key = "key-1"};

static void a_request_has_what_it_needs(void **state)
{
    static const char *const answers[] = {OK, NULL};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &submission, &answer), CLIENT_OK);
    assert_int_equal(answer.status, 200);
    assert_string_equal(answer.body, "{}");
    assert_string_equal(answer.type, "application/json");
    assert_int_equal(strncmp(server.request[0], "POST /v1/jobs HTTP/1.1\r\n", 24), 0);
    assert_non_null(strstr(server.request[0], "Authorization: Bearer bcd_t0ken\r\n"));
    assert_non_null(strstr(server.request[0], "Idempotency-Key: key-1\r\n"));
    assert_non_null(strstr(server.request[0], "Content-Type: application/json\r\n"));
    assert_non_null(strstr(server.request[0], "\r\n\r\n{\"a\":1}"));
    client_answer_fini(&answer);
}

static void what_was_lost_is_sent_again_under_the_same_key(void **state)
{
    static const char *const answers[] = {"", CUT, OK, NULL};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &submission, &answer), CLIENT_OK);
    assert_string_equal(answer.body, "{}");
    assert_int_equal(server.served, 3);
    for (int i = 0; i < 3; i++) {
        assert_non_null(strstr(server.request[i], "Idempotency-Key: key-1\r\n"));
        assert_non_null(strstr(server.request[i], "{\"a\":1}"));
    }
    client_answer_fini(&answer);
}

static void what_must_not_happen_twice_is_sent_once(void **state)
{
    static const char *const answers[] = {"", OK, NULL};
    struct client_request request = submission;
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    request.once = true;
    assert_int_equal(ask(&server, answers, &request, &answer), CLIENT_UNREACHABLE);
    assert_int_equal(server.served, 1);
    assert_null(answer.body);
}

static void a_busy_server_is_asked_again(void **state)
{
    static const char *const answers[] = {BUSY, BUSY, OK, NULL};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &submission, &answer), CLIENT_OK);
    assert_int_equal(answer.status, 200);
    client_answer_fini(&answer);
}

static void patience_ends(void **state)
{
    static const char *const answers[] = {BUSY, BUSY, BUSY, BUSY, BUSY, BUSY, BUSY, NULL};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &submission, &answer), CLIENT_OK);
    assert_int_equal(answer.status, 503);
    assert_in_range(server.served, 2, 6);
    client_answer_fini(&answer);
}

static void a_silent_server_is_given_up(void **state)
{
    static const char *const answers[] = {"...", NULL};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &submission, &answer), CLIENT_UNREACHABLE);
}

static void nobody_there_is_told_at_once(void **state)
{
    static const char *const answers[] = {NULL};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    fake_server_start(&server, answers);
    fake_server_stop(&server); /* the port is free, and nobody listens */
    struct client *client = connect_to(server.url, NULL, 0);
    client_patience(client, 60000);
    assert_int_equal(client_ask(client, &submission, &answer), CLIENT_UNREACHABLE);
    assert_non_null(strstr(client_words(client), "connect"));
    client_free(client);
}

static bool take(void *context, const char *bytes, size_t size)
{
    text_add_bytes(context, bytes, size);
    return true;
}

static bool refuse(void *context, const char *bytes, size_t size)
{
    (void)context, (void)bytes, (void)size;
    return false;
}

static void a_download_that_broke_off_is_no_download(void **state)
{
    static const char *const length[] = {CUT, OK, NULL};
    static const char *const chunked[] = {
        OK_HEAD "Transfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n", OK, NULL};
    const char *const *const cases[] = {length, chunked};
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        struct text text = {0};
        struct client_request request = {
            .method = "GET", .path = "/v1/x", .take = take, .context = &text};
        struct fake_server server;
        struct client_answer answer;
        assert_int_equal(ask(&server, cases[i], &request, &answer), CLIENT_LOST);
        assert_int_equal(server.served, 1); /* not again: part of it is in the file already */
        free(text_take(&text));
    }
}

static void a_problem_is_an_answer_also_for_a_download(void **state)
{
    static const char *const answers[] = {
        "HTTP/1.1 404 Not Found\r\nConnection: close\r\nContent-Length: 4\r\n\r\nnone", NULL};
    struct client_request request = {.method = "GET", .path = "/v1/x", .take = refuse};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &request, &answer), CLIENT_OK);
    assert_int_equal(answer.status, 404);
    assert_string_equal(answer.body, "none");
    client_answer_fini(&answer);
}

static void whoever_takes_may_stop(void **state)
{
    static const char *const answers[] = {OK, NULL};
    struct client_request request = {.method = "GET", .path = "/v1/x", .take = refuse};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &request, &answer), CLIENT_STOPPED);
}

static void redirects_are_not_followed(void **state)
{
    static const char *const answers[] = {
        "HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:1/\r\nConnection: close\r\n"
        "Content-Length: 0\r\n\r\n",
        NULL};
    struct client_request request = {.method = "GET", .path = "/v1/x"};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    assert_int_equal(ask(&server, answers, &request, &answer), CLIENT_OK);
    assert_int_equal(answer.status, 302); /* the token would go along */
    client_answer_fini(&answer);
}

static void a_stream_goes_on_beside_requests(void **state)
{
    static const char *const answers[] = {
        OK_HEAD "Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n", OK, NULL};
    struct text text = {0};
    const struct client_request stream = {
        .method = "GET", .path = "/v1/events", .events = true, .take = take, .context = &text};
    struct fake_server server;
    struct client_answer answer;
    (void)state;
    fake_server_start(&server, answers);
    struct client *client = connect_to(server.url, NULL, 0);
    assert_true(client_stream_begin(client, &stream));
    for (int i = 0; i < 1000 && client_stream_open(client); i++)
        assert_true(client_wait(client, 50));
    assert_int_equal(client_stream_status(client), 200);
    assert_int_equal(client_ask(client, &submission, &answer), CLIENT_OK);
    client_stream_end(client);
    client_free(client);
    fake_server_stop(&server);
    assert_non_null(strstr(server.request[0], "Accept: text/event-stream\r\n"));
    char *all = text_take(&text);
    assert_string_equal(all, "abc");
    free(all);
    client_answer_fini(&answer);
}

static void urls_and_tokens_are_checked(void **state)
{
    static const struct {
        const char *url, *token;
    } wrong[] = {{"127.0.0.1:8080", NULL},
                 {"ftp://127.0.0.1/", NULL},
                 {"http://", NULL},
                 {"http://a:b@127.0.0.1/", NULL},
                 {"http://127.0.0.1/?x", NULL},
                 {"http://127.0.0.1", "a\r\nX-Evil: 1"},
                 {"http://127.0.0.1", ""},
                 {"http://127.0.0.1", "a b"}};
    char reason[256];
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const struct client_options options = {.url = wrong[i].url, .token = wrong[i].token};
        reason[0] = '\0';
        assert_null(client_create(&options, reason, sizeof reason));
        assert_true(reason[0] != '\0');
    }
    struct client *client = connect_to("https://example.org/bcd/", NULL, 0);
    assert_string_equal(client_url(client), "https://example.org/bcd");
    client_free(client);
}

static void queries_are_encoded(void **state)
{
    struct text path = {0};
    (void)state;
    text_add(&path, "/v1/jobs");
    client_add_query(&path, "diameter>", "0.5");
    client_add_query(&path, "label", "a b&c=\xC3\xA4");
    char *all = text_take(&path);
    assert_string_equal(all, "/v1/jobs?diameter%3E=0.5&label=a%20b%26c%3D%C3%A4");
    free(all);
}

/* ------------------------------------------------------------------- events */

static void take_event(void *context, const char *name, const char *data)
{
    text_add(context, "[%s|%s]", name, data);
}

static void events_are_read_wherever_they_are_cut(void **state)
{
    static const char stream[] =
        ": ping\n\nevent: progress\ndata: {\"a\":1}\n\nid: 3\r\n"
        "event:done\r\ndata:x\r\ndata: y\r\n\r\ndata: bare\n\n\nevent: no\n\n";
    (void)state;
    for (size_t cut = 1; cut < sizeof stream; cut++) {
        struct text text = {0};
        struct event_lines lines = {.take = take_event, .context = &text};
        for (size_t at = 0; at < sizeof stream - 1; at += cut) {
            size_t left = sizeof stream - 1 - at;
            assert_true(event_lines_add(&lines, stream + at, left < cut ? left : cut));
        }
        event_lines_fini(&lines);
        char *all = text_take(&text);
        assert_string_equal(all, "[progress|{\"a\":1}][done|x\ny][message|bare]");
        free(all);
    }
}

static void a_line_without_end_is_no_event(void **state)
{
    struct text text = {0};
    struct event_lines lines = {.take = take_event, .context = &text};
    static char much[EVENT_DATA_BYTES_MAX / 4];
    int taken = 0;
    (void)state;
    memset(much, 'x', sizeof much);
    while (taken < 8 && event_lines_add(&lines, much, sizeof much))
        taken++;
    assert_int_equal(taken, 4);
    event_lines_fini(&lines);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_request_has_what_it_needs),
        cmocka_unit_test(what_was_lost_is_sent_again_under_the_same_key),
        cmocka_unit_test(what_must_not_happen_twice_is_sent_once),
        cmocka_unit_test(a_busy_server_is_asked_again),
        cmocka_unit_test(patience_ends),
        cmocka_unit_test(a_silent_server_is_given_up),
        cmocka_unit_test(nobody_there_is_told_at_once),
        cmocka_unit_test(a_download_that_broke_off_is_no_download),
        cmocka_unit_test(a_problem_is_an_answer_also_for_a_download),
        cmocka_unit_test(whoever_takes_may_stop),
        cmocka_unit_test(redirects_are_not_followed),
        cmocka_unit_test(a_stream_goes_on_beside_requests),
        cmocka_unit_test(urls_and_tokens_are_checked),
        cmocka_unit_test(queries_are_encoded),
        cmocka_unit_test(events_are_read_wherever_they_are_cut),
        cmocka_unit_test(a_line_without_end_is_no_event),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
