/* SPDX-License-Identifier: GPL-3.0-or-later
 * handle_find.c without a socket: what GET /v1/jobs understands, and what it refuses. */
#include "desk.h"
#include "limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int ask_list(struct desk *f, const char *name, const char *value)
{
    const struct request_query query = {name, value};
    const struct request request = {
        .method = "GET", .path = "/v1/jobs", .body = "", .query = &query, .query_count = 1};
    return desk_send(f, &request);
}

static void lists(void **state)
{
    struct desk *f = *state;
    char job[512];
    for (int i = 1; i <= 3; i++) {
        snprintf(job, sizeof(job), JOB(",\"seed\":%d"), i);
        assert_int_equal(ask(f, "POST", "/v1/jobs", job), 202);
    }
    assert_int_equal(ask_list(f, "limit", "2"), 200);
    const char *newest = strstr(f->reply.body, "\"seed\":3");
    assert_non_null(newest);
    assert_non_null(strstr(newest, "\"seed\":2"));
    assert_null(strstr(f->reply.body, "\"seed\":1"));
    char cursor[256];
    assert_int_equal(sscanf(strstr(f->reply.body, "\"next\":"), "\"next\":\"%255[^\"]\"", cursor),
                     1);
    assert_int_equal(ask_list(f, "cursor", cursor), 200);
    assert_says(f, "\"seed\":1");
    assert_null(strstr(f->reply.body, "\"seed\":2"));
    assert_says(f, "\"next\":null");
    assert_int_equal(ask_list(f, "limit", "3"), 200); /* exactly all: there is no next page */
    assert_says(f, "\"next\":null");
    assert_int_equal(ask_list(f, "seed", "2"), 200);
    assert_says(f, "\"seed\":2");
    assert_null(strstr(f->reply.body, "\"seed\":3"));
    assert_int_equal(ask_list(f, "state", "done"), 200);
    assert_string_equal(f->reply.body, "{\"jobs\":[],\"next\":null}\n");
}

static const char *const bad[][2] = {{"limit", "0"},
                                     {"limit", "1001"},
                                     {"limit", "-1"},
                                     {"limit", "1e2"},
                                     {"limit", " 1"},
                                     {"limit", ""},
                                     {"limit", "99999999999999999999"},
                                     {"cursor", "abc"},
                                     {"cursor", "0"},
                                     {"cursor", "9223372036854775808"},
                                     {"cursor", "1;DROP"},
                                     {"state", "sleeping"},
                                     {"state", ""},
                                     {"diametr", "1"},
                                     {"potential", "cosine"},
                                     {"potential.amplitud", "6"},
                                     {"potential.", "6"},
                                     {"observables.msd", "1"},
                                     {"observables.msd.", "1"},
                                     {"observables.nothing.last", "1"},
                                     {"", "1"},
                                     {".", "1"},
                                     {"x'; --", "1"},
                                     {"$.particles", "5"},
                                     {"state", "done,"},
                                     {"sort", ""},
                                     {"sort", "-"},
                                     {"sort", "diametr"},
                                     {"sort", "-potential"},
                                     {"sort", "tag"},
                                     {"diameter>", "a"},
                                     {"diameter<", ""},
                                     {"diameter>0.3", ""},
                                     {"diameter><", "1"},
                                     {"diametr>", "1"},
                                     {"derived.stepz", "1"},
                                     {"results.energy", "1"},
                                     {"results.energy.energi", "1"},
                                     {"results.msd.msd", "1"},
                                     {"submitted_after", "yesterday"},
                                     {"submitted_after", "2026-02-30"},
                                     {"submitted_before", "2026-11-26T25:00"},
                                     {"submitted_before", "12"},
                                     /* values that no job can have */
                                     {"diameter", "NaN"},
                                     {"diameter", ""},
                                     {"diameter", "no number"},
                                     {"diameter", "nan..inf"},
                                     {"diameter", "0.3..inf"},
                                     {"diameter", "-inf..0.3"},
                                     {"diameter", ".."},
                                     {"diameter", "0.5..0.3"},
                                     {"diameter", "1e999"},
                                     {"diameter", "0x1"},
                                     {"diameter", " 0.5"},
                                     {"diameter", "0.3..0.4..0.5"},
                                     {"diameter!", "NaN"},
                                     {"diameter>", "inf"},
                                     {"diameter<", "-Infinity"},
                                     {"potential.amplitude", "six"},
                                     {"particles", "0b1"},
                                     {"seed", "two"},
                                     {"priority", "high"},
                                     {"priority!", ""},
                                     {"derived.steps", "many"},
                                     {"derived.diffusion", "nan"},
                                     {"derived.method>", "3"},
                                     {"results.energy.energy", "NaN"},
                                     {"results.energy.energy", ""},
                                     {"method", "' OR 1=1"},
                                     {"method", "bdc"},
                                     {"method>", "1"},
                                     {"time_step", "automatic"},
                                     {"potential.type", "cosinus"},
                                     {"potential.type!", ""},
                                     {"boundary", "wall"},
                                     {"owner", "Anna"},
                                     {"owner", ""},
                                     {"owner!", "a b"},
                                     {"label", ""},
                                     {"tag", "no such tag"},
                                     {"tag", ""},
                                     {"sweep", "xx"},
                                     {"sweep", ""},
                                     {"sweep", "s/../x"},
                                     {"submitted_at", "yesterday"},
                                     {"finished_at>", "nan"},
                                     {"submitted_at", "2026-11-26..yesterday"},
                                     {"submitted_at", "2026-11-27..2026-11-26"}};
