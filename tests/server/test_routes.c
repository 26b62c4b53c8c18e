/* SPDX-License-Identifier: GPL-3.0-or-later
 * routes.c and the handlers behind it without a socket, on a store and a queue without workers:
 * jobs are accepted and stay queued. What needs finished jobs is tested in tests/api with the
 * daemon. */
#include "desk.h"
#include "limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void every_route_is_documented_once(void **state)
{
    (void)state;
    const struct route *route, *other;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        assert_true(route->doc[0] && route->handle && route->pattern[0] == '/');
        for (size_t k = 0; k < i && (other = routes_at(k)); k++)
            assert_false(strcmp(route->method, other->method) == 0 &&
                         strcmp(route->pattern, other->pattern) == 0);
    }
}

static void unknown_paths(void **state)
{
    static const char *const paths[] = {
        "",
        "//",
        "/v1/",
        "/v1/jobs/",
        "/v1/jobs//",
        "/v1/jobs/..",
        "/v2/jobs",
        "/v1/jobs/a%2e",
        "/v1/jobs/ABC",
        "*",
        "/healthz/",
        "/v1/jobs/../../etc/passwd",
        "/v1/jobs/a/results/",
        "/v1/jobs/a/results/msd.png",
        "/v1/jobs/a/results/.csv",
        "/v1/jobs/a/results/m.svg.csv",
        "/v1/jobs/a_b",
        "http://localhost/healthz",
        "/v1/jobs/0123456789012345678901234567890123456789012345678901234567890123"};
    struct desk *f = *state;
    for (size_t i = 0; i < sizeof(paths) / sizeof(paths[0]); i++) {
        assert_int_equal(ask(f, "GET", paths[i], NULL), 404);
        assert_string_equal(f->reply.content_type, "application/problem+json");
        assert_says(f, "\"status\":404");
    }
}

static void wrong_methods(void **state)
{
    struct desk *f = *state;
    assert_int_equal(ask(f, "DELETE", "/v1/jobs", NULL), 405);
    assert_string_equal(f->reply.allow, "POST, GET, HEAD");
    assert_int_equal(ask(f, "PATCH", "/v1/jobs/abc", NULL), 405);
    assert_string_equal(f->reply.allow, "GET, HEAD, DELETE");
    assert_int_equal(ask(f, "GET", "/v1/estimate", NULL), 405);
    assert_string_equal(f->reply.allow, "POST");
    assert_int_equal(ask(f, "get", "/healthz", NULL), 405);
    assert_int_equal(ask(f, "", "/healthz", NULL), 405);
}

static void head_is_get(void **state)
{
    struct desk *f = *state;
    assert_int_equal(ask(f, "HEAD", "/healthz", NULL), 200);
    assert_int_equal(ask(f, "HEAD", "/v1/jobs/nothing", NULL), 404);
}

static void queries_where_none_belong(void **state)
{
    struct desk *f = *state;
    const struct request_query query[] = {{"debug", "1"}, {"x\"", ""}};
    const struct request request = {
        .method = "GET", .path = "/healthz", .body = "", .query = query, .query_count = 2};
    assert_int_equal(desk_send(f, &request), 400);
    assert_says(f, "{\"parameter\":\"debug\",\"detail\":");
    assert_says(f, "{\"parameter\":\"x\\\"\",");
}

static void service_pages(void **state)
{
    struct desk *f = *state;
    assert_int_equal(ask(f, "GET", "/healthz", NULL), 200);
    assert_string_equal(f->reply.body, "{\"status\":\"ok\"}\n");
    assert_int_equal(ask(f, "GET", "/v1", NULL), 200);
    assert_says(f, "{\"method\":\"POST\",\"path\":\"/v1/jobs\",");
    assert_int_equal(ask(f, "GET", "/readyz", NULL), 200);
    queue_stop(f->service.queue);
    assert_int_equal(ask(f, "GET", "/readyz", NULL), 503);
    assert_int_equal(ask(f, "GET", "/healthz", NULL), 200);
}

