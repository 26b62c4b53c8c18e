/* SPDX-License-Identifier: GPL-3.0-or-later
 * Arrays of a sweep while jobs end: they show all points as they were when the archive was begun.
 */
#include "sweep_npz.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char body[] = "{\"base\":{\"particles\":5,\"length\":10,\"time\":1,\"observables\":{"
                           "\"energy\":{}}},\"axes\":{\"/seed\":[1,2]}}";

static void add(struct sweep_npz *npz, struct text *text, const struct sweep_point *point,
                double *value)
{
    struct bcd_table table = {.scalar = true, .rows = 1, .columns = 1};
    table.column[0] = (struct bcd_column){.name = "energy", .values = value};
    sweep_npz_add(npz, text, point, value ? &table : NULL);
}

/* How often the word stands there, in characters of four bytes. */
static size_t count(const struct text *text, const char *word)
{
    char wide[4 * JOB_ID_SIZE] = {0};
    size_t size = 4 * strlen(word), found = 0;
    for (size_t i = 0; word[i]; i++)
        wide[4 * i] = word[i];
    for (size_t at = 0; at + size <= text->size; at++)
        found += memcmp(text->bytes + at, wide, size) == 0;
    return found;
}

static size_t count_number(const struct text *text, double number)
{
    size_t found = 0;
    for (size_t at = 0; at + sizeof(number) <= text->size; at++)
        found += memcmp(text->bytes + at, &number, sizeof(number)) == 0;
    return found;
}

static void as_they_were(void **state)
{
    (void)state;
    struct bcd_errors errors = {0};
    struct ticket ticket = {.owner = "local"};
    struct sweep *sweep = NULL;
    struct text text = {0};
    double first = 1.25, second = 2.75;
    struct sweep_point points[2] = {
        {.point = 0, .job = "jfirst", .state = JOB_DONE, .place = (char *)"[0]"},
        {.point = 1, .job = "jsecond", .state = JOB_RUNNING, .place = (char *)"[1]"}};
    assert_int_equal(sweep_json_parse(body, strlen(body), &sweep, &ticket, &errors), BCD_OK);
    struct sweep_npz *npz = sweep_npz_create(sweep, 2);
    assert_non_null(npz);
    add(npz, &text, &points[0], &first);
    add(npz, &text, &points[1], NULL);
    sweep_npz_end_pass(npz, &text);
    points[1].state = JOB_DONE; /* it ends, or another has been tried in its place */
    memcpy(points[1].job, "jthird", sizeof("jthird"));
    while (!sweep_npz_ended(npz)) {
        add(npz, &text, &points[0], &first);
        add(npz, &text, &points[1], &second);
        sweep_npz_end_pass(npz, &text);
    }
    assert_int_equal(count(&text, "jfirst"), 1);
    assert_int_equal(count(&text, "jsecond"), 1);
    assert_int_equal(count(&text, "jthird"), 0);
    assert_int_equal(count(&text, "done"), 1);
    assert_int_equal(count(&text, "running"), 1);
    assert_int_equal(count_number(&text, first), 1);
    assert_int_equal(count_number(&text, second), 0);
    free(text_take(&text));
    sweep_npz_free(npz);
    sweep_free(sweep);
    ticket_fini(&ticket);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(as_they_were)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
