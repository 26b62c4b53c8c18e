/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pictures of several panels: every panel where its row and column say, marks inside their own
 * frame, shared axis titles once, words escaped. How it looks was judged by eye. */
#include "plot_figure.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 20, TABLES = 6 };

struct fixture {
    struct bcd_table table[TABLES];
    double values[TABLES][4][ROWS];
};

static int set_up(void **state)
{
    static const enum bcd_role roles[] = {BCD_ROLE_X, BCD_ROLE_VALUE, BCD_ROLE_STDERR,
                                          BCD_ROLE_THEORY};
    struct fixture *f = calloc(1, sizeof *f);
    if (!f)
        return -1;
    for (int t = 0; t < TABLES; t++) {
        struct bcd_table *table = &f->table[t];
        table->rows = ROWS;
        table->columns = 4;
        snprintf(table->name, sizeof table->name, "density");
        snprintf(table->x_label, sizeof table->x_label, "position");
        snprintf(table->y_label, sizeof table->y_label, t < 3 ? "upper" : "lower");
        for (int c = 0; c < 4; c++) {
            table->column[c].role = roles[c];
            table->column[c].values = f->values[t][c];
        }
        for (int i = 0; i < ROWS; i++) {
            f->values[t][0][i] = (i + 0.5) / ROWS;
            f->values[t][1][i] = (t + 1) * (1 + sin(i));
            f->values[t][2][i] = 0.1;
            f->values[t][3][i] = (t + 1) * (1 + sin(i + 0.1));
        }
    }
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    free(*state);
    return 0;
}

static size_t count(const char *svg, const char *what)
{
    size_t n = 0;
    for (const char *p = strstr(svg, what); p; p = strstr(p + 1, what))
        n++;
    return n;
}

/* Left, bottom, right, top of a path's or circle's coordinates. */
struct box {
    double left, right, top, bottom;
};

static void include(struct box *box, double x, double y)
{
    box->left = fmin(box->left, x);
    box->right = fmax(box->right, x);
    box->top = fmin(box->top, y);
    box->bottom = fmax(box->bottom, y);
}

/* Box of the first path of a class from `from` on. */
static struct box path_box(const char *from, const char *class)
{
    char start[64];
    struct box box = {1e9, -1e9, 1e9, -1e9};
    snprintf(start, sizeof start, "<path class=\"%s\"", class);
    const char *d = strstr(from, start);
    assert_non_null(d);
    d = strstr(d, " d=\"") + 4;
    while (*d != '"') {
        char *end;
        double x = strtod(d + 1, &end);
        double y = strtod(end, &end);
        include(&box, x, y);
        d = end;
    }
    return box;
}

static void assert_inside(struct box inner, struct box outer, double air)
{
    assert_true(inner.left >= outer.left - air && inner.right <= outer.right + air);
    assert_true(inner.top >= outer.top - 0.01 && inner.bottom <= outer.bottom + 0.01);
}

/* Elements open and close in turn; text holds no bare < or &. */
static void assert_well_formed(const char *svg)
{
    int depth = 0;
    for (const char *p = strchr(svg, '<'); p; p = strchr(p + 1, '<')) {
        const char *end = strchr(p, '>');
        assert_non_null(end);
        if (p[1] == '/')
            depth--;
        else if (end[-1] != '/')
            depth++;
        assert_true(depth > 0 || !strchr(end, '<'));
    }
    assert_int_equal(depth, 0);
    for (const char *p = strchr(svg, '&'); p; p = strchr(p + 1, '&'))
        assert_int_equal(p[1], '#');
}