static const char *const good[][2] = {{"limit", "1000"},
                                      {"potential.amplitude", "6"},
                                      {"potential.type", "cosine"},
                                      {"observables.msd.last", "1"},
                                      {"method", "bcd"},
                                      {"method!", "auto"},
                                      {"time_step", "auto"},
                                      {"time_step", "1e-3..1"},
                                      {"time_step>", "1e-3"},
                                      {"potential.type", "fourier"},
                                      {"sort", "-submitted"},
                                      {"sort", "finished"},
                                      {"sort", "diameter"},
                                      {"sort", "-derived.steps"},
                                      {"sort", "results.energy.energy"},
                                      {"diameter>", "0.3"},
                                      {"diameter<", "5e-1"},
                                      {"diameter!", "0.3"},
                                      {"diameter", "0.3..0.5"},
                                      {"diameter", "0.3.."},
                                      {"diameter", "-1e-3..+.5"},
                                      {"diameter", "0...5"},
                                      {"seed", "18446744073709551615"},
                                      {"derived.method", "strang"},
                                      {"results.current.stderr<", "1"},
                                      {"results.density.p_value<", "0.01"},
                                      {"results.energy.z>", "3"},
                                      {"results.contact_force.mean_force>", "1"},
                                      {"owner", "local"},
                                      {"label", "a..b"},
                                      {"tag", "no-such-tag"},
                                      {"owner!", "anna"},
                                      {"label", "1..2"},
                                      {"priority>", "0"},
                                      {"submitted_after", "2026-11-26"},
                                      {"started_after", "2026-11-26T12:00:30.5+01:00"},
                                      {"finished_before", "2026-11-26T12:00Z"},
                                      {"submitted_at>", "1764158400000"},
                                      {"submitted_at>", "2026-11-26"},
                                      {"finished_at", "2026-11-26..2026-11-27T12:00"}};

static void bad_lists(void **state)
{
    struct desk *f = *state;
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        if (ask_list(f, bad[i][0], bad[i][1]) != 400)
            fail_msg("%s=%s gave %d", bad[i][0], bad[i][1], f->reply.status);
        assert_says(f, "{\"parameter\":\"");
    }
    for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++)
        if (ask_list(f, good[i][0], good[i][1]) != 200)
            fail_msg("%s=%s gave %d", good[i][0], good[i][1], f->reply.status);
    struct request_query query[LIMIT_FILTERS_MAX + 1];
    for (int i = 0; i <= LIMIT_FILTERS_MAX; i++)
        query[i] = (struct request_query){"particles", "5"};
    struct request request = {.method = "GET", .path = "/v1/jobs", .body = "", .query = query};
    request.query_count = LIMIT_FILTERS_MAX;
    assert_int_equal(desk_send(f, &request), 200);
    request.query_count = LIMIT_FILTERS_MAX + 1;
    assert_int_equal(desk_send(f, &request), 400);
}

