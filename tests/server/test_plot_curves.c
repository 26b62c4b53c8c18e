/* SPDX-License-Identifier: GPL-3.0-or-later
 * Several curves between one pair of axes: series of a table, curves of several tables, legends,
 * and what happens when there are too many to tell apart. */
#include "plot_curves.h"
#include "plot_figure.h"
#include "plot_svg.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 600 };

struct fixture {
    struct bcd_table table;
    double x[ROWS], value[ROWS], series[ROWS], error[ROWS];
};

/* `rows` rows in series of `each`. */
static struct bcd_table *make(struct fixture *f, size_t rows, size_t each)
{
    f->table = (struct bcd_table){.rows = rows, .columns = 4, .name = "trajectory"};
    snprintf(f->table.x_label, sizeof f->table.x_label, "time");
    const enum bcd_role roles[] = {BCD_ROLE_X, BCD_ROLE_VALUE, BCD_ROLE_SERIES, BCD_ROLE_STDERR};
    double *const values[] = {f->x, f->value, f->series, f->error};
    for (size_t c = 0; c < 4; c++) {
        f->table.column[c].role = roles[c];
        f->table.column[c].values = values[c];
    }
    snprintf(f->table.column[2].name, sizeof f->table.column[2].name, "rod");
    for (size_t i = 0; i < rows; i++) {
        f->x[i] = 1 + (double)(i % each);
        f->series[i] = (double)(i / each);
        f->value[i] = f->series[i] + 0.3 * sin((double)i);
        f->error[i] = NAN;
    }
    return &f->table;
}

static size_t count(const char *svg, const char *what)
{
    size_t n = 0;
    for (const char *p = strstr(svg, what); p; p = strstr(p + 1, what))
        n++;
    return n;
}

static void test_series(void **state)
{
    (void)state;
    static struct fixture f;
    char *svg = plot_svg_print(make(&f, 60, 20), "paths", NULL);
    assert_non_null(svg);
    assert_int_equal(count(svg, "<g class=\"curve\">"), 3);
    for (int i = 0; i < 3; i++) {
        char label[16];
        snprintf(label, sizeof label, ">rod %d<", i);
        assert_int_equal(count(svg, label), 1);
    }
    assert_int_equal(count(svg, "class=\"bars\""), 0); /* though x counts from 1 */
    assert_int_equal(count(svg, "NaN") + count(svg, "nan"), 0);
    /* Told apart without colours: no two curves share dash and marker. */
    assert_int_equal(count(svg, "stroke-dasharray=\"none\" d="), 1);
    assert_int_equal(count(svg, "stroke-dasharray=\"7 3\" d="), 1);
    assert_int_equal(count(svg, "stroke-dasharray=\"2 3\" d="), 1);
    free(svg);
}

static void test_crowd(void **state)
{
    (void)state;
    static struct fixture f;
    char *svg = plot_svg_print(make(&f, 600, 20), "paths", NULL);
    assert_non_null(svg);
    assert_int_equal(count(svg, "<path class=\"curve\""), 30);
    assert_int_equal(count(svg, ">rod "), 0);
    free(svg);
    svg = plot_svg_print(make(&f, 240, 20), "paths", NULL); /* as many as there are styles */
    assert_int_equal(count(svg, "<g class=\"curve\">"), 12);
    assert_int_equal(count(svg, ">rod "), 12);
    free(svg);
}

/* A series of one row, of NaN alone, and rows that are not there. */
static void test_awkward(void **state)
{
    (void)state;
    static struct fixture f;
    struct bcd_table *table = make(&f, 41, 20);
    for (size_t i = 20; i < 40; i++)
        f.value[i] = NAN;
    char *svg = plot_svg_print(table, "paths", NULL);
    assert_int_equal(count(svg, "<g class=\"curve\">"), 3);
    assert_int_equal(count(svg, "nan"), 0);
    free(svg);
    for (size_t i = 0; i < 41; i++)
        f.value[i] = f.series[i] = NAN;
    svg = plot_svg_print(table, "paths", NULL);
    assert_int_equal(count(svg, "no data"), 1);
    free(svg);
    table->rows = 0;
    svg = plot_svg_print(table, "paths", NULL);
    assert_int_equal(count(svg, "no data"), 1);
    free(svg);
}

/* Curves of two tables, log-log, in two panels: one legend; equal labels look alike. */
static void test_figure(void **state)
{
    (void)state;
    static struct fixture f[2];
    struct plot_curve curves[4];
    struct plot_panel panels[2] = {0};
    static const char *const labels[] = {"bcd", "strang <a&b>", "strang <a&b>", "lm"};
    for (size_t t = 0; t < 2; t++) {
        struct bcd_table *table = make(&f[t], 20, 20);
        table->log_x = table->log_y = true;
        for (size_t i = 0; i < 20; i++) {
            f[t].x[i] = pow(10, (double)i / 4);
            f[t].value[i] = pow(f[t].x[i], 0.5 + 0.5 * (double)t);
            f[t].error[i] = i < 3 ? 2 * f[t].value[i] : 0.1 * f[t].value[i]; /* bars beyond 0 */
        }
    }
    for (size_t i = 0; i < 4; i++)
        curves[i] = (struct plot_curve){.table = &f[i % 2].table, .label = labels[i]};
    for (size_t i = 0; i < 2; i++)
        panels[i] = (struct plot_panel){
            .title = "panel", .curves = curves + 2 * i, .curve_count = 2, .guides = i == 0};
    const struct plot_figure plot = {.title = "t", .rows = 1, .columns = 2, .panels = panels};
    char *svg = plot_figure_print(&plot);
    assert_non_null(svg);
    assert_int_equal(count(svg, "<g class=\"panel\">"), 2);
    assert_int_equal(count(svg, "<g class=\"curve\">"), 4);
    assert_int_equal(count(svg, "class=\"band\""), 4);
    assert_int_equal(count(svg, ">bcd<"), 1);
    assert_int_equal(count(svg, ">strang &#60;a&#38;b&#62;<"), 1);
    assert_int_equal(count(svg, "stroke-dasharray=\"7 3\" d="), 2); /* strang, in both panels */
    assert_int_equal(count(svg, "class=\"guide\"") > 0, 1);
    assert_int_equal(count(svg, "nan") + count(svg, "inf"), 0);
    free(svg);
}

/* Its marker as a piece of a path. */
static char *print_marker(size_t style)
{
    struct text text = {0};
    plot_style_add_marker(&text, style, (double[]){0, 0}, 10);
    return text_take(&text);
}

static void each_style_has_its_own_look(void **state)
{
    (void)state;
    for (size_t i = 0; i < PLOT_STYLES; i++) {
        for (size_t k = 0; k < i; k++) {
            char *marker = print_marker(i), *other = print_marker(k);
            assert_string_not_equal(plot_style_colour(i), plot_style_colour(k));
            assert_true(strcmp(marker, other) != 0 ||
                        strcmp(plot_style_dash(i), plot_style_dash(k)) != 0);
            free(marker);
            free(other);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_style_has_its_own_look),
        cmocka_unit_test(test_series),
        cmocka_unit_test(test_crowd),
        cmocka_unit_test(test_awkward),
        cmocka_unit_test(test_figure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
