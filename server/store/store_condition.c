/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_condition.c - see store_condition.h. */
#include "store_condition.h"

#include <math.h>
#include <string.h>

bool find_is_number(const char *text)
{
    enum scalar_type type = scalar_parse(text).type;

    return type == SCALAR_INTEGER || type == SCALAR_REAL;
}

static struct scalar number_or_none(const char *text)
{
    struct scalar value = text ? scalar_parse(text) : (struct scalar){.type = SCALAR_NONE};

    return value.type == SCALAR_TEXT ? (struct scalar){.type = SCALAR_NONE} : value;
}

struct test test_make(const struct find_condition *condition)
{
    struct test test = {.relation = condition->relation};

    if (condition->relation == FIND_WITHIN) {
        test.least = number_or_none(condition->least);
        test.most = number_or_none(condition->most);
    } else {
        test.text = scalar_text(condition->value, strlen(condition->value));
        test.least = test.most = number_or_none(condition->value);
    }
    return test;
}

/* A real may be off by as much as a double written in another way. */
static double slack(const struct scalar *bound)
{
    return 1e-15 * fabs(bound->type == SCALAR_INTEGER ? (double)bound->integer : bound->real);
}

/* As test_place, for a number. No bounds at all: nothing is accepted. */
static int place_number(const struct test *test, const struct scalar *value)
{
    struct scalar high = *value, low = *value;

    if (test->least.type != SCALAR_NONE) {
        if (value->type == SCALAR_REAL)
            high.real += slack(&test->least);
        if (scalar_compare(&high, &test->least, false) < 0)
            return -1;
    }
    if (test->most.type != SCALAR_NONE) {
        if (value->type == SCALAR_REAL)
            low.real -= slack(&test->most);
        if (scalar_compare(&low, &test->most, false) > 0)
            return 1;
    }
    return test->least.type != SCALAR_NONE || test->most.type != SCALAR_NONE ? 0 : -1;
}

int test_place(const struct test *test, const struct scalar *value)
{
    if (value->type != SCALAR_TEXT)
        return place_number(test, value);
    return test->relation == FIND_WITHIN ? -1 : scalar_compare(value, &test->text, false);
}

bool test_accepts(const struct test *test, const struct scalar *value)
{
    if (value->type == SCALAR_NONE)
        return test->relation == FIND_OTHER;
    return (test_place(test, value) == 0) == (test->relation != FIND_OTHER);
}

bool test_may_accept(const struct test *test, const struct scalar *least, const struct scalar *most)
{
    const struct test from = {.least = test->least}, to = {.most = test->most};

    if (test->relation == FIND_OTHER || least->type == SCALAR_NONE || most->type == SCALAR_NONE)
        return true;
    return (from.least.type == SCALAR_NONE || place_number(&from, most) == 0) &&
           (to.most.type == SCALAR_NONE || place_number(&to, least) == 0);
}
