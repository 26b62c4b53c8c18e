/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_request_json.c - what the command line adds to a user's file, and how answers are read. */
#include "answer_json.h"
#include "request_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void assert_submit(const char *text, const struct request_ticket *ticket,
                          const char *expected)
{
    char *body = request_json_submit(text, strlen(text), ticket);
    assert_string_equal(body, expected);
    free(body);
}

static void a_ticket_is_set_and_replaces(void **state)
{
    static const char *const tags[] = {"a", "b"};
    const int64_t priority = -3;
    const struct request_ticket all = {
        .label = "x \"y\"", .tags = tags, .tags_count = 2, .priority = &priority};
    (void)state;
    assert_submit("{\"time\":1,\"label\":\"old\"}", &all,
                  "{\"time\":1,\"label\":\"x \\\"y\\\"\",\"priority\":-3,\"tags\":[\"a\",\"b\"]}");
    assert_submit("{\"a\":[0.1,-2.5e-7,3,\"0.1\\\\\",1e22],\"b\":{}}",
                  &(struct request_ticket){.label = "0.2"},
                  "{\"a\":[0.1,-2.5e-07,3,\"0.1\\\\\",1e+22],\"b\":{},\"label\":\"0.2\"}");
    assert_submit(" {\"time\":1} \n", &(struct request_ticket){0}, " {\"time\":1} \n");
}

/* The server has better words for it, with line and column. */
static void what_cannot_be_read_goes_as_it_is(void **state)
{
    static const char *const texts[] = {"{\"a\":1,,}",
                                        "[1]",
                                        "",
                                        "{\"a\":1e400}",
                                        "{\"a\":1e-400}",
                                        "{\"a\":1,\"a\":2}",
                                        "{\"a\":99999999999999999999}"};
    const struct request_ticket ticket = {.label = "x"};
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        assert_submit(texts[i], &ticket, texts[i]);
}

static void assert_axis(const char *axis, bool logarithmic, const char *expected)
{
    const struct request_sweep sweep = {
        .job = "{ \"time\":1.0 }", .axes = &axis, .axes_count = 1, .logarithmic = logarithmic};
    char reason[256] = "", whole[512];
    char *body = request_json_sweep(&sweep, reason, sizeof reason);
    if (!expected) {
        assert_null(body);
        assert_true(strlen(reason) > 10);
        return;
    }
    snprintf(whole, sizeof whole, "{\"base\":{ \"time\":1.0 },\"axes\":{%s}}", expected);
    assert_string_equal(body, whole);
    free(body);
}

static void axes_are_lists_ranges_and_seeds(void **state)
{
    (void)state;
    assert_axis("/diameter=0.5,1,-2e-3", false, "\"/diameter\":[0.5,1,-0.002]");
    assert_axis("/seed=1..10", false, "\"/seed\":{\"first\":1,\"count\":10}");
    assert_axis("/seed=7..7", true, "\"/seed\":{\"first\":7,\"count\":1}");
    assert_axis("/a/b=0..6:7", false,
                "\"/a/b\":{\"from\":0,\"to\":6,\"points\":7,\"scale\":\"linear\"}");
    assert_axis("/a=-1.5..2.5:3", false,
                "\"/a\":{\"from\":-1.5,\"to\":2.5,\"points\":3,\"scale\":\"linear\"}");
    assert_axis("/a=1..100:3:log", false,
                "\"/a\":{\"from\":1,\"to\":100,\"points\":3,\"scale\":\"log\"}");
    assert_axis("/a=1..100:3", true,
                "\"/a\":{\"from\":1,\"to\":100,\"points\":3,\"scale\":\"log\"}");
    assert_axis("/method=bcd,strang", false, "\"/method\":[\"bcd\",\"strang\"]");
    assert_axis("/time_step=auto,0.5", false, "\"/time_step\":[\"auto\",0.5]");
    assert_axis("/potential=null,{\"type\":\"cosine\",\"amplitude\":6}", false,
                "\"/potential\":[null,{\"type\":\"cosine\",\"amplitude\":6}]");
    assert_axis("/label=\"a,b\"", false, "\"/label\":[\"a,b\"]");
}