static void submit_and_look(void **state)
{
    struct desk *f = *state;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE], path[128];
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB("")), 202);
    desk_take_id(f, id);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_string_equal(f->reply.location, path);
    assert_says(f, "\"state\":\"queued\",\"progress\":0,");
    assert_says(f, "\"started_at\":null,\"finished_at\":null,");
    assert_says(f, "\"deduplicated\":false");
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB(",\"mobility\":1.0")), 200); /* the default */
    desk_take_id(f, other);
    assert_string_equal(id, other);
    assert_says(f, "\"deduplicated\":true");
    assert_string_equal(f->reply.location, "");
    assert_int_equal(ask(f, "GET", path, NULL), 200);
    assert_null(strstr(f->reply.body, "deduplicated"));
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB(",\"seed\":2")), 202);
    desk_take_id(f, other);
    assert_string_not_equal(id, other);
}

/* Label, tags, priority and owner hang on the job and are none of its physics. */
static void tickets(void **state)
{
    struct desk *f = *state;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE];
    assert_int_equal(ask(f, "POST", "/v1/jobs",
                         JOB(",\"label\":\"a \\\"b\\\"\",\"tags\":[\"x\",\"a.B-1\",\"x\"],"
                             "\"priority\":-7")),
                     202);
    desk_take_id(f, id);
    assert_says(f, "\"owner\":\"local\",\"label\":\"a \\\"b\\\"\",\"tags\":[\"a.B-1\",\"x\"],"
                   "\"priority\":-7,");
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB(",\"label\":\"another\"")), 200);
    desk_take_id(f, other);
    assert_string_equal(id, other);
    assert_says(f, "\"label\":\"a \\\"b\\\"\"");
    assert_int_equal(ask(f, "POST", "/v1/estimate", JOB(",\"label\":\"a\"")), 200);
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB(",\"seed\":2,\"tags\":[],\"label\":null")),
                     202);
    assert_says(f, "\"label\":null,\"tags\":[],\"priority\":0,");
}

static void faulty_tickets(void **state)
{
    static const char *const cases[][2] = {
        {JOB(",\"priority\":101"), "/priority"},
        {JOB(",\"priority\":-101"), "/priority"},
        {JOB(",\"priority\":1.5"), "/priority"},
        {JOB(",\"priority\":\"1\""), "/priority"},
        {JOB(",\"label\":1"), "/label"},
        {JOB(",\"tags\":\"a\""), "/tags"},
        {JOB(",\"tags\":[\"a\",\"b c\"]"), "/tags/1"},
        {JOB(",\"tags\":[\"\"]"), "/tags/0"},
        {JOB(",\"tags\":[7]"), "/tags/0"},
        {JOB(",\"tags\":[\"0123456789012345678901234567890123456789012345678901234567890123a\"]"),
         "/tags/0"},
        {JOB(",\"tags\":[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]"), "/tags"},
    };
    struct desk *f = *state;
    char job[1024], label[LIMIT_LABEL_CHARACTERS_MAX + 2] = "";
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        char pointer[64];
        assert_int_equal(ask(f, "POST", "/v1/jobs", cases[i][0]), 422);
        snprintf(pointer, sizeof(pointer), "{\"pointer\":\"%s\",", cases[i][1]);
        assert_says(f, pointer);
    }
    memset(label, 'x', sizeof(label) - 1);
    snprintf(job, sizeof(job), JOB(",\"label\":\"%s\""), label);
    assert_int_equal(ask(f, "POST", "/v1/jobs", job), 422);
    label[LIMIT_LABEL_CHARACTERS_MAX] = '\0';
    snprintf(job, sizeof(job), JOB(",\"label\":\"%s\""), label);
    assert_int_equal(ask(f, "POST", "/v1/jobs", job), 202);
}

