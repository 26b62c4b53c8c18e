/* SPDX-License-Identifier: GPL-3.0-or-later
 * Results that take seconds to be printed are printed aside, to the same bytes; short ones at once.
 */
#include "desk.h"

#include "aside.h"
#include "limits.h"
#include "store_jobs.h"
#include "worker.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { PATH = 128, TRIES = 60000, MS = 1000 };

static void await_done(struct desk *f, const char *id)
{
    struct job_record record = {.state = JOB_QUEUED};
    for (int i = 0; i < TRIES && record.state != JOB_DONE; i++) {
        usleep(MS);
        job_record_fini(&record);
        assert_int_equal(store_jobs_get(f->service.store, id, &record), STORE_OK);
        assert_int_not_equal(record.state, JOB_FAILED);
    }
    assert_int_equal(record.state, JOB_DONE);
    job_record_fini(&record);
}

/* A job of one long table and one short one, computed. */
static void compute(struct desk *f)
{
    static const char job[] = "{\"particles\":1,\"length\":1,\"time\":1,\"time_step\":0.1,"
                              "\"observables\":{\"density\":{\"bins\":20000},\"energy\":{}}}";
    assert_int_equal(ask(f, "POST", "/v1/jobs", job), 202);
    desk_take_id(f, f->id);
    struct workers *workers = workers_start(1, f->service.queue, f->service.store);
    assert_non_null(workers);
    await_done(f, f->id);
    workers_stop(workers);
}

/* As http.c does: asks, and where the reply is held asks again when it is ready. */
static bool get(struct desk *f, const char *path, struct reply *reply)
{
    struct request request = {.method = "GET", .path = path, .body = ""};
    *reply = (struct reply){0};
    routes_dispatch(&f->service, &request, reply);
    if (!reply->hold.ready)
        return false;
    for (int i = 0; i < TRIES && !reply->hold.ready(reply->hold.state); i++)
        usleep(MS);
    struct hold before = reply->hold;
    reply->hold = (struct hold){0};
    request.held = before.state;
    routes_dispatch(&f->service, &request, reply);
    hold_fini(&before);
    assert_null(reply->hold.ready);
    return true;
}

static void aside_to_the_same_bytes(void **state)
{
    struct desk *f = *state;
    static const char *const forms[] = {"", "/density", "/density.csv", "/density.svg"};
    char path[PATH];
    compute(f);
    for (size_t i = 0; i < sizeof(forms) / sizeof(forms[0]); i++) {
        struct reply reply;
        snprintf(path, sizeof(path), "/v1/jobs/%s/results%s", f->id, forms[i]);
        assert_int_equal(ask(f, "GET", path, NULL), 200); /* there is no lane */
        f->service.lane[LANE_RESULTS] = aside_create(&aside_rules[LANE_RESULTS]);
        assert_non_null(f->service.lane[LANE_RESULTS]);
        assert_true(get(f, path, &reply));
        assert_int_equal(reply.status, 200);
        assert_string_equal(reply.body, f->reply.body);
        assert_string_equal(reply.content_type, f->reply.content_type);
        assert_string_equal(reply.etag, f->reply.etag);
        reply_fini(&reply);
        aside_free(f->service.lane[LANE_RESULTS]);
        f->service.lane[LANE_RESULTS] = NULL;
    }
}

static void at_once(void **state)
{
    struct desk *f = *state;
    static const char *const others[] = {"/energy", "/energy.csv", "/msd", "/msd.csv"};
    char path[PATH], etag[ETAG_SIZE];
    struct reply reply;
    compute(f);
    f->service.lane[LANE_RESULTS] = aside_create(&aside_rules[LANE_RESULTS]);
    for (size_t i = 0; i < sizeof(others) / sizeof(others[0]); i++) {
        snprintf(path, sizeof(path), "/v1/jobs/%s/results%s", f->id, others[i]);
        assert_false(get(f, path, &reply));
        assert_int_equal(reply.status, i < 2 ? 200 : 404);
        reply_fini(&reply);
    }
    /* Nothing is printed for who has it. */
    snprintf(path, sizeof(path), "/v1/jobs/%s/results/density", f->id);
    assert_true(get(f, path, &reply));
    memcpy(etag, reply.etag, sizeof(etag));
    reply_fini(&reply);
    const struct request known = {.method = "GET", .path = path, .body = "", .if_none_match = etag};
    routes_dispatch(&f->service, &known, &reply);
    assert_null(reply.hold.ready);
    assert_int_equal(reply.status, 304);
    reply_fini(&reply);
    aside_free(f->service.lane[LANE_RESULTS]);
    f->service.lane[LANE_RESULTS] = NULL;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(aside_to_the_same_bytes),
        DESK_TEST(at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
