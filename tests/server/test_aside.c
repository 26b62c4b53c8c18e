/* SPDX-License-Identifier: GPL-3.0-or-later
 * Long requests aside: held until they are answered, in order, so many and no more; whoever leaves,
 * and a server that stops. And who writes waits for the store without a thread. */
#include "desk.h"

#include "aside.h"
#include "limits.h"
#include "store_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* Opened, the handler goes on. */
struct gate {
    atomic_bool open;
    atomic_int begun, passed;
};

struct fixture {
    struct desk desk;
    struct gate gate;
};

static void pause_a_little(void)
{
    usleep(1000);
}

static void slow(const struct service *service, const struct call *call, struct reply *reply)
{
    struct gate *gate = (struct gate *)service->reports; /* see set_up */
    atomic_fetch_add(&gate->begun, 1);
    while (!atomic_load(&gate->open))
        pause_a_little();
    atomic_fetch_add(&gate->passed, 1);
    char *text = NULL;
    if (asprintf(&text, "%d %s %s %s", atomic_load(&gate->passed), call->request->body,
                 call->request->idempotency_key, call->identity.owner) < 0)
        text = NULL;
    reply_text_take(reply, "text/plain", text);
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    *state = f;
    if (desk_open(&f->desk) != 0)
        return -1;
    f->desk.service.reports = (struct report_keeper *)&f->gate; /* where the handler finds it */
    f->desk.service.aside = aside_create("test");
    return f->desk.service.aside ? 0 : -1;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    atomic_store(&f->gate.open, true);
    reply_fini(&f->desk.reply);
    aside_free(f->desk.service.aside);
    desk_close(&f->desk);
    free(f);
    return 0;
}

/* Texts that are gone when it returns. */
static void ask_slow(struct fixture *f, const char *body, void *held, struct reply *reply)
{
    char *copy = strdup(body), *key = strdup("a key");
    const struct request request = {.method = "POST",
                                    .path = "/slow",
                                    .idempotency_key = key,
                                    .body = copy,
                                    .body_size = strlen(copy),
                                    .held = held};
    const struct call call = {.request = &request, .identity = {.owner = "eve"}};
    aside_answer(f->desk.service.aside, slow, &f->desk.service, &call, reply);
    memset(copy, '!', strlen(body));
    free(copy);
    free(key);
}

static void begin(struct fixture *f, const char *body, struct reply *reply)
{
    *reply = (struct reply){0};
    ask_slow(f, body, NULL, reply);
}

/* As http.c asks again: the hold before is freed afterwards. */
static void again(struct fixture *f, struct reply *reply)
{
    struct hold before = reply->hold;
    reply->hold = (struct hold){0};
    ask_slow(f, "", before.state, reply);
    hold_fini(&before);
}

static void await(struct fixture *f, struct reply *reply)
{
    assert_non_null(reply->hold.ready);
    for (int i = 0; i < 5000 && !reply->hold.ready(reply->hold.state); i++)
        pause_a_little();
    assert_true(reply->hold.ready(reply->hold.state));
    again(f, reply);
    assert_null(reply->hold.ready);
}

/* The first is being answered. */
static void await_begun(struct fixture *f)
{
    for (int i = 0; i < 5000 && atomic_load(&f->gate.begun) == 0; i++)
        pause_a_little();
    assert_int_equal(atomic_load(&f->gate.begun), 1);
}

static void held_until_answered(void **state)
{
    struct fixture *f = *state;
    struct reply first, second;
    begin(f, "one", &first);
    begin(f, "two", &second);
    assert_non_null(first.hold.ready);
    assert_false(first.hold.ready(first.hold.state));
    again(f, &first); /* it was time for a look */
    again(f, &first);
    assert_non_null(first.hold.ready);
    atomic_store(&f->gate.open, true);
    await(f, &second);
    await(f, &first);
    assert_int_equal(first.status, 200);
    assert_string_equal(first.body, "1 one a key eve");
    assert_string_equal(second.body, "2 two a key eve");
    reply_fini(&first);
    reply_fini(&second);
}

static void those_who_leave(void **state)
{
    struct fixture *f = *state;
    struct reply reply, other;
    begin(f, "one", &reply);
    begin(f, "two", &other);
    reply_fini(&reply);
    reply_fini(&other);
    atomic_store(&f->gate.open, true);
    for (int i = 0; i < 5000 && atomic_load(&f->gate.passed) < 2; i++)
        pause_a_little();
    assert_int_equal(atomic_load(&f->gate.passed), 2);
}