static int submit_force(struct desk *f, const char *name, const char *value)
{
    const struct request_query query = {name, value};
    const struct request request = {.method = "POST",
                                    .path = "/v1/jobs",
                                    .body = JOB(""),
                                    .body_size = strlen(JOB("")),
                                    .query = &query,
                                    .query_count = 1};
    return desk_send(f, &request);
}

static void forced_jobs(void **state)
{
    struct desk *f = *state;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE], third[JOB_ID_SIZE];
    assert_int_equal(submit_force(f, "force", "true"), 202);
    desk_take_id(f, id);
    assert_int_equal(submit_force(f, "force", "false"), 200);
    assert_int_equal(submit_force(f, "force", "true"), 202);
    desk_take_id(f, other);
    assert_string_not_equal(id, other);
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB("")), 200); /* the newer one stands */
    desk_take_id(f, third);
    assert_string_equal(other, third);
    assert_int_equal(submit_force(f, "force", "yes"), 400);
    assert_int_equal(submit_force(f, "farce", "true"), 400);
}

static void cancel(void **state)
{
    struct desk *f = *state;
    char id[JOB_ID_SIZE], path[128];
    assert_int_equal(ask(f, "DELETE", "/v1/jobs/nothing", NULL), 404);
    ask(f, "POST", "/v1/jobs", JOB(""));
    desk_take_id(f, id);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(ask(f, "DELETE", path, NULL), 200);
    assert_says(f, "\"state\":\"cancelled\"");
    assert_int_equal(ask(f, "DELETE", path, NULL), 200);
    snprintf(path, sizeof(path), "/v1/jobs/%s/results", id);
    assert_int_equal(ask(f, "GET", path, NULL), 409);
    assert_says(f, "cancelled");
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB("")), 202); /* may be tried again */
    desk_take_id(f, id);
    assert_int_equal(store_jobs_fail(f->service.store, id, "it \"broke\""), STORE_OK);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(ask(f, "GET", path, NULL), 200);
    assert_says(f, "\"state\":\"failed\"");
    assert_says(f, "\"error\":\"it \\\"broke\\\"\"");
    assert_int_equal(ask(f, "DELETE", path, NULL), 409);
    snprintf(path, sizeof(path), "/v1/jobs/%s/results/energy", id);
    assert_int_equal(ask(f, "GET", path, NULL), 409);
    assert_says(f, "it \\\"broke\\\"");
}

static int submit_with(struct desk *f, const char *key, const char *type, const char *body)
{
    const struct request request = {.method = "POST",
                                    .path = "/v1/jobs",
                                    .idempotency_key = key,
                                    .content_type = type,
                                    .body = body,
                                    .body_size = strlen(body)};
    return desk_send(f, &request);
}

static void idempotency_keys(void **state)
{
    struct desk *f = *state;
    char key[LIMIT_IDEMPOTENCY_KEY_BYTES_MAX + 2] = "";
    assert_int_equal(submit_with(f, "k1", NULL, JOB("")), 202);
    assert_int_equal(submit_with(f, "k1", NULL, JOB("")), 200);
    assert_int_equal(submit_with(f, "k1", NULL, JOB(",\"seed\":2")), 422);
    assert_says(f, "key-reused");
    assert_int_equal(submit_with(f, "", NULL, JOB("")), 400);
    assert_int_equal(submit_with(f, "a b", NULL, JOB("")), 400);
    assert_int_equal(submit_with(f, "\xc3\xa4", NULL, JOB("")), 400);
    memset(key, 'k', sizeof(key) - 1);
    assert_int_equal(submit_with(f, key, NULL, JOB("")), 400);
    key[LIMIT_IDEMPOTENCY_KEY_BYTES_MAX] = '\0';
    assert_int_equal(submit_with(f, key, NULL, JOB("")), 200);
}

