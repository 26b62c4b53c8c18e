/* SPDX-License-Identifier: GPL-3.0-or-later
 * JSON in lines: nothing but white space changes. */
#include "json_lines.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

static void becomes(const char *json, const char *lines)
{
    char *text = json_lines_take(strdup(json));
    assert_string_equal(text, lines);
    free(text);
}

#define TEN "\"0123456789\""
#define LONG TEN "," TEN "," TEN "," TEN "," TEN "," TEN "," TEN "," TEN "," TEN "," TEN

static void short_things_stay_on_a_line(void **state)
{
    (void)state;
    becomes("1", "1\n");
    becomes("{}", "{}\n");
    becomes("{\"a\":[1,{\"b\":null}],\"c\":\"d\"}", "{\"a\": [1, {\"b\": null}], \"c\": \"d\"}\n");
}

static void strings_are_left_alone(void **state)
{
    (void)state;
    becomes("[\"a,b:c{[\",\"\\\"}\\\\\"]", "[\"a,b:c{[\", \"\\\"}\\\\\"]\n");
}

static void long_things_are_broken(void **state)
{
    (void)state;
    char *text =
        json_lines_take(strdup("{\"a\":[" LONG "],\"b\":{\"c\":[" LONG "]},\"d\":[\"x\"]}"));
    assert_non_null(strstr(text, "{\n  \"a\": [\n    " TEN ",\n"));
    assert_non_null(strstr(text, "\n  \"b\": {\n    \"c\": [\n      " TEN));
    assert_non_null(strstr(text, TEN "\n    ]\n  },\n"));
    assert_non_null(strstr(text, ",\n  \"d\": [\"x\"]\n}\n"));
    free(text);
}

static void nothing_gives_nothing(void **state)
{
    (void)state;
    assert_null(json_lines_take(NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(short_things_stay_on_a_line), cmocka_unit_test(strings_are_left_alone),
        cmocka_unit_test(long_things_are_broken), cmocka_unit_test(nothing_gives_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
