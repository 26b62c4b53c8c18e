/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A plot is 800 wide and 540 high (one number: 276): title, legend, frame, axis titles and small
 * print below one another, so that nothing ever lies over the data. Colours are Okabe and Ito's,
 * told apart by colour-blind readers, and lines differ in their dashes as well.
 */
#include "plot_svg.h"
#include "plot_axis.h"
#include "plot_curves.h"
#include "plot_frame.h"
#include "plot_marks.h"
#include "plot_points.h"
#include "plot_words.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 800, HEIGHT = 540, SCALAR_HEIGHT = 276, RIGHT = WIDTH - 28 };
enum { TITLE_SIZE = 18, LABEL_SIZE = 15, TICK_SIZE = 13 };

static void open_picture(struct text *svg, const struct bcd_table *table, const char *title,
                         int height);
static void draw_plot(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                      const char *subtitle);
static void draw_scalar(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                        const char *subtitle);
static char *print_series(const struct bcd_table *table, const char *title, const char *subtitle);

char *plot_svg_print(const struct bcd_table *table, const char *title, const char *subtitle)
{
    struct text svg = {0};
    struct plot_points points;
    if (plot_series_in(table))
        return print_series(table, title, subtitle);
    if (!plot_points_init(&points, table))
        return NULL;
    open_picture(&svg, table, title, table->scalar ? SCALAR_HEIGHT : HEIGHT);
    if (table->scalar)
        draw_scalar(&svg, table, &points, subtitle ? subtitle : "");
    else
        draw_plot(&svg, table, &points, subtitle ? subtitle : "");
    text_add(&svg, "</svg>\n");
    plot_points_fini(&points);
    return text_take(&svg);
}

static void open_picture(struct text *svg, const struct bcd_table *table, const char *title,
                         int height)
{
    text_add(svg,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
             "height=\"%d\" role=\"img\" font-family=\"sans-serif\">\n<title>",
             WIDTH, height, WIDTH, height);
    text_add_xml(svg, title);
    text_add(svg, "</title>\n<desc>");
    text_add_xml(svg, table->y_label[0] ? table->y_label : table->name);
    if (!table->scalar && table->x_label[0]) {
        text_add(svg, " against ");
        text_add_xml(svg, table->x_label);
    }
    for (size_t i = 0; i < table->notes && i < BCD_NOTES_MAX; i++) {
        text_add(svg, "; ");
        text_add_xml(svg, table->note[i].name);
        text_add(svg, ": ");
        if (table->note[i].text[0])
            text_add_xml(svg, table->note[i].text);
        else
            text_add_number(svg, table->note[i].number);
    }
    text_add(svg, "</desc>\n<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n", WIDTH, height);
    plot_line_print(svg,
                    &(struct plot_line){16, 30, WIDTH - 32, TITLE_SIZE, PLOT_START,
                                        "font-weight=\"bold\" fill=\"" PLOT_INK "\""},
                    title);
}

/* ------------------------------------------------------------------ legend */

static void add_legend(struct text *svg, const struct bcd_table *table,
                       const struct plot_points *points, double x, double y)
{
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    x = plot_key_print(svg, x, y, points->bars ? PLOT_KEY_BAR : PLOT_KEY_VALUE,
                       value ? value->name : table->name);
    if (points->errors)
        x = plot_key_print(svg, x, y,
                           points->bars || table->scalar ? PLOT_KEY_WHISKER : PLOT_KEY_BAND,
                           "\xC2\xB1 standard error");
    if (points->steps)
        x = plot_key_print(svg, x, y, PLOT_KEY_STEP, "time-step error");
    if (points->theory)
        plot_key_print(svg, x, y, PLOT_KEY_THEORY, "theory");
}

/* -------------------------------------------------------------------- plot */

/* Frame and axes fitted to the points, from the pixel `top` downwards. */
static void open_frame(struct text *svg, struct plot_frame *frame, const struct plot_points *points,
                       double top, const char *subtitle)
{
    int lines = plot_small_print(NULL, subtitle, 0, WIDTH);
    *frame = (struct plot_frame){.tick_size = TICK_SIZE, .x_labels = 8, .y_labels = 6};
    frame->x.to = RIGHT;
    frame->y.to = top;
    frame->y.from = HEIGHT - 62 - (lines ? 15 * lines + 8 : 0);
    plot_frame_fit(frame, points, 52, 0);
    if (points->x.lo > points->x.hi)
        return;
    plot_frame_print_x(svg, frame, 44);
    plot_frame_print_y(svg, frame);
}

