/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pictures: well-formed XML whatever the table holds, curves inside the frame, nothing lost by
 * thinning out, words escaped. How it looks was judged by eye. */
#include "plot_axis.h"
#include "plot_points.h"
#include "plot_svg.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_MAX = 100000 };

struct fixture {
    struct bcd_table table;
    double values[BCD_COLUMNS_MAX][ROWS_MAX];
};

static int set_up(void **state)
{
    *state = calloc(1, sizeof(struct fixture));
    return *state ? 0 : -1;
}

static int tear_down(void **state)
{
    free(*state);
    return 0;
}

static double *add_column(struct fixture *f, const char *name, enum bcd_role role)
{
    struct bcd_column *column = &f->table.column[f->table.columns];
    snprintf(column->name, sizeof column->name, "%s", name);
    column->role = role;
    return column->values = f->values[f->table.columns++];
}

static struct fixture *begin(void **state, const char *name, size_t rows)
{
    struct fixture *f = *state;
    f->table = (struct bcd_table){.rows = rows};
    snprintf(f->table.name, sizeof f->table.name, "%s", name);
    snprintf(f->table.x_label, sizeof f->table.x_label, "x (length)");
    snprintf(f->table.y_label, sizeof f->table.y_label, "y (1/length)");
    return f;
}

/* ---------------------------------------------------- a small reader of XML */

/* Checks that elements nest, attributes are quoted, and & and < appear only where they may. Returns
 * the number of elements. */
static size_t assert_well_formed(const char *xml)
{
    char open[32][24];
    size_t depth = 0, elements = 0;
    for (const char *c = xml; *c;) {
        if (*c != '<') {
            assert_true(depth > 0 || isspace((unsigned char)*c));
            assert_true(*c != '&' || strncmp(c, "&#", 2) == 0);
            assert_true((unsigned char)*c >= 0x20 || strchr("\n\t\r", *c));
            c++;
            continue;
        }
        bool end = c[1] == '/';
        const char *name = c + 1 + end;
        size_t size = strspn(name, "abcdefghijklmnopqrstuvwxyz");
        assert_true(size > 0 && size < sizeof open[0]);
        c = name + size;
        bool quoted = false;
        for (; *c && (quoted || *c != '>'); c++) {
            assert_true(*c != '<');
            quoted ^= *c == '"';
        }
        assert_true(*c == '>' && !quoted);
        if (end) {
            assert_true(depth > 0);
            depth--;
            assert_true(strlen(open[depth]) == size && !memcmp(open[depth], name, size));
        } else if (c[-1] != '/') {
            assert_true(depth < 32);
            snprintf(open[depth++], sizeof open[0], "%.*s", (int)size, name);
        }
        elements += !end;
        c++;
    }
    assert_int_equal(depth, 0);
    return elements;
}

/* The d="..." of the index-th path of a class, NULL past the last. */
static const char *path(const char *svg, const char *class, size_t index)
{
    char start[64];
    snprintf(start, sizeof start, "<path class=\"%s\"", class);
    for (const char *p = strstr(svg, start); p; p = strstr(p + 1, start))
        if (index-- == 0)
            return strstr(p, " d=\"") + 4;
    return NULL;
}

struct box {
    double left, right, top, bottom;
    size_t points;
};

/* Bounds of a path of M, L and Z commands. */
static struct box bounds(const char *d)
{
    struct box box = {1e9, -1e9, 1e9, -1e9, 0};
    while (*d && *d != '"') {
        char *rest;
        if (*d == 'Z') {
            d++;
            continue;
        }
        assert_true(*d == 'M' || *d == 'L');
        double x = strtod(d + 1, &rest), y = strtod(rest, &rest);
        box.left = fmin(box.left, x);
        box.right = fmax(box.right, x);
        box.top = fmin(box.top, y);
        box.bottom = fmax(box.bottom, y);
        box.points++;
        d = rest;
    }
    return box;
}

