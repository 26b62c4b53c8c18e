/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_condition.h - whether a value meets a condition of store_find.h. For store*.c only. */
#ifndef STORE_CONDITION_H
#define STORE_CONDITION_H

#include "store_find.h"
#include "store_scalar.h"

/* A condition made ready. Borrows its text. */
struct test {
    enum find_relation relation;
    struct scalar text;        /* the value as it was written */
    struct scalar least, most; /* bounds of numbers; SCALAR_NONE = open, or no number at all */
};
struct test test_make(const struct find_condition *condition);

bool test_accepts(const struct test *test, const struct scalar *value);

/* Whether a column between these ends (SCALAR_NONE: not known) can have a value that is
 * accepted. */
bool test_may_accept(const struct test *test, const struct scalar *least,
                     const struct scalar *most);

/* Where a value stands: < 0 below what is accepted, 0 accepted, > 0 above. For FIND_EQUAL and
 * FIND_WITHIN; numbers among numbers, texts among texts. */
int test_place(const struct test *test, const struct scalar *value);

#endif