/* The frame's lines, axis titles and the small print. */
static void close_frame(struct text *svg, const struct plot_frame *frame,
                        const struct bcd_table *table, const char *subtitle)
{
    const struct plot_axis *x = &frame->x, *y = &frame->y;
    double middle = (y->from + y->to) / 2;
    int lines = plot_small_print(NULL, subtitle, 0, WIDTH);
    plot_frame_print(svg, frame);
    plot_line_print(svg,
                    &(struct plot_line){(x->from + x->to) / 2, y->from + 44, x->to - x->from - 120,
                                        LABEL_SIZE, PLOT_MIDDLE, "fill=\"" PLOT_INK "\""},
                    table->x_label);
    text_add(svg, "<g transform=\"translate(24 %d) rotate(-90)\">\n", (int)middle);
    plot_line_print(svg,
                    &(struct plot_line){0, 0, y->from - y->to, LABEL_SIZE, PLOT_MIDDLE,
                                        "fill=\"" PLOT_INK "\""},
                    table->y_label[0] ? table->y_label : table->name);
    text_add(svg, "</g>\n");
    plot_small_print(svg, subtitle, HEIGHT - 6 - 15 * (lines - 1), WIDTH);
}

static void draw_plot(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                      const char *subtitle)
{
    struct plot_frame frame;
    open_frame(svg, &frame, points, 76, subtitle);
    if (points->x.lo <= points->x.hi) {
        add_legend(svg, table, points, frame.x.from + 4, frame.y.to - 19);
        plot_marks_print(svg, points, &frame.x, &frame.y);
        if (strcmp(table->name, "msd") == 0)
            plot_guides_print(svg, points, &frame.x, &frame.y);
    } else {
        plot_frame_print_empty(svg, &frame, table);
    }
    close_frame(svg, &frame, table, subtitle);
}

/* One curve for every run of equal values in the table's column BCD_ROLE_SERIES. */
static char *print_series(const struct bcd_table *table, const char *title, const char *subtitle)
{
    struct text svg = {0};
    struct plot_series series = {0};
    struct plot_curves curves = {0};
    struct plot_legend legend = {0};
    struct plot_frame frame;
    const double keys[2] = {56, 57};
    const char *small = subtitle ? subtitle : "";
    if (!plot_series_init(&series, table) ||
        !plot_curves_init(&curves, series.curve, series.count)) {
        plot_series_fini(&series);
        return NULL;
    }
    plot_legend_add(&legend, series.curve, series.count);
    int lines = plot_legend_print(NULL, &legend, keys, RIGHT);
    open_picture(&svg, table, title, HEIGHT);
    open_frame(&svg, &frame, &curves.all, 76 + PLOT_LEGEND_LINE * (lines - 1), small);
    if (curves.all.x.lo <= curves.all.x.hi) {
        plot_legend_print(&svg, &legend, keys, RIGHT);
        plot_curves_print(&svg, &curves, &legend, (struct plot_axis[]){frame.x, frame.y});
    } else {
        plot_frame_print_empty(&svg, &frame, table);
    }
    close_frame(&svg, &frame, table, small);
    text_add(&svg, "</svg>\n");
    plot_curves_fini(&curves);
    plot_series_fini(&series);
    return text_take(&svg);
}

/* ------------------------------------------------------------------ scalar */

/* " x 10^n", the exponent in raised digits; nothing for n = 0. */
static void print_power(char *out, size_t size, int power)
{
    static const char *const raised[] = {
        "\xE2\x81\xB0", "\xC2\xB9",     "\xC2\xB2",     "\xC2\xB3",     "\xE2\x81\xB4",
        "\xE2\x81\xB5", "\xE2\x81\xB6", "\xE2\x81\xB7", "\xE2\x81\xB8", "\xE2\x81\xB9"};
    char digits[16];
    out[0] = '\0';
    if (power == 0)
        return;
    snprintf(digits, sizeof digits, "%d", power < 0 ? -power : power);
    size_t n = (size_t)snprintf(out, size, " \xC3\x97 10%s", power < 0 ? "\xE2\x81\xBB" : "");
    for (const char *d = digits; *d && n + 4 < size; d++)
        n += (size_t)snprintf(out + n, size - n, "%s", raised[*d - '0']);
}