static void media_types(void **state)
{
    static const char *const good[] = {"application/json", "Application/JSON; charset=utf-8",
                                       "application/x-www-form-urlencoded", "application/x+json"};
    static const char *const bad[] = {"text/plain",
                                      "application/xml",
                                      "",
                                      "application/jsonp",
                                      "multipart/form-data; boundary=x",
                                      "application/+json"};
    struct desk *f = *state;
    for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++)
        assert_in_range(submit_with(f, NULL, good[i], JOB("")), 200, 202);
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        if (submit_with(f, NULL, bad[i], JOB("")) != 415)
            fail_msg("\"%s\" gave %d", bad[i], f->reply.status);
}

static void faulty_jobs(void **state)
{
    struct desk *f = *state;
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB(",\"bogus\":1,\"kT\":2,\"mobility\":\"a\"")),
                     422);
    assert_says(f, "{\"pointer\":\"/bogus\",");
    assert_says(f, "{\"pointer\":\"/kT\",");
    assert_says(f, "{\"pointer\":\"/mobility\",");
    assert_int_equal(ask(f, "POST", "/v1/jobs", ""), 400);
    assert_int_equal(ask(f, "POST", "/v1/jobs", "hello"), 400);
    assert_int_equal(ask(f, "POST", "/v1/jobs", "{\"particles\":5,}"), 400);
    assert_int_equal(ask(f, "POST", "/v1/jobs", "[]"), 422);
    assert_int_equal(ask(f, "POST", "/v1/estimate", "hello"), 400);
    assert_int_equal(ask(f, "POST", "/v1/estimate", "{}"), 422);
    assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 200);
    assert_string_equal(f->reply.body, "{\"jobs\":[],\"next\":null}\n");
}

/* Sound, but for a computer that nobody has; each names the limit it is above. */
static void costly_jobs(void **state)
{
    static const struct {
        const char *job, *limit;
    } cases[] = {
        {"{\"particles\":1000,\"length\":2000,\"time\":1e9,\"time_step\":1e-6,"
         "\"observables\":{\"energy\":{}}}",
         "LIMIT_CORE_SECONDS_MAX"},
        {"{\"particles\":10000000,\"length\":2e7,\"time\":100,\"time_step\":0.1,"
         "\"observables\":{\"msd\":{\"first\":0.1,\"last\":100,\"points\":50}}}",
         "LIMIT_RUN_BYTES_MAX"},
        {"{\"particles\":2,\"length\":20,\"time\":1,\"time_step\":0.1,"
         "\"observables\":{\"density\":{\"bins\":1000000},"
         "\"contact_density\":{\"bins\":1000000}}}",
         "LIMIT_RESULT_BYTES_MAX"},
        {"{\"particles\":2,\"length\":20,\"time\":1,\"time_step\":0.1,\"realizations\":1000000,"
         "\"observables\":{\"density\":{\"bins\":100000}}}",
         "LIMIT_DISK_BYTES_MAX"},
    };
    struct desk *f = *state;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        assert_int_equal(ask(f, "POST", "/v1/jobs", cases[i].job), 422);
        assert_says(f, cases[i].limit);
        assert_says(f, "\"estimate\":{\"memory_bytes\":");
        assert_says(f, "{\"pointer\":\"\",");
        assert_int_equal(ask(f, "POST", "/v1/estimate", cases[i].job), 200);
        assert_says(f, "\"core_seconds\":");
    }
}

