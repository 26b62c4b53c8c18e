/* SPDX-License-Identifier: GPL-3.0-or-later
 * experiment.c - see experiment.h. */
#include "experiment.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct bcd_scene *experiment_scene(const char *format, ...)
{
    char text[4096];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    assert_true(length > 0 && (size_t)length < sizeof text);
    for (char *c = text; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    if (scene_json_parse(text, (size_t)length, &scene, &errors) != BCD_OK) {
        for (size_t i = 0; i < errors.count; i++)
            print_error("%s: %s\n", errors.items[i].field, errors.items[i].text);
        fail_msg("the job was refused: %s", text);
    }
    return scene;
}

struct experiment experiment_run(struct bcd_scene *scene, int64_t slice)
{
    struct experiment e = {.scene = scene};
    assert_int_equal(bcd_tally_create(&e.tally, scene), BCD_OK);
    assert_int_equal(bcd_theory_create(&e.theory, scene, BCD_THEORY_RING, NULL, NULL), BCD_OK);
    for (int64_t chunk = 0; chunk < bcd_scene_chunks(scene); chunk++) {
        struct bcd_run *run = NULL;
        assert_int_equal(bcd_run_create(&run, scene, chunk, NULL), BCD_OK);
        int64_t total = bcd_run_ticks_total(run);
        while (bcd_run_ticks_done(run) < total)
            assert_int_equal(bcd_run_advance(run, slice ? slice : total, NULL), BCD_OK);
        assert_int_equal(bcd_run_ticks_done(run), total);
        bcd_tally_merge(e.tally, bcd_run_tally(run));
        bcd_run_free(run);
    }
    return e;
}

void experiment_end(struct experiment *e)
{
    bcd_theory_free(e->theory);
    bcd_tally_free(e->tally);
    bcd_scene_free(e->scene);
}

struct bcd_table *experiment_table(const struct experiment *e, const char *observable)
{
    for (size_t i = 0; bcd_scene_part(e->scene, BCD_SLOT_OBSERVABLE, i); i++) {
        if (strcmp(bcd_scene_part(e->scene, BCD_SLOT_OBSERVABLE, i)->type, observable) != 0)
            continue;
        struct bcd_table *table = NULL;
        assert_int_equal(bcd_tally_table(e->tally, e->scene, e->theory, i, &table), BCD_OK);
        return table;
    }
    fail_msg("no observable %s", observable);
    return NULL;
}

double experiment_fact(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_fact *fact;
    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)) != NULL; i++)
        if (strcmp(fact->name, name) == 0)
            return fact->kind == BCD_FACT_INTEGER ? (double)fact->integer : fact->number;
    fail_msg("no fact %s", name);
    return NAN;
}

const double *column_of(const struct bcd_table *table, enum bcd_role role)
{
    const struct bcd_column *column = bcd_table_column(table, role);
    assert_non_null(column);
    assert_non_null(column->values);
    return column->values;
}

void assert_within(double value, double expected, double error, double sigmas, double slack)
{
    if (fabs(value - expected) <= sigmas * error + slack)
        return;
    fail_msg("%.10g is %.2f standard errors (%.3g) and slack %.3g off %.10g", value,
             (value - expected) / error, error, slack, expected);
}