/* Prints the table, checks the text as XML and every curve against the frame. The caller frees. */
static char *drawn(const struct bcd_table *table)
{
    static const char *const classes[] = {"value", "band", "theory", "step", "bars", "guide"};
    char *svg = plot_svg_print(table, "title", "subtitle");
    assert_non_null(svg);
    assert_well_formed(svg);
    assert_null(strstr(svg, "nan"));
    assert_null(strstr(svg, "inf"));
    assert_non_null(strstr(svg, "viewBox=\"0 0 800 "));
    assert_non_null(strstr(svg, "<title>title</title>"));
    assert_true(strlen(svg) < 400000);
    if (table->scalar)
        return svg;
    struct box frame = bounds(path(svg, "frame", 0));
    assert_true(frame.left > 40 && frame.right < 800 && frame.top > 40 && frame.bottom < 520);
    assert_true(frame.right - frame.left > 400 && frame.bottom - frame.top > 250);
    for (size_t c = 0; c < sizeof classes / sizeof *classes; c++) {
        const char *d;
        for (size_t i = 0; (d = path(svg, classes[c], i)) != NULL; i++) {
            struct box box = bounds(d);
            if (box.points == 0)
                continue;
            /* A whisker's foot and half a bar may stand 5 pixels out to the side. */
            assert_true(box.left >= frame.left - 5 && box.right <= frame.right + 5);
            assert_true(box.top >= frame.top && box.bottom <= frame.bottom);
        }
    }
    return svg;
}

static void test_loglog(void **state)
{
    struct fixture *f = begin(state, "msd", 40);
    double *t = add_column(f, "lag", BCD_ROLE_X), *v = add_column(f, "msd", BCD_ROLE_VALUE);
    double *e = add_column(f, "stderr", BCD_ROLE_STDERR);
    f->table.log_x = f->table.log_y = true;
    for (int i = 0; i < 40; i++) {
        t[i] = pow(10, -3 + 0.1 * i);
        v[i] = 2 * t[i] / (1 + sqrt(t[i]));
        e[i] = 0.02 * v[i];
    }
    char *svg = drawn(&f->table);
    /* 40 points, a band there and back, both guides with labels, decades as powers. */
    assert_int_equal(bounds(path(svg, "value", 0)).points, 40);
    assert_int_equal(bounds(path(svg, "band", 0)).points, 80);
    assert_non_null(path(svg, "guide", 1));
    assert_null(path(svg, "guide", 2));
    assert_non_null(strstr(svg, "10<tspan dy=\"-5\" font-size=\"10\">\xE2\x88\x92"
                                "3</tspan>"));
    assert_non_null(strstr(svg, ">t<tspan"));
    assert_non_null(strstr(svg, "y (1/length)</text>"));
    assert_non_null(strstr(svg, ">subtitle</text>"));
    free(svg);
    /* What a logarithm cannot show is dropped; an error bar that reaches 0 ends at the frame. */
    v[5] = 0;
    v[6] = -1;
    e[10] = 2 * v[10];
    svg = drawn(&f->table);
    assert_int_equal(bounds(path(svg, "value", 0)).points, 38);
    free(svg);
    snprintf(f->table.name, sizeof f->table.name, "other");
    svg = drawn(&f->table);
    assert_null(path(svg, "guide", 0));
    free(svg);
}

static void test_linear(void **state)
{
    struct fixture *f = begin(state, "density", 100);
    double *x = add_column(f, "x", BCD_ROLE_X), *v = add_column(f, "density", BCD_ROLE_VALUE);
    double *e = add_column(f, "stderr", BCD_ROLE_STDERR);
    double *th = add_column(f, "theory", BCD_ROLE_THEORY);
    double *s = add_column(f, "time_step_error", BCD_ROLE_TIME_STEP_ERROR);
    for (int i = 0; i < 100; i++) {
        x[i] = (i + 0.5) / 100;
        th[i] = 1 + sin(6.28 * x[i]);
        v[i] = th[i] + (i % 3 - 1) * 0.05;
        e[i] = 0.1;
        s[i] = i % 2 ? 0.2 : -0.2;
    }
    char *svg = drawn(&f->table);
    assert_int_equal(bounds(path(svg, "theory", 0)).points, 100);
    assert_int_equal(bounds(path(svg, "step", 0)).points, 200);
    assert_non_null(strstr(svg, ">theory</text>"));
    assert_non_null(strstr(svg, ">time-step error</text>"));
    assert_non_null(strstr(svg, "\xC2\xB1 standard error</text>"));
    /* The frame stands where the axes say: x from 0 to 1. */
    struct box frame = bounds(path(svg, "frame", 0)), theory = bounds(path(svg, "theory", 0));
    assert_true(fabs(theory.left - frame.left - 0.005 * (frame.right - frame.left)) < 0.02);
    assert_true(fabs(frame.right - theory.right - 0.005 * (frame.right - frame.left)) < 0.02);
    free(svg);
    f->table.column[3].values = NULL;
    f->table.column[4].values = NULL;
    svg = drawn(&f->table);
    assert_null(strstr(svg, ">theory</text>"));
    assert_null(strstr(svg, ">time-step error</text>"));
    free(svg);
}