/* What would hurt is refused at once, with the field or the limit. */
static void hostile_jobs(void **state)
{
#define REST ",\"length\":1e9,\"time\":1,\"time_step\":0.01,\"observables\":{\"energy\":{}}"
#define SMALL "{\"particles\":5,\"length\":10,\"diameter\":0.5,"
#define SHORT "\"time\":1,\"time_step\":0.01,"
#define ENERGY "\"observables\":{\"energy\":{}}}"
    static const struct {
        const char *job, *says;
    } cases[] = {
        {"{\"particles\":1000000000000" REST "}", "/particles"},
        {"{\"particles\":9223372036854775807" REST "}", "/particles"},
        {SMALL SHORT "\"observables\":{\"msd\":{\"points\":1000000000}}}",
         "/observables/msd/points"},
        {SMALL SHORT "\"observables\":{\"density\":{\"bins\":1000000000}}}",
         "/observables/density/bins"},
        {SMALL SHORT "\"observables\":{\"pair_distribution\":{\"bins\":1000000,\"last\":4}}}",
         "/observables/pair_distribution/bins"},
        {SMALL "\"time\":1,\"time_step\":1e-300," ENERGY, "/time"},
        {SMALL "\"time\":1,\"time_step\":1e-18," ENERGY, "/time"},
        {SMALL "\"time\":9e14,\"time_step\":1," ENERGY, "LIMIT_CORE_SECONDS_MAX"},
        {SMALL "\"time\":1e300,\"time_step\":0.01," ENERGY, "/time"},
        {SMALL SHORT "\"equilibration_time\":1e300," ENERGY, "/equilibration_time"},
        {SMALL SHORT "\"realizations\":1000000000," ENERGY, "/realizations"},
        {SMALL SHORT "\"realizations\":1000000000000000," ENERGY, "/realizations"},
        {SMALL SHORT "\"observables\":{\"trajectory\":{\"every\":1e-9}}}",
         "/observables/trajectory"},
    };
    struct desk *f = *state;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        if (ask(f, "POST", "/v1/jobs", cases[i].job) != 422)
            fail_msg("%d to %s: %s", f->reply.status, cases[i].job, f->reply.body);
        assert_says(f, cases[i].says);
    }
    /* Formulas: too long, and with too many operations. Brackets cost nothing. */
    static char job[1 << 16], formula[40000];
    static const char *const pieces[] = {"x+x+", "x*"};
    for (size_t kind = 0; kind < 2; kind++) {
        size_t length = 0;
        for (size_t i = 0; i < (kind == 0 ? 9000u : 300u); i++)
            length += (size_t)sprintf(formula + length, "%s", pieces[kind]);
        snprintf(job, sizeof(job),
                 SMALL SHORT "\"boundary\":\"walls\",\"potential\":{\"type\":\"expression\","
                             "\"energy\":\"%sx\"}," ENERGY,
                 formula);
        assert_int_equal(ask(f, "POST", "/v1/jobs", job), 422);
        assert_says(f, "/potential/energy");
    }
    assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 200);
    assert_says(f, "\"jobs\":[]");
#undef REST
#undef SMALL
#undef SHORT
#undef ENERGY
}

static void results_of_nothing(void **state)
{
    static const char *const forms[] = {"", "/energy", "/energy.csv", "/energy.svg"};
    struct desk *f = *state;
    char id[JOB_ID_SIZE], path[128];
    ask(f, "POST", "/v1/jobs", JOB(""));
    desk_take_id(f, id);
    for (size_t i = 0; i < sizeof(forms) / sizeof(forms[0]); i++) {
        snprintf(path, sizeof(path), "/v1/jobs/%s/results%s", id, forms[i]);
        assert_int_equal(ask(f, "GET", path, NULL), 409);
        assert_says(f, "queued");
        snprintf(path, sizeof(path), "/v1/jobs/nothing/results%s", forms[i]);
        assert_int_equal(ask(f, "GET", path, NULL), 404);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_route_is_documented_once),
        DESK_TEST(unknown_paths),
        DESK_TEST(wrong_methods),
        DESK_TEST(head_is_get),
        DESK_TEST(queries_where_none_belong),
        DESK_TEST(service_pages),
        DESK_TEST(submit_and_look),
        DESK_TEST(tickets),
        DESK_TEST(faulty_tickets),
        DESK_TEST(forced_jobs),
        DESK_TEST(cancel),
        DESK_TEST(idempotency_keys),
        DESK_TEST(media_types),
        DESK_TEST(faulty_jobs),
        DESK_TEST(costly_jobs),
        DESK_TEST(hostile_jobs),
        DESK_TEST(results_of_nothing),
    };
    return cmocka_run_group_tests_name("routes", tests, NULL, NULL);
}