static void test_grid(void **state)
{
    struct fixture *f = *state;
    struct plot_panel panels[TABLES] = {{0}};
    char titles[TABLES][16];
    for (int t = 0; t < TABLES; t++) {
        snprintf(titles[t], sizeof titles[t], "panel %d", t);
        panels[t] = (struct plot_panel){.table = &f->table[t],
                                        .title = titles[t],
                                        .remark = t == 4 ? "remark" : NULL};
    }
    struct plot_figure figure = {"title", "subtitle", 2, 3, panels};
    char *svg = plot_figure_print(&figure);
    assert_non_null(svg);
    assert_well_formed(svg);
    assert_null(strstr(svg, "nan"));
    assert_int_equal(count(svg, "<g class=\"panel\">"), TABLES);
    assert_int_equal(count(svg, "class=\"dot\""), TABLES * ROWS);
    assert_int_equal(count(svg, ">upper</text>"), 1);
    assert_int_equal(count(svg, ">lower</text>"), 1);
    assert_int_equal(count(svg, ">position</text>"), 3);
    assert_int_equal(count(svg, ">remark</text>"), 1);
    assert_int_equal(count(svg, ">exact theory</text>"), 1);
    struct box frames[TABLES];
    const char *at = svg;
    for (int t = 0; t < TABLES; t++) {
        char title[32];
        at = strstr(at, "<g class=\"panel\">") + 1;
        frames[t] = path_box(at, "frame");
        assert_inside(path_box(at, "theory"), frames[t], 0.01);
        assert_inside(path_box(at, "band"), frames[t], 3); /* feet of the whiskers */
        snprintf(title, sizeof title, ">panel %d</text>", t);
        const char *next = strstr(at, "<g class=\"panel\">");
        const char *found = strstr(at, title);
        assert_true(found && (!next || found < next));
    }
    for (int t = 0; t < TABLES; t++) {
        if (t % 3)
            assert_true(frames[t].left > frames[t - 1].right);
        if (t >= 3)
            assert_true(frames[t].top > frames[t - 3].bottom);
    }
    free(svg);
}

/* A place without a table stays empty; one without data says so. */
static void test_gaps(void **state)
{
    struct fixture *f = *state;
    struct plot_panel panels[4] = {{.table = &f->table[0]}, {0}, {.table = &f->table[1]}, {0}};
    struct plot_figure figure = {"title", NULL, 2, 2, panels};
    for (int i = 0; i < ROWS; i++)
        f->values[1][1][i] = f->values[1][3][i] = NAN;
    char *svg = plot_figure_print(&figure);
    assert_non_null(svg);
    assert_well_formed(svg);
    assert_int_equal(count(svg, "<g class=\"panel\">"), 2);
    assert_int_equal(count(svg, ">no data</text>"), 1);
    assert_int_equal(count(svg, "class=\"dot\""), ROWS);
    free(svg);
    f->table[0].column[3].values = NULL;
    f->table[1].column[3].values = NULL;
    svg = plot_figure_print(&figure);
    assert_null(strstr(svg, "exact theory"));
    free(svg);
}

/* Whatever is nowhere negative stands on 0, even when an error bar reaches below. */
static void test_zero_is_the_foot(void **state)
{
    struct fixture *f = *state;
    struct plot_panel panel = {.table = &f->table[0]};
    struct plot_figure figure = {"title", NULL, 1, 1, &panel};
    for (int i = 0; i < ROWS; i++)
        f->values[0][1][i] = f->values[0][3][i] = i; /* 0 -+ .1 first */
    char *svg = plot_figure_print(&figure);
    struct box frame = path_box(svg, "frame"), theory = path_box(svg, "theory");
    assert_true(fabs(theory.bottom - frame.bottom) < 0.01);
    free(svg);
    f->values[0][1][3] = -5; /* really negative: shown */
    svg = plot_figure_print(&figure);
    frame = path_box(svg, "frame");
    theory = path_box(svg, "theory");
    assert_true(theory.bottom < frame.bottom - 10);
    free(svg);
}

static void test_words(void **state)
{
    struct fixture *f = *state;
    char title[3000];
    memset(title, 'W', sizeof title);
    memcpy(title, "</title><script>", 16);
    title[sizeof title - 1] = '\0';
    struct plot_panel panel = {.table = &f->table[0],
                               .title = "a<b & c",
                               .remark = "\"r\" > \xFF"};
    struct plot_figure figure = {title, "<i>", 1, 1, &panel};
    snprintf(f->table[0].y_label, sizeof f->table[0].y_label, "</g>");
    char *svg = plot_figure_print(&figure);
    assert_non_null(svg);
    assert_well_formed(svg);
    assert_null(strstr(svg, "<script"));
    assert_non_null(strstr(svg, ">a&#60;b &#38; c</text>"));
    free(svg);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_grid, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_gaps, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_zero_is_the_foot, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_words, set_up, tear_down),
    };
    return cmocka_run_group_tests_name("plot_figure", tests, NULL, NULL);
}
