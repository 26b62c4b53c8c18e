/* SPDX-License-Identifier: GPL-3.0-or-later
 * The rows of the route table say all that openapi.json and the dispatch need; query parameters
 * against rows. */
#include "route_query.h"
#include "routes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#define SAY(route, condition)                                                                      \
    do {                                                                                           \
        if (!(condition))                                                                          \
            fail_msg("%s %s: not so: %s", (route)->method, (route)->pattern, #condition);          \
    } while (0)

static bool named(const char *id)
{
    return id && id[0] >= 'a' && id[0] <= 'z' &&
           id[strspn(id, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ")] == '\0';
}

static void rows_are_complete(void **state)
{
    (void)state;
    const struct route *route;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        SAY(route, named(route->id));
        SAY(route, route->doc && route->doc[0]);
        SAY(route, route->handle);
        SAY(route, strcmp(route->method, "GET") != 0 || !route->body);
        SAY(route, !route->body == !route->example);
        SAY(route, route->answers[0].type);
        for (size_t k = 0; k < ROUTE_ANSWERS_MAX && route->answers[k].type; k++) {
            const struct route_answer *answer = &route->answers[k];
            SAY(route, answer->status >= 200 && answer->status < 400);
            SAY(route,
                !strstr(answer->type, "json") || strstr(answer->type, "ndjson") || answer->schema);
        }
    }
    assert_true(routes_at(0) && routes_at(5));
}

static void queries_are_complete(void **state)
{
    (void)state;
    const struct route *route;
    size_t found = 0;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        for (const struct query_row *row = route->query; row && row->name; row++, found++) {
            SAY(route, row->doc && row->doc[0]);
            SAY(route, (row->type == QUERY_WORD) == (row->words != NULL));
            SAY(route, row->type != QUERY_INTEGER && row->type != QUERY_NUMBER
                           ? row->min == 0 && row->max == 0
                           : row->min < row->max);
        }
    }
    assert_true(found > 3);
}

/* Every {...} of a pattern is one that routes.c knows. */
static void arguments_are_known(void **state)
{
    (void)state;
    const struct route *route;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        for (const char *at = strchr(route->pattern, '{'); at; at = strchr(at + 1, '{')) {
            const struct route_arg *arg;
            bool known = false;
            for (size_t k = 0; (arg = routes_arg(k)); k++)
                known = known || (strncmp(at + 1, arg->name, strlen(arg->name)) == 0 &&
                                  at[strlen(arg->name) + 1] == '}');
            SAY(route, known);
        }
    }
}

static void ids_are_unique(void **state)
{
    (void)state;
    const struct route *route, *other;
    for (size_t i = 0; (route = routes_at(i)); i++)
        for (size_t k = 0; k < i && (other = routes_at(k)); k++)
            SAY(route, strcmp(route->id, other->id) != 0);
}

static void problems_follow(void **state)
{
    (void)state;
    const struct route *route;
    for (size_t i = 0; (route = routes_at(i)); i++) {
        uint64_t problems = routes_problems(route);
        SAY(route, (problems & ROUTE_PROBLEM(QUERY)) && (problems & ROUTE_PROBLEM(BUSY)));
        SAY(route, !(problems & ROUTE_PROBLEM(WHO)) == (route->role == ROLE_NONE));
        SAY(route, !strstr(route->pattern, "{id}") || (problems & ROUTE_PROBLEM(NOT_FOUND)));
        SAY(route, !route->body || (problems & ROUTE_PROBLEM(NOT_JSON)));
    }
}

static const struct query_row rows[] = {
    {"word", QUERY_WORD, .words = "one three", .doc = "."},
    {"flag", QUERY_BOOLEAN, .doc = "."},
    {"count", QUERY_INTEGER, .min = -5, .max = 100, .doc = "."},
    {"share", QUERY_NUMBER, .min = 0, .max = 1, .doc = "."},
    {"tag", QUERY_TEXT, .doc = ".", .many = true},
    {0},
};

static size_t faults(const struct route *route, const char *name, const char *value)
{
    const struct request_query query[] = {{name, value}};
    const struct request request = {.query = query, .query_count = 1};
    struct bcd_errors errors = {0};
    route_query_check(route, &request, &errors);
    if (errors.count == 1)
        assert_string_equal(errors.items[0].field, name);
    return errors.count;
}

static void values_must_fit(void **state)
{
    static const struct route route = {.query = rows};
    static const char *const good[][2] = {
        {"word", "one"},  {"word", "three"}, {"flag", "true"}, {"flag", "false"}, {"count", "0"},
        {"count", "100"}, {"count", "-5"},   {"share", "0.5"}, {"share", "1e-3"}, {"tag", ""}};
    static const char *const bad[][2] = {{"word", "two"},
                                         {"word", ""},
                                         {"word", "one three"},
                                         {"word", "thre"},
                                         {"word", "One"},
                                         {"flag", "1"},
                                         {"flag", ""},
                                         {"flag", "true false"},
                                         {"count", "101"},
                                         {"count", "-6"},
                                         {"count", "1.0"},
                                         {"count", ""},
                                         {"count", "+1"},
                                         {"count", " 1"},
                                         {"count", "0x1"},
                                         {"count", "1e1"},
                                         {"share", "1.01"},
                                         {"share", "nan"},
                                         {"share", "inf"},
                                         {"share", ""},
                                         {"share", "0x1"},
                                         {"share", " 0.5"},
                                         {"share", "0.5x"},
                                         {"other", "1"},
                                         {"count", "99999999999999999999"},
                                         {"share", "-1e-300"}};
    (void)state;
    for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++)
        if (faults(&route, good[i][0], good[i][1]) != 0)
            fail_msg("%s=%s is refused", good[i][0], good[i][1]);
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        if (faults(&route, bad[i][0], bad[i][1]) != 1)
            fail_msg("%s=%s is accepted", bad[i][0], bad[i][1]);
}

static void unknown_and_repeated(void **state)
{
    static const struct route closed = {.query = rows}, open = {.query = rows, .filters = true};
    static const struct route none = {.query = NULL};
    const struct request_query query[] = {
        {"flag", "true"}, {"tag", "a"}, {"tag", "b"}, {"flag", "true"}, {"diameter>", "1"}};
    const struct request request = {.query = query, .query_count = 5};
    const struct call call = {.request = &request};
    struct bcd_errors errors = {0}, more = {0};
    (void)state;
    route_query_check(&open, &request, &errors);
    assert_int_equal(errors.count, 1);
    assert_string_equal(errors.items[0].text, "is given twice");
    route_query_check(&closed, &request, &more);
    assert_int_equal(more.count, 2);
    assert_string_equal(more.items[1].field, "diameter>");
    assert_non_null(strstr(more.items[1].text, "known are word, flag"));
    assert_int_equal(faults(&none, "x", ""), 1);
    assert_string_equal(call_query(&call, "tag"), "a");
    assert_null(call_query(&call, "word"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_are_complete),    cmocka_unit_test(queries_are_complete),
        cmocka_unit_test(ids_are_unique),       cmocka_unit_test(arguments_are_known),
        cmocka_unit_test(problems_follow),      cmocka_unit_test(values_must_fit),
        cmocka_unit_test(unknown_and_repeated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
