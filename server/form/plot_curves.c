/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "plot_curves.h"
#include "plot_marks.h"
#include "plot_words.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A crowd of curves has so many points together; a curve that is told by its markers has about
 * MARKERS of them when it is too dense for one at every point. */
enum { POINTS_TOGETHER = 40000, DENSE = 80, MARKERS = 10 };

/* ------------------------------------------------------------------ styles */

/* Okabe and Ito's colours without their yellow, which is too pale on white; then darker ones. */
static const char *const colours[PLOT_STYLES] = {PLOT_BLUE, PLOT_RED,  "#009E73", "#222222",
                                                 "#CC79A7", "#E69F00", "#56B4E9", "#7F3C8D",
                                                 "#8A5A2B", "#8C8C8C", "#A3A500", "#8B0000"};
static const char *const dashes[] = {"none", "7 3", "2 3", "9 3 2 3", "14 4"};
enum { DASHES = sizeof dashes / sizeof *dashes };

/* Markers as polygons in tenths of their radius. */
enum { CORNERS_MAX = 12 };
struct shape {
    size_t corners;
    signed char at[CORNERS_MAX][2];
};
static const struct shape shapes[] = {
    {12,
     {{10, 0}, {9, 5}, {5, 9}, {0, 10}, {-5, 9}, {-9, 5}, {-10, 0}, {-9, -5}, {-5, -9}, {0, -10},
      {5, -9}, {9, -5}}},
    {4, {{9, 9}, {-9, 9}, {-9, -9}, {9, -9}}},
    {3, {{0, -13}, {11, 8}, {-11, 8}}},
    {4, {{0, -13}, {10, 0}, {0, 13}, {-10, 0}}},
    {3, {{0, 13}, {11, -8}, {-11, -8}}},
    {12,
     {{4, 4}, {12, 4}, {12, -4}, {4, -4}, {4, -12}, {-4, -12}, {-4, -4}, {-12, -4}, {-12, 4},
      {-4, 4}, {-4, 12}, {4, 12}}},
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

const char *plot_style_colour(size_t style)
{
    return colours[style % PLOT_STYLES];
}

const char *plot_style_dash(size_t style)
{
    return dashes[style % DASHES];
}

void plot_style_add_marker(struct text *svg, size_t style, const double at[2], double radius)
{
    const struct shape *shape = &shapes[style % SHAPES];
    for (size_t i = 0; i < shape->corners; i++)
        plot_add_point(svg, i ? 'L' : 'M', at[0] + radius * shape->at[i][0] / 10,
                       at[1] + radius * shape->at[i][1] / 10);
    text_add(svg, "Z");
}

/* The second round of markers is hollow. */
static void open_markers(struct text *svg, size_t style)
{
    const char *colour = plot_style_colour(style);
    text_add(svg, "<path class=\"markers\" fill=\"%s\" stroke=\"%s\" d=\"",
             style < SHAPES ? colour : "#ffffff", colour);
}

/* ------------------------------------------------------------------ legend */

/* Its style; PLOT_STYLES = the legend does not know it. */
static size_t style_of(const struct plot_legend *legend, const char *label)
{
    for (size_t i = 0; i < legend->count; i++)
        if (strcmp(legend->label[i], label) == 0)
            return i;
    return PLOT_STYLES;
}

void plot_legend_add(struct plot_legend *legend, const struct plot_curve *curve, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const struct bcd_column *theory = bcd_table_column(curve[i].table, BCD_ROLE_THEORY);
        legend->theory = legend->theory || (theory && theory->values);
        if (style_of(legend, curve[i].label) < PLOT_STYLES)
            continue;
        if (legend->count < PLOT_STYLES)
            legend->label[legend->count++] = curve[i].label;
        else
            legend->crowded = true;
    }
}

static void add_key(struct text *svg, size_t style, const double at[2], const char *label)
{
    struct text mark = {0};
    text_add(&mark,
             "<path d=\"M0 0H24\" stroke=\"%s\" stroke-width=\"1.6\" "
             "stroke-dasharray=\"%s\"/>",
             plot_style_colour(style), plot_style_dash(style));
    open_markers(&mark, style);
    plot_style_add_marker(&mark, style, (double[]){12, 0}, 3.6);
    text_add(&mark, "\"/>");
    char *finished = text_take(&mark);
    if (finished)
        plot_key_print(svg, at[0], at[1], finished, label);
    else
        svg->failed = true;
    free(finished);
}