static void test_gaps(void **state)
{
    struct fixture *f = begin(state, "density", 9);
    double *x = add_column(f, "x", BCD_ROLE_X), *v = add_column(f, "density", BCD_ROLE_VALUE);
    double *e = add_column(f, "stderr", BCD_ROLE_STDERR);
    const double values[] = {1, 2, NAN, 3, NAN, 4, 5, INFINITY, NAN};
    for (int i = 0; i < 9; i++) {
        x[i] = 0.1 * i;
        v[i] = values[i];
        e[i] = i == 5 ? NAN : 0.1;
    }
    char *svg = drawn(&f->table);
    const char *d = path(svg, "value", 0);
    size_t strokes = 0;
    for (const char *c = d; *c != '"'; c++)
        strokes += *c == 'M';
    assert_int_equal(strokes, 3); /* 1-2, 3, 4-5 */
    assert_int_equal(bounds(d).points, 5);
    assert_non_null(path(svg, "band", 2));
    assert_null(path(svg, "band", 3));
    free(svg);
}

static void test_nothing(void **state)
{
    struct fixture *f = begin(state, "density", 0);
    add_column(f, "x", BCD_ROLE_X)[0] = 1;
    add_column(f, "density", BCD_ROLE_VALUE)[0] = NAN;
    char *svg = drawn(&f->table);
    assert_non_null(strstr(svg, ">no data</text>"));
    free(svg);
    f->table.rows = 1;
    svg = drawn(&f->table);
    assert_non_null(strstr(svg, ">no data</text>"));
    free(svg);
    f->table.column[1].values = NULL;
    snprintf(f->table.column[1].reason, sizeof f->table.column[1].reason, "no <rods>");
    svg = drawn(&f->table);
    assert_non_null(strstr(svg, "no &#60;rods&#62;</text>"));
    free(svg);
    f->table.columns = 0;
    f->table.log_x = f->table.log_y = true;
    free(drawn(&f->table));
    f->table.scalar = true;
    free(drawn(&f->table));
}

/* Every mixture of awkward numbers, on every kind of axis. */
static void test_awkward_numbers(void **state)
{
    static const double odd[] = {0,      1,         -1,   1e308,   -1e308,   5e-324,   1e-300,
                                 1e300,  -1e-7,     1e15, NAN,     INFINITY, 0.1,      1e-290,
                                 -1e290, 1 + 1e-15, 1e5,  99999.5, 1e-3,     123456789};
    enum { ODD = sizeof odd / sizeof *odd };
    struct fixture *f = begin(state, "msd", 4);
    double *column[5];
    for (int c = 0; c < 5; c++)
        column[c] = add_column(f, "c", (enum bcd_role)c);
    uint64_t bits = 88172645463325252u;
    for (int trial = 0; trial < 5000; trial++) {
        for (int c = 0; c < 5; c++)
            for (int i = 0; i < 4; i++) {
                bits ^= bits << 13, bits ^= bits >> 7, bits ^= bits << 17;
                column[c][i] = odd[(bits >> 20) % ODD];
            }
        f->table.log_x = trial & 1;
        f->table.log_y = trial & 2;
        f->table.scalar = (trial & 28) == 28;
        f->table.rows = f->table.scalar ? 1 : (size_t)(bits >> 40) % 5;
        free(drawn(&f->table));
    }
}