/* "0.7960 +- 0.0021": the error to two digits, the value as far as they reach. Without an error
 * (NaN) the value to six digits. */
static void print_value(char *out, size_t size, double value, double error)
{
    bool alone = isnan(error);
    double scale = fmax(fabs(value), alone ? 0 : error);
    int exponent = scale > 0 ? (int)floor(log10(scale)) : 0;
    int power = exponent < -3 || exponent > 5 ? exponent : 0;
    double finest = error > 0 ? floor(log10(error)) - 1 : exponent - 5;
    int digits = (int)fmin(fmax(power - finest, 0), 12);
    char v[48], e[48], times[48];
    /* In two steps: 10^-power need not be a double. */
    double half = pow(10, power / 2), rest = pow(10, power - power / 2);
    plot_print_fixed(v, sizeof v, value / half / rest, digits);
    plot_print_fixed(e, sizeof e, alone ? 0 : error / half / rest, digits);
    if (alone && strchr(v, '.')) { /* "2.50000" */
        size_t end = strlen(v);
        while (v[end - 1] == '0')
            end--;
        v[v[end - 1] == '.' ? end - 1 : end] = '\0';
    }
    print_power(times, sizeof times, power);
    if (alone)
        snprintf(out, size, "%s%s", v, times);
    else
        snprintf(out, size, power ? "(%s \xC2\xB1 %s)%s" : "%s \xC2\xB1 %s%s", v, e, times);
}

/* Value, whisker of one standard error, and theory on a line of numbers. */
static void draw_scalar(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                        const char *subtitle)
{
    struct plot_point p = points->count ? points->point[0] : (struct plot_point){.value = NAN};
    struct plot_frame frame = {.x = {.from = 40, .to = WIDTH - 40},
                               .y = {.from = 186, .to = 136},
                               .tick_size = TICK_SIZE,
                               .x_labels = 7};
    const struct plot_axis *x = &frame.x, *y = &frame.y;
    char words[160], theory[80];
    int lines = plot_small_print(NULL, subtitle, 0, WIDTH);
    if (isnan(p.value)) {
        plot_frame_print_empty(svg, &frame, table);
        plot_small_print(svg, subtitle, SCALAR_HEIGHT - 8 - 15 * (lines - 1), WIDTH);
        return;
    }
    double error = p.high - p.value;
    print_value(words, sizeof words, p.value, error);
    plot_line_print(svg, &(struct plot_line){16, 72, 520, 30, PLOT_START, "fill=\"" PLOT_BLUE "\""},
                    words);
    if (points->theory) {
        print_value(theory, sizeof theory, p.theory, NAN);
        snprintf(words, sizeof words, "theory %s", theory);
        plot_line_print(
            svg, &(struct plot_line){WIDTH - 16, 72, 300, 18, PLOT_END, "fill=\"" PLOT_RED "\""},
            words);
    }
    plot_line_print(
        svg,
        &(struct plot_line){16, 98, WIDTH - 32, LABEL_SIZE, PLOT_START, "fill=\"" PLOT_INK "\""},
        table->y_label[0] ? table->y_label : table->name);
    plot_axis_fit(&frame.x, points->y.lo, points->y.hi, PLOT_FIT_ACROSS);
    plot_frame_tick_x(&frame);
    plot_frame_print_x(svg, &frame, 38);
    plot_segment_print(svg, (double[]){x->from, y->from}, (double[]){x->to, y->from},
                       "stroke=\"" PLOT_INK "\"");
    plot_scalar_print(svg, &p, x, (y->from + y->to) / 2);
    add_legend(svg, table, points, 40, 118);
    plot_small_print(svg, subtitle, SCALAR_HEIGHT - 8 - 15 * (lines - 1), WIDTH);
}