/* How many jobs a list with one parameter has; each has its seed once. */
static int count_listed(struct desk *f, const char *name, const char *value)
{
    int count = 0;
    assert_int_equal(ask_list(f, name, value), 200);
    for (const char *at = f->reply.body; (at = strstr(at, "\"seed\":")); at++)
        count++;
    return count;
}

static void filters_say_what_they_mean(void **state)
{
    struct desk *f = *state;
    char job[512];
    for (int i = 1; i <= 5; i++) {
        snprintf(job, sizeof(job), JOB(",\"seed\":%d,\"label\":\"%d..\",\"tags\":[\"t%d\"]"), i, i,
                 i % 2);
        assert_int_equal(ask(f, "POST", "/v1/jobs", job), 202);
    }
    assert_int_equal(count_listed(f, "seed>", "3"), 3);
    assert_int_equal(count_listed(f, "seed<", "3"), 3);
    assert_int_equal(count_listed(f, "seed!", "3"), 4);
    assert_int_equal(count_listed(f, "seed", "2..4"), 3);
    assert_int_equal(count_listed(f, "seed", "2.."), 4);
    assert_int_equal(count_listed(f, "seed", "..2"), 2);
    assert_int_equal(count_listed(f, "submitted_at", "2020-01-01..2999-01-01"), 5);
    assert_int_equal(count_listed(f, "submitted_at<", "2020-01-01"), 0);
    assert_int_equal(count_listed(f, "method", "auto"), 5);
    assert_int_equal(count_listed(f, "method!", "auto"), 0);
    assert_int_equal(count_listed(f, "tag", "t1"), 3);
    assert_int_equal(count_listed(f, "label", "a..b"), 0);
    assert_int_equal(count_listed(f, "owner", "local"), 5);
    assert_int_equal(count_listed(f, "submitted_after", "2020-01-01"), 5);
    assert_int_equal(count_listed(f, "submitted_before", "2020-01-01T00:00:00Z"), 0);
    assert_int_equal(count_listed(f, "finished_after", "2020-01-01"), 0);
    assert_int_equal(count_listed(f, "derived.steps", "100"), 5);
    assert_int_equal(count_listed(f, "state", "queued"), 5);
    assert_int_equal(ask_list(f, "sort", "seed"), 200);
    assert_true(strstr(f->reply.body, "\"seed\":1") < strstr(f->reply.body, "\"seed\":5"));
    assert_int_equal(ask_list(f, "sort", "-seed"), 200);
    assert_true(strstr(f->reply.body, "\"seed\":1") > strstr(f->reply.body, "\"seed\":5"));
    assert_int_equal(ask_list(f, "sweep", "snone"), 400);
    assert_says(f, "{\"parameter\":\"sweep\",\"detail\":\"must be the id of a sweep; there is none "
                   "with \\\"snone\\\"\"}");
    const struct request sweep = {
        .method = "POST",
        .path = "/v1/sweeps",
        .content_type = "application/json",
        .body = "{\"base\":" JOB("") ",\"axes\":{\"/seed\":[4,5,6,7]}}",
        .body_size = strlen("{\"base\":" JOB("") ",\"axes\":{\"/seed\":[4,5,6,7]}}")};
    char id[JOB_ID_SIZE];
    assert_int_equal(desk_send(f, &sweep), 202);
    desk_take_id(f, id);
    assert_int_equal(count_listed(f, "sweep", id), 4); /* two of them were there already */
    assert_int_equal(ask_list(f, "diameter", "NaN"), 400);
    assert_says(f, "must be a number, a range like 0.3..0.5 or 0.3.., not \\\"NaN\\\"");
    assert_int_equal(ask_list(f, "boundary", "wall"), 400);
    assert_says(f, "must be one of periodic walls, not ");
    assert_int_equal(ask_list(f, "diametr", "1"), 400);
    assert_says(f, "did you mean \\\"diameter\\\"?");
    assert_int_equal(ask_list(f, "observables.msd.xyzzyplugh", "1"), 400);
    assert_says(f, "known are observables.msd.first, ");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(lists),
        DESK_TEST(bad_lists),
        DESK_TEST(filters_say_what_they_mean),
    };
    return cmocka_run_group_tests_name("find", tests, NULL, NULL);
}
