/* SPDX-License-Identifier: GPL-3.0-or-later
 * Long requests aside: held until they are answered, in order, so many and no more, of one owner
 * too; whoever leaves, what takes too long, and a server that stops. And who writes waits for the
 * store without a thread. */
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
    atomic_int begun, passed, told;
};

struct fixture {
    struct desk desk;
    struct gate gate;
    struct aside *aside;
    const char *owner; /* who asks */
    int64_t waited_ms;
};

enum { PATIENCE = 60000 }; /* so many of these */

static void pause_a_little(void)
{
    usleep(1000);
}

static void slow(const struct service *service, const struct call *call, struct reply *reply)
{
    struct gate *gate = (struct gate *)service->reports; /* see set_up */
    atomic_fetch_add(&gate->begun, 1);
    while (!atomic_load(&gate->open) && !atomic_load(call->stop))
        pause_a_little();
    atomic_fetch_add(&gate->told, atomic_load(call->stop));
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
    f->owner = "eve";
    f->desk.service.lane[LANE_SWEEPS] = f->aside = aside_create(&aside_rules[LANE_SWEEPS]);
    return f->aside ? 0 : -1;
}

/* Goes by other rules from here on. */
static void change_rules(struct fixture *f, const struct aside_rules *rules)
{
    aside_free(f->aside);
    f->desk.service.lane[LANE_SWEEPS] = f->aside = aside_create(rules);
    assert_non_null(f->aside);
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    atomic_store(&f->gate.open, true);
    reply_fini(&f->desk.reply);
    aside_free(f->aside);
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
                                    .waited_ms = f->waited_ms,
                                    .held = held};
    struct call call = {.request = &request};
    snprintf(call.identity.owner, sizeof(call.identity.owner), "%s", f->owner);
    aside_answer(f->aside, slow, &f->desk.service, &call, reply);
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
    for (int i = 0; i < PATIENCE && !reply->hold.ready(reply->hold.state); i++)
        pause_a_little();
    assert_true(reply->hold.ready(reply->hold.state));
    again(f, reply);
    assert_null(reply->hold.ready);
}

/* So many have come to their handler. */
static void await_begun(struct fixture *f, int count)
{
    for (int i = 0; i < PATIENCE && atomic_load(&f->gate.begun) < count; i++)
        pause_a_little();
    assert_int_equal(atomic_load(&f->gate.begun), count);
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
    for (int i = 0; i < PATIENCE && atomic_load(&f->gate.passed) < 2; i++)
        pause_a_little();
    assert_int_equal(atomic_load(&f->gate.passed), 2);
}