static void test_constant(void **state)
{
    struct fixture *f = begin(state, "density", 10);
    double *x = add_column(f, "x", BCD_ROLE_X), *v = add_column(f, "density", BCD_ROLE_VALUE);
    for (int i = 0; i < 10; i++) {
        x[i] = i;
        v[i] = -3.25e-7;
    }
    char *svg = drawn(&f->table);
    struct box frame = bounds(path(svg, "frame", 0)), line = bounds(path(svg, "value", 0));
    assert_true(line.top == line.bottom);
    assert_true(line.top > frame.top + 50 && line.top < frame.bottom - 50);
    assert_non_null(strstr(svg, "10<tspan dy=\"-5\" font-size=\"10\">\xE2\x88\x92"
                                "7</tspan>"));
    free(svg);
    f->table.rows = 1;
    svg = drawn(&f->table);
    assert_non_null(strstr(svg, "<circle class=\"dot\""));
    free(svg);
}

static void test_bars(void **state)
{
    struct fixture *f = begin(state, "cluster_sizes", 1000);
    double *x = add_column(f, "size", BCD_ROLE_X), *v = add_column(f, "f", BCD_ROLE_VALUE);
    double *e = add_column(f, "stderr", BCD_ROLE_STDERR);
    for (int i = 0; i < 1000; i++) {
        x[i] = i + 1;
        v[i] = i < 12 ? pow(0.5, i + 1) : 0;
        e[i] = i < 12 ? 0.1 * v[i] + 0.01 : 0;
    }
    char *svg = drawn(&f->table);
    struct box frame = bounds(path(svg, "frame", 0)), bars = bounds(path(svg, "bars", 0));
    assert_int_equal(bars.points, 12 * 4); /* the empty tail is left out */
    assert_true(bars.bottom == frame.bottom);
    assert_null(path(svg, "value", 0));
    free(svg);
    f->table.log_y = true;
    free(drawn(&f->table));
    f->table.log_y = false;
    for (int i = 0; i < 1000; i++)
        v[i] = 1; /* too many for bars */
    svg = drawn(&f->table);
    assert_null(path(svg, "bars", 0));
    assert_int_equal(bounds(path(svg, "value", 0)).points, 1000);
    free(svg);
}

static void test_scalar(void **state)
{
    struct fixture *f = begin(state, "current", 1);
    f->table.scalar = true;
    add_column(f, "current", BCD_ROLE_VALUE)[0] = 0.79641;
    add_column(f, "stderr", BCD_ROLE_STDERR)[0] = 0.0021;
    char *svg = drawn(&f->table);
    assert_non_null(strstr(svg, ">0.7964 \xC2\xB1 0.0021</text>"));
    free(svg);
    add_column(f, "theory", BCD_ROLE_THEORY)[0] = 0.8;
    svg = drawn(&f->table);
    assert_non_null(strstr(svg, ">theory 0.8</text>"));
    free(svg);
    f->values[0][0] = -1.23e-10;
    f->values[1][0] = 4e-12;
    svg = drawn(&f->table);
    assert_non_null(strstr(svg, ">(\xE2\x88\x92"
                                "1.230 \xC2\xB1 0.040) \xC3\x97 10\xE2\x81\xBB"
                                "\xC2\xB9\xE2\x81\xB0</text>"));
    free(svg);
}

/* 100 000 points become at most 2000, and the one that sticks out is among them. */
static void test_thinning(void **state)
{
    struct fixture *f = begin(state, "trajectory", ROWS_MAX);
    double *x = add_column(f, "t", BCD_ROLE_X), *v = add_column(f, "x", BCD_ROLE_VALUE);
    double *e = add_column(f, "stderr", BCD_ROLE_STDERR);
    for (int i = 0; i < ROWS_MAX; i++) {
        x[i] = 0.5 * i;
        v[i] = sin(1e-3 * i);
        e[i] = 0.01;
    }
    v[54321] = 17;
    v[65432] = -19;
    v[77777] = NAN;
    e[12345] = 30;
    struct plot_points points;
    assert_true(plot_points_init(&points, &f->table));
    assert_true(points.count <= PLOT_POINTS_MAX && points.count > PLOT_POINTS_MAX / 4);
    double low = 0, high = 0, top = 0;
    bool gap = false;
    for (size_t i = 0; i < points.count; i++) {
        const struct plot_point *p = &points.point[i];
        low = fmin(low, p->value);
        high = fmax(high, p->value);
        top = fmax(top, p->high);
        gap = gap || (isnan(p->value) && p->x == 0.5 * 77777);
        assert_true(i == 0 || p->x > points.point[i - 1].x);
    }
    assert_true(low == -19 && high == 17 && top > 29 && gap);
    assert_true(points.point[0].x == 0 && points.point[points.count - 1].x == x[ROWS_MAX - 1]);
    plot_points_fini(&points);
    free(drawn(&f->table));
}