static void axes_that_are_none_are_refused(void **state)
{
    static const char *const wrong[] = {"diameter=1",    "/diameter", "/a=",      "/a=1,,2",
                                        "/a=0.5..2",     "/a=10..1",  "/a=1..2:", "/a=1..2:x",
                                        "/a=1..2:3:lin", "/a=1..2:0", "/a=1..x"};
    static const char *const twice[] = {"/a=1", "/a=2"};
    const struct request_sweep sweep = {.job = "{}", .axes = twice, .axes_count = 2};
    const struct request_sweep no_job = {.job = "{,", .axes = twice, .axes_count = 1};
    char reason[256];
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_axis(wrong[i], false, NULL);
    assert_null(request_json_sweep(&sweep, reason, sizeof reason));
    assert_string_equal(reason, "there are two axes /a");
    assert_null(request_json_sweep(&no_job, reason, sizeof reason));
    assert_int_equal(strncmp(reason, "the job is not JSON: line 1", 27), 0);
}

static void a_sweep_has_zips_and_a_ticket(void **state)
{
    static const char *const axes[] = {"/a=1,2", "/b=3,4"}, *const zips[] = {"/a,/b"};
    const struct request_ticket ticket = {.label = "x"};
    struct request_sweep sweep = {.job = "{}",
                                  .axes = axes,
                                  .axes_count = 2,
                                  .zips = zips,
                                  .zips_count = 1,
                                  .ticket = &ticket};
    char reason[256];
    (void)state;
    char *body = request_json_sweep(&sweep, reason, sizeof reason);
    assert_string_equal(body, "{\"base\":{},\"axes\":{\"/a\":[1,2],\"/b\":[3,4]},"
                              "\"zip\":[[\"/a\",\"/b\"]],\"label\":\"x\"}");
    free(body);
    sweep = (struct request_sweep){.axes = axes, .axes_count = 1};
    body = request_json_sweep(&sweep, reason, sizeof reason);
    assert_string_equal(body, "{\"axes\":{\"/a\":[1,2]}}");
    free(body);
}

/* ------------------------------------------------------------------- answers */

static void add_leaf(void *context, const char *path, const struct answer *value)
{
    text_add(context, "%s=", path);
    answer_json_add(context, value);
    text_add(context, ";");
}

static void answers_are_read_by_paths(void **state)
{
    static const char text[] =
        "{\"jobs\":[{\"id\":\"j1\",\"n\":0.1,\"ok\":true}],\"a\":{\"b\":{\"c\":7}},"
        "\"none\":null,\"empty\":[],\"list\":[1,2]}";
    struct answer *answer = answer_json_load(text, strlen(text));
    struct text leaves = {0};
    (void)state;
    assert_non_null(answer);
    assert_string_equal(answer_json_text(answer, "jobs.0.id"), "j1");
    assert_null(answer_json_text(answer, "jobs.1.id"));
    assert_null(answer_json_text(answer, "jobs.0.n"));
    assert_true(answer_json_number(answer, "a.b.c", -1) == 7);
    assert_true(answer_json_number(answer, "a.x.c", -1) == -1);
    assert_true(answer_json_true(answer, "jobs.0.ok"));
    assert_int_equal(answer_json_count(answer_json_at(answer, "jobs")), 1);
    answer_json_leaves(answer, &leaves, add_leaf);
    char *all = text_take(&leaves);
    assert_string_equal(all, "jobs=[{\"id\":\"j1\",\"n\":0.1,\"ok\":true}];"
                             "a.b.c=7;list=[1,2];");
    free(all);
    answer_json_free(answer);
}

/* Nothing that a server says may end the program. */
static void answers_may_be_anything(void **state)
{
    struct text deep = {0};
    (void)state;
    assert_null(answer_json_load("{", 1));
    assert_null(answer_json_load("", 0));
    assert_null(answer_json_text(NULL, "a"));
    assert_int_equal(answer_json_count(NULL), 0);
    for (int i = 0; i < 200; i++)
        text_add(&deep, "{\"a\":");
    text_add(&deep, "1");
    for (int i = 0; i < 200; i++)
        text_add(&deep, "}");
    char *text = text_take(&deep);
    struct answer *answer = answer_json_load(text, strlen(text));
    assert_non_null(answer);
    answer_json_leaves(answer, &deep, add_leaf);
    free(text_take(&deep));
    answer_json_free(answer);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ticket_is_set_and_replaces),
        cmocka_unit_test(what_cannot_be_read_goes_as_it_is),
        cmocka_unit_test(axes_are_lists_ranges_and_seeds),
        cmocka_unit_test(axes_that_are_none_are_refused),
        cmocka_unit_test(a_sweep_has_zips_and_a_ticket),
        cmocka_unit_test(answers_are_read_by_paths),
        cmocka_unit_test(answers_may_be_anything),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