int plot_legend_print(struct text *svg, const struct plot_legend *legend, const double at[2],
                      double right)
{
    double pen[2] = {at[0], at[1]};
    int lines = 1;
    for (size_t i = 0; i < legend->count + legend->theory && !legend->crowded; i++) {
        bool last = i == legend->count;
        const char *label = last ? "lines: exact theory" : legend->label[i];
        double width = plot_key_width(label);
        if (pen[0] > at[0] && pen[0] + width > right) {
            pen[0] = at[0];
            pen[1] += PLOT_LEGEND_LINE;
            lines++;
        }
        if (svg && last)
            plot_key_print(svg, pen[0], pen[1], "<path d=\"M0 0H24\" stroke=\"" PLOT_INK "\"/>",
                           label);
        else if (svg)
            add_key(svg, i, pen, label);
        pen[0] += width;
    }
    return lines;
}

/* ------------------------------------------------------------------ curves */

static bool join(struct plot_points *all, const struct plot_curves *curves);

bool plot_curves_init(struct plot_curves *curves, const struct plot_curve *curve, size_t count)
{
    size_t most = count > 0 ? POINTS_TOGETHER / count : 0;
    *curves = (struct plot_curves){.curve = curve};
    curves->each = calloc(count + 1, sizeof *curves->each);
    bool good = curves->each != NULL;
    for (size_t i = 0; i < count && good; i++) {
        struct plot_rows rows = {curve[i].table, curve[i].first, curve[i].rows};
        if (rows.rows == 0)
            rows.rows = rows.table->rows;
        good = plot_points_init_curve(&curves->each[i], &rows,
                                      most < PLOT_POINTS_MAX ? most : PLOT_POINTS_MAX);
        curves->count += good;
    }
    if (good && join(&curves->all, curves))
        return true;
    plot_curves_fini(curves);
    return false;
}

void plot_curves_fini(struct plot_curves *curves)
{
    for (size_t i = 0; i < curves->count; i++)
        plot_points_fini(&curves->each[i]);
    free(curves->each);
    plot_points_fini(&curves->all);
    *curves = (struct plot_curves){0};
}

static bool join(struct plot_points *all, const struct plot_curves *curves)
{
    size_t count = 0;
    for (size_t i = 0; i < curves->count; i++)
        count += curves->each[i].count;
    *all = (struct plot_points){.x = {DBL_MAX, -DBL_MAX}, .y = {DBL_MAX, -DBL_MAX}};
    all->point = calloc(count + 1, sizeof *all->point);
    if (!all->point)
        return false;
    for (size_t i = 0; i < curves->count; i++) {
        const struct plot_points *one = &curves->each[i];
        memcpy(all->point + all->count, one->point, one->count * sizeof *one->point);
        all->count += one->count;
        all->log_x = all->log_x || one->log_x;
        all->log_y = all->log_y || one->log_y;
        if (one->x.lo > one->x.hi)
            continue;
        plot_range_include(&all->x, one->x.lo);
        plot_range_include(&all->x, one->x.hi);
        plot_range_include(&all->y, one->y.lo);
        plot_range_include(&all->y, one->y.hi);
        all->errors = all->errors || one->errors;
        all->theory = all->theory || one->theory;
    }
    return true;
}

/* One line through values or theory, broken where there are none. */
static void print_line(struct text *svg, const struct plot_points *points, bool theory,
                       const struct plot_axis axes[2])
{
    bool pen = false;
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        double v = theory ? p->theory : p->value;
        if (!isnan(v))
            plot_add_point(svg, pen ? 'L' : 'M', plot_axis_pixel(&axes[0], p->x),
                           plot_axis_pixel(&axes[1], v));
        pen = !isnan(v);
    }
    text_add(svg, "\"/>\n");
}