static void so_many_and_no_more(void **state)
{
    struct fixture *f = *state;
    struct reply replies[LIMIT_ASIDE_MAX + 1], more;
    for (size_t i = 0; i < LIMIT_ASIDE_MAX + 1; i++) {
        static const char *const owners[] = {"eve", "adam", "cain"}; /* one alone may not so many */
        f->owner = owners[i % 3];
        begin(f, "x", &replies[i]);
        assert_non_null(replies[i].hold.ready);
        await_begun(f, 1);
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

/* How many of these replies are held; the others are refused, in these words. */
static size_t count_held(struct reply *replies, size_t count, const char *words)
{
    size_t held = 0;
    for (size_t i = 0; i < count; i++) {
        held += replies[i].hold.ready != NULL;
        if (!replies[i].hold.ready) {
            assert_int_equal(replies[i].status, 503);
            assert_non_null(strstr(replies[i].body, words));
        }
    }
    return held;
}

static void end_all(struct reply *replies, size_t count)
{
    for (size_t i = 0; i < count; i++)
        reply_fini(&replies[i]);
}

static const struct aside_rules ends_rules = {
    .name = "test", .full = "full", .ends = true, .ms_max = 2000};

static void await_told(struct fixture *f, int count)
{
    for (int i = 0; i < PATIENCE && atomic_load(&f->gate.told) < count; i++)
        pause_a_little();
    assert_int_equal(atomic_load(&f->gate.told), count);
}

/* Where nobody waits for it any more it is told to stop, but not while it is asked again. */
static void told_to_stop(void **state)
{
    struct fixture *f = *state;
    struct reply first, more;
    change_rules(f, &ends_rules);
    begin(f, "one", &first);
    await_begun(f, 1);
    begin(f, "two", &more);
    assert_int_equal(count_held(&more, 1, "full"), 0);
    reply_fini(&more);
    for (int i = 0; i < 10; i++)
        again(f, &first);
    assert_int_equal(atomic_load(&f->gate.told), 0);
    reply_fini(&first);
    await_told(f, 1);
    for (int i = 0; i < PATIENCE; i++) { /* the next one as soon as it has ended */
        begin(f, "three", &first);
        if (first.hold.ready)
            break;
        reply_fini(&first);
        pause_a_little();
    }
    assert_non_null(first.hold.ready);
    await_begun(f, 2);
    f->waited_ms = 1999;
    again(f, &first);
    assert_int_equal(first.hold.wait_ms, 1);
    f->waited_ms = 2000; /* enough */
    again(f, &first);
    assert_int_equal(first.status, 503);
    assert_non_null(strstr(first.body, "longer than 2 s"));
    reply_fini(&first);
    await_told(f, 2);
}

static void stopping_ends_it(void **state)
{
    struct fixture *f = *state;
    struct reply first;
    change_rules(f, &ends_rules);
    begin(f, "one", &first);
    await_begun(f, 1);
    aside_stop(f->aside);
    assert_int_equal(atomic_load(&f->gate.told), 1);
    await(f, &first);
    reply_fini(&first);
}

static const struct aside_rules owner_rules = {
    .name = "test", .waiting_max = 9, .owner_max = 2, .enough = "enough", .ends = true};

static void so_many_of_one_owner(void **state)
{
    struct fixture *f = *state;
    struct reply hers[4], his;
    change_rules(f, &owner_rules);
    for (size_t i = 0; i < 4; i++) {
        begin(f, "x", &hers[i]);
        await_begun(f, 1);
    }
    assert_int_equal(count_held(hers, 4, "enough"), 2);
    f->owner = "adam";
    begin(f, "y", &his);
    assert_non_null(his.hold.ready);
    f->owner = "eve";
    reply_fini(&hers[1]); /* it waited: its place is free at once */
    begin(f, "x", &hers[1]);
    assert_non_null(hers[1].hold.ready);
    reply_fini(&hers[2]);
    begin(f, "x", &hers[2]);
    assert_null(hers[2].hold.ready);
    end_all(hers, 4);
    atomic_store(&f->gate.open, true);
    f->owner = "adam";
    await(f, &his);
    assert_int_equal(his.status, 200);
    reply_fini(&his);
}

/* Nobody keeps the others out of a lane; but of copies there is one anyway. */
static void every_lane_is_shared(void **state)
{
    (void)state;
    for (int lane = LANE_NONE + 1; lane < LANES; lane++) {
        const struct aside_rules *rules = &aside_rules[lane];
        if (lane == LANE_BACKUPS)
            continue;
        assert_in_range(rules->owner_max, 1, rules->waiting_max);
        assert_non_null(strstr(rules->enough, "_OWNER_MAX"));
    }
}

static void *open_late(void *gate)
{
    usleep(400000); /* by then the other one is stopping */
    atomic_store(&((struct gate *)gate)->open, true);
    return NULL;
}

static void stopping(void **state)
{
    struct fixture *f = *state;
    struct reply first, second, third;
    pthread_t thread;
    begin(f, "one", &first);
    await_begun(f, 1);
    begin(f, "two", &second);
    assert_int_equal(pthread_create(&thread, NULL, open_late, &f->gate), 0);
    aside_stop(f->aside);
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
    aside_answer(f->aside, slow, &f->desk.service, &call, &reply);
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
    aside_stop(f->aside); /* and with it what comes after the answer */
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
        ASIDE_TEST(told_to_stop),
        ASIDE_TEST(stopping_ends_it),
        ASIDE_TEST(so_many_of_one_owner),
        cmocka_unit_test(every_lane_is_shared),
        ASIDE_TEST(stopping),
        ASIDE_TEST(asked_for_the_last_time),
        ASIDE_TEST(writers_rest),
        ASIDE_TEST(settled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
