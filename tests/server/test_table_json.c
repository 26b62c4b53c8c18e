/* SPDX-License-Identifier: GPL-3.0-or-later
 * table_json.c and table_csv.c on tables made by hand: exact bytes. */
#include "table_csv.h"
#include "table_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void set_column(struct bcd_table *table, const char *name, double *values)
{
    struct bcd_column *column = &table->column[table->columns++];
    *column = (struct bcd_column){.values = values};
    snprintf(column->name, sizeof(column->name), "%s", name);
}

static void check(char *printed, const char *expected)
{
    assert_non_null(printed);
    assert_string_equal(printed, expected);
    free(printed);
}

static void lists(void **state)
{
    (void)state;
    double lag[] = {0.1, 1e-300, 1e5}, value[] = {1.0 / 3, NAN, -0.0}, samples[] = {3, 1e15, 0};
    struct bcd_table table = {.name = "msd", .rows = 3};
    set_column(&table, "lag", lag);
    set_column(&table, "msd", value);
    set_column(&table, "samples", samples);
    check(table_json_print(&table), "{\"lag\":[0.1,1e-300,100000],"
                                    "\"msd\":[0.3333333333333333,null,-0.0],"
                                    "\"samples\":[3,1e+15,0]}\n");
    check(table_csv_print(&table), "lag,msd,samples\n"
                                   "0.1,0.3333333333333333,3\n"
                                   "1e-300,,1e+15\n"
                                   "100000,-0.0,0\n");
}

static void scalars_and_notes(void **state)
{
    (void)state;
    double current[] = {INFINITY}, stderrs[] = {2.5};
    struct bcd_table table = {.name = "current", .rows = 1, .scalar = true, .notes = 3};
    set_column(&table, "current", current);
    set_column(&table, "stderr", stderrs);
    table.note[0] = (struct bcd_note){.name = "stderr_from", .text = "blocks \"of\"\ttime"};
    table.note[1] = (struct bcd_note){.name = "blocks", .number = 8};
    table.note[2] = (struct bcd_note){.name = "missing", .number = NAN};
    check(table_json_print(&table),
          "{\"current\":null,\"stderr\":2.5,\"stderr_from\":\"blocks \\\"of\\\"\\u0009time\","
          "\"blocks\":8,\"missing\":null}\n");
    check(table_csv_print(&table), "current,stderr\n,2.5\n");
}

static void absent_columns(void **state)
{
    (void)state;
    double x[] = {1};
    struct bcd_table table = {.name = "density", .rows = 1};
    set_column(&table, "x", x);
    set_column(&table, "theory", NULL);
    set_column(&table, "time_step_error", NULL);
    snprintf(table.column[2].reason, sizeof(table.column[2].reason), "one step only");
    check(table_json_print(&table), "{\"x\":[1],\"theory\":null,\"time_step_error\":null,"
                                    "\"time_step_error_reason\":\"one step only\"}\n");
    check(table_csv_print(&table), "x\n1\n");
}

static void empty_tables(void **state)
{
    (void)state;
    double none[1];
    struct bcd_table lists_of_none = {.name = "a"}, scalars_of_none = {.name = "b", .scalar = true};
    struct bcd_table nothing = {.name = "c"};
    set_column(&lists_of_none, "x", none);
    set_column(&scalars_of_none, "x", none);
    check(table_json_print(&lists_of_none), "{\"x\":[]}\n");
    check(table_json_print(&scalars_of_none), "{\"x\":null}\n");
    check(table_json_print(&nothing), "{}\n");
    check(table_csv_print(&lists_of_none), "x\n");
}

static void all_tables(void **state)
{
    (void)state;
    double one[] = {1}, two[] = {2};
    struct bcd_table a = {.name = "energy", .rows = 1, .scalar = true};
    struct bcd_table b = {.name = "density", .rows = 1};
    struct bcd_table *const both[] = {&a, &b};
    set_column(&a, "energy", one);
    set_column(&b, "density", two);
    check(table_json_print_all(both, 2), "{\"energy\":{\"energy\":1},"
                                         "\"density\":{\"density\":[2]}}\n");
    check(table_json_print_all(both, 0), "{}\n");
}

/* Names come from the engine; should one ever hold such characters, the files stay well-formed. */
static void names_are_quoted(void **state)
{
    (void)state;
    double x[] = {1};
    struct bcd_table table = {.name = "a", .rows = 1};
    set_column(&table, "x,\"y\"", x);
    check(table_json_print(&table), "{\"x,\\\"y\\\"\":[1]}\n");
    check(table_csv_print(&table), "\"x,\"\"y\"\"\"\n1\n");
}

/* Every double comes back as it went out. */
static void numbers_round_trip(void **state)
{
    (void)state;
    enum { ROWS = 20000 };
    double *values = malloc(ROWS * sizeof(*values));
    uint64_t bits = 88172645463325252u; /* xorshift64 */
    for (int i = 0; i < ROWS; i++) {
        do {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            memcpy(&values[i], &bits, sizeof(bits));
        } while (!isfinite(values[i]));
    }
    struct bcd_table table = {.name = "a", .rows = ROWS};
    set_column(&table, "x", values);
    char *printed = table_csv_print(&table);
    char *rest = printed + 2;
    for (int i = 0; i < ROWS; i++) {
        double read = strtod(rest, &rest);
        assert_memory_equal(&read, &values[i], sizeof(read));
        assert_int_equal(*rest++, '\n');
    }
    assert_int_equal(*rest, '\0');
    free(printed);
    free(values);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists),
        cmocka_unit_test(scalars_and_notes),
        cmocka_unit_test(absent_columns),
        cmocka_unit_test(empty_tables),
        cmocka_unit_test(all_tables),
        cmocka_unit_test(names_are_quoted),
        cmocka_unit_test(numbers_round_trip),
    };
    return cmocka_run_group_tests_name("table_json", tests, NULL, NULL);
}