static void so_many_and_no_more(void **state)
{
    struct fixture *f = *state;
    struct reply replies[LIMIT_ASIDE_MAX + 1], more;
    for (size_t i = 0; i < LIMIT_ASIDE_MAX + 1; i++) {
        begin(f, "x", &replies[i]);
        assert_non_null(replies[i].hold.ready);
        await_begun(f);
    }
    begin(f, "x", &more);
    assert_int_equal(more.status, 503);
    reply_fini(&more);
    atomic_store(&f->gate.open, true);
    for (size_t i = 0; i < LIMIT_ASIDE_MAX + 1; i++) {
        await(f, &replies[i]);
        assert_int_equal(replies[i].status, 200);
        reply_fini(&replies[i]);
    }
}

static void *open_late(void *gate)
{
    usleep(50000);
    atomic_store(&((struct gate *)gate)->open, true);
    return NULL;
}

static void stopping(void **state)
{
    struct fixture *f = *state;
    struct reply first, second, third;
    pthread_t thread;
    begin(f, "one", &first);
    await_begun(f);
    begin(f, "two", &second);
    assert_int_equal(pthread_create(&thread, NULL, open_late, &f->gate), 0);
    aside_stop(f->desk.service.aside);
    pthread_join(thread, NULL);
    begin(f, "three", &third);
    assert_int_equal(third.status, 503);
    await(f, &first);
    await(f, &second);
    assert_int_equal(first.status, 200); /* what was begun is answered to its end */
    assert_int_equal(second.status, 503);
    assert_int_equal(atomic_load(&f->gate.passed), 1);
    reply_fini(&first);
    reply_fini(&second);
    reply_fini(&third);
}

/* No hold will be granted: it is waited for. */
static void asked_for_the_last_time(void **state)
{
    struct fixture *f = *state;
    struct reply reply = {0};
    const struct request request = {
        .method = "POST", .path = "/slow", .body = "z", .body_size = 1, .last = true};
    const struct call call = {.request = &request};
    atomic_store(&f->gate.open, true);
    aside_answer(f->desk.service.aside, slow, &f->desk.service, &call, &reply);
    assert_int_equal(reply.status, 200);
    reply_fini(&reply);
}

/* While a large transaction is under way who reads is answered, who writes rests. */
static void writers_rest(void **state)
{
    struct fixture *f = *state;
    struct desk *desk = &f->desk;
    desk->service.reports = NULL;
    store_large_begin(desk->service.store);
    assert_int_equal(ask(desk, "GET", "/v1/jobs", NULL), 200);
    assert_int_equal(ask(desk, "POST", "/v1/estimate", JOB("")), 200);
    assert_int_equal(ask(desk, "POST", "/v1/jobs", JOB("")), 0);
    assert_non_null(desk->reply.hold.ready);
    assert_false(desk->reply.hold.ready(desk->reply.hold.state));
    store_large_end(desk->service.store);
    assert_true(desk->reply.hold.ready(desk->reply.hold.state));
    /* What a hold left is no business of the handler. */
    const struct request request = {.method = "POST",
                                    .path = "/v1/sweeps",
                                    .body = "{}",
                                    .body_size = 2,
                                    .held = desk->service.store,
                                    .last = true};
    assert_int_equal(desk_send(desk, &request), 422);
    assert_int_equal(ask(desk, "POST", "/v1/jobs", JOB("")), 202);
}

/* What was put off is done: jobs of whole segments are in the index. */
static void settled(void **state)
{
    struct fixture *f = *state;
    struct store *store = f->desk.service.store;
    static const char body[] = "{\"base\":" JOB("") ",\"axes\":{\"/seed\":{\"first\":1,"
                                                    "\"count\":5000}}}";
    const struct request request = {.method = "POST",
                                    .path = "/v1/sweeps",
                                    .body = body,
                                    .body_size = strlen(body),
                                    .last = true};
    f->desk.service.reports = NULL;
    assert_int_equal(desk_send(&f->desk, &request), 202);
    aside_stop(f->desk.service.aside); /* and with it what comes after the answer */
    assert_false(store_busy(store));
    assert_false(store_settle(store));
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, "SELECT count(*) FROM job_segments");
    assert_true(stmt_step(&row));
    assert_int_equal(stmt_integer(&row, 0), 4);
    stmt_fini(&row);
    store_read_end(store, db);
}

#define ASIDE_TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        ASIDE_TEST(held_until_answered),
        ASIDE_TEST(those_who_leave),
        ASIDE_TEST(so_many_and_no_more),
        ASIDE_TEST(stopping),
        ASIDE_TEST(asked_for_the_last_time),
        ASIDE_TEST(writers_rest),
        ASIDE_TEST(settled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