static void print_whiskers(struct text *svg, const struct plot_points *points, const char *colour,
                           const struct plot_axis axes[2])
{
    text_add(svg, "<path class=\"band\" fill=\"none\" stroke=\"%s\" d=\"", colour);
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        if (!isnan(p->low))
            plot_add_whisker(svg,
                             (double[]){plot_axis_pixel(&axes[0], p->x),
                                        plot_axis_pixel(&axes[1], p->low),
                                        plot_axis_pixel(&axes[1], p->high)},
                             2.5);
    }
    text_add(svg, "\"/>\n");
}

/* Markers of neighbouring styles start at different points, so that curves that lie over one
 * another show all of theirs. */
static void print_markers(struct text *svg, const struct plot_points *points, size_t style,
                          const struct plot_axis axes[2])
{
    bool dense = points->count > DENSE;
    size_t step = dense ? points->count / MARKERS : 1;
    open_markers(svg, style);
    for (size_t i = dense ? style * step / PLOT_STYLES : 0; i < points->count; i += step) {
        const struct plot_point *p = &points->point[i];
        if (!isnan(p->value))
            plot_style_add_marker(svg, style,
                                  (double[]){plot_axis_pixel(&axes[0], p->x),
                                             plot_axis_pixel(&axes[1], p->value)},
                                  points->count > 40 && !dense ? 2.4 : 3.2);
    }
    text_add(svg, "\"/>\n");
}

/* Full lines where dashes would be lost among the points. */
static void print_styled(struct text *svg, const struct plot_points *points, size_t style,
                         const struct plot_axis axes[2])
{
    const char *colour = plot_style_colour(style);
    text_add(svg, "<path class=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"1.6\" "
                  "stroke-linejoin=\"round\" stroke-dasharray=\"%s\" d=\"",
             points->theory ? "theory" : "value", colour,
             dashes[points->count > DENSE ? 0 : style % DASHES]);
    print_line(svg, points, points->theory, axes);
    if (points->errors)
        print_whiskers(svg, points, colour, axes);
    print_markers(svg, points, style, axes);
}

void plot_curves_print(struct text *svg, const struct plot_curves *curves,
                       const struct plot_legend *legend, const struct plot_axis axes[2])
{
    for (size_t i = 0; i < curves->count; i++) {
        const struct plot_points *points = &curves->each[i];
        if (!legend->crowded) {
            text_add(svg, "<g class=\"curve\">\n");
            print_styled(svg, points, style_of(legend, curves->curve[i].label), axes);
            text_add(svg, "</g>\n");
            continue;
        }
        text_add(svg, "<path class=\"curve\" fill=\"none\" stroke=\"%s\" stroke-width=\".8\" d=\"",
                 plot_style_colour(i));
        print_line(svg, points, false, axes);
    }
}

/* ------------------------------------------------------------------ series */

static const double *series_values(const struct bcd_table *table)
{
    const struct bcd_column *column = bcd_table_column(table, BCD_ROLE_SERIES);
    return column ? column->values : NULL;
}

bool plot_series_in(const struct bcd_table *table)
{
    return !table->scalar && series_values(table) && table->rows > 0;
}

/* Does another curve begin at this row? Two NaN are one and the same. */
static bool begins(const double *series, size_t row)
{
    return row == 0 || !(series[row] == series[row - 1] ||
                         (isnan(series[row]) && isnan(series[row - 1])));
}

bool plot_series_init(struct plot_series *series, const struct bcd_table *table)
{
    const struct bcd_column *column = bcd_table_column(table, BCD_ROLE_SERIES);
    const double *values = column->values;
    *series = (struct plot_series){0};
    size_t count = 0;
    for (size_t row = 0; row < table->rows; row++)
        count += begins(values, row);
    series->curve = calloc(count + 1, sizeof *series->curve);
    if (!series->curve)
        return false;
    for (size_t row = 0; row < table->rows; row++) {
        if (begins(values, row)) {
            size_t i = series->count++, shown = i < PLOT_STYLES ? i : PLOT_STYLES;
            series->curve[i] = (struct plot_curve){table, row, 0, series->label[shown]};
            if (shown < PLOT_STYLES)
                snprintf(series->label[i], PLOT_LABEL_SIZE, "%.31s %g", column->name, values[row]);
        }
        series->curve[series->count - 1].rows++;
    }
    return true;
}

void plot_series_fini(struct plot_series *series)
{
    free(series->curve);
    series->curve = NULL;
}