static void test_words(void **state)
{
    struct fixture *f = begin(state, "a<b", 2);
    double *x = add_column(f, "x", BCD_ROLE_X), *v = add_column(f, "<&\"'>", BCD_ROLE_VALUE);
    x[0] = v[0] = 1;
    x[1] = v[1] = 2;
    snprintf(f->table.x_label, sizeof f->table.x_label, "x & y \x01\xFF");
    f->table.notes = 1;
    snprintf(f->table.note[0].name, sizeof f->table.note[0].name, "n<");
    snprintf(f->table.note[0].text, sizeof f->table.note[0].text, "t>");
    char title[3000];
    memset(title, 'W', sizeof title);
    memcpy(title, "</title><script>", 16);
    title[sizeof title - 1] = '\0';
    char *svg = plot_svg_print(&f->table, title, "a <sub> & \"title\" \xE2\x82");
    assert_non_null(svg);
    assert_well_formed(svg);
    assert_null(strstr(svg, "<script"));
    assert_null(strstr(svg, "<sub"));
    assert_non_null(strstr(svg, "\xE2\x80\xA6</text>")); /* the title is cut where drawn */
    assert_non_null(strstr(svg, "&#60;&#38;&#34;&#39;&#62;</text>"));
    assert_non_null(
        strstr(svg, "a &#60;sub&#62; &#38; &#34;title&#34; \xEF\xBF\xBD\xEF\xBF\xBD</text>"));
    free(svg);
    svg = plot_svg_print(&f->table, "", NULL);
    assert_well_formed(svg);
    free(svg);
}

static void test_ticks(void **state)
{
    (void)state;
    struct plot_axis axis = {.to = 700};
    struct plot_ticks ticks;
    plot_axis_fit(&axis, 0.005, 0.995, PLOT_FIT_ALONG);
    assert_true(axis.min == 0 && fabs(axis.max - 1) < 1e-12);
    plot_axis_ticks(&axis, 5, &ticks);
    assert_int_equal(ticks.count, 6);
    assert_string_equal(ticks.tick[1].text, "0.2");
    assert_string_equal(ticks.tick[5].text, "1.0");
    axis = (struct plot_axis){.log = true, .min = 1e-3, .max = 1e3, .to = 700};
    plot_axis_ticks(&axis, 8, &ticks);
    size_t major = 0;
    for (size_t i = 0; i < ticks.count; i++)
        major += ticks.tick[i].major;
    assert_int_equal(major, 7);
    assert_int_equal(ticks.count, 6 * 9 + 1);
    assert_true(fabs(plot_axis_pixel(&axis, 1) - 350) < 1e-9);
    assert_true(plot_axis_pixel(&axis, -5) == 0 && plot_axis_pixel(&axis, 1e9) == 700);
    char out[32];
    plot_print_fixed(out, sizeof out, -0.004, 2);
    assert_string_equal(out, "0.00");
    plot_print_fixed(out, sizeof out, -12.3456, 3);
    assert_string_equal(out, "\xE2\x88\x92"
                             "12.346");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_loglog, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_linear, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_gaps, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_nothing, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_awkward_numbers, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_constant, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_bars, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_scalar, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_thinning, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_words, set_up, tear_down),
        cmocka_unit_test(test_ticks),
    };
    return cmocka_run_group_tests_name("plot_svg", tests, NULL, NULL);
}
