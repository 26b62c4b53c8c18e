/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_work_precision_plot.c - error against cost, log-log: a column of panels for each scene, a
 * row for each kind of error, a curve with error bars for each method. A value that is lost in the
 * noise is hollow, at its upper bound.
 */
#include "plot_curves.h"
#include "plot_frame.h"
#include "plot_marks.h"
#include "plot_words.h"
#include "report_work_precision.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CELL_WIDTH = 300, CELL_HEIGHT = 220, FRAME_RIGHT = 286, FRAME_TOP = 26, FRAME_FOOT = 182 };
enum { LEFT = 30, TOP = 112, BELOW = 60, KEY_ROW = 22, TITLE_SIZE = 20, LABEL_SIZE = 14 };
static const double error_least = 1e-6; /* a logarithm's foot */
static const double marker_radius = 3.6;

static const char *const row_titles[WORK_PRECISION_KINDS] = {
    "|energy error|, kT", "density, relative L1", "|contact density error|, relative",
    "|drift velocity error|, relative"};

struct panel {
    const struct work_precision_result *result;
    enum work_precision_kind kind;
    struct plot_frame frame;
};

static void add_legend(struct text *svg, const struct work_precision *report, int width);
static void add_panel(struct text *svg, struct panel *panel);
static void add_curve(struct text *svg, const struct panel *panel,
                      const struct work_precision_method *method, size_t style);

/* The report's columns: scenes that were measured. */
static size_t list_scenes(const struct work_precision *report,
                          const struct work_precision_result *list[WORK_PRECISION_SCENES])
{
    size_t count = 0;
    for (size_t i = 0; i < WORK_PRECISION_SCENES; i++)
        if (report->result[i].scene)
            list[count++] = &report->result[i];
    return count;
}

char *work_precision_print_svg(const struct work_precision *report)
{
    const struct work_precision_result *list[WORK_PRECISION_SCENES];
    struct text svg = {0};
    struct panel *panel = malloc(sizeof *panel);
    size_t scenes = list_scenes(report, list);
    int width = LEFT + CELL_WIDTH * (scenes < 2 ? 2 : (int)scenes);
    int height = TOP + CELL_HEIGHT * WORK_PRECISION_KINDS + BELOW;
    text_add(&svg,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
             "height=\"%d\" role=\"img\" font-family=\"sans-serif\">\n"
             "<title>Error against run time</title>\n"
             "<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n",
             width, height, width, height, width, height);
    plot_line_print(&svg,
                    &(struct plot_line){16, 30, width - 32, TITLE_SIZE, PLOT_START,
                                        "font-weight=\"bold\" fill=\"" PLOT_INK "\""},
                    "Error against run time: ns of one core per rod and unit of simulated time");
    add_legend(&svg, report, width);
    for (int row = 0; row < WORK_PRECISION_KINDS; row++) {
        text_add(&svg, "<g transform=\"translate(20 %d) rotate(-90)\">\n",
                 TOP + CELL_HEIGHT * row + (FRAME_TOP + FRAME_FOOT) / 2);
        plot_line_print(&svg,
                        &(struct plot_line){0, 0, CELL_HEIGHT - 8, LABEL_SIZE, PLOT_MIDDLE,
                                            "fill=\"" PLOT_INK "\""},
                        row_titles[row]);
        text_add(&svg, "</g>\n");
        for (size_t i = 0; panel && i < scenes; i++) {
            double left = LEFT + CELL_WIDTH * (double)i, top = TOP + CELL_HEIGHT * (double)row;
            *panel = (struct panel){.result = list[i], .kind = row};
            panel->frame = (struct plot_frame){.tick_size = 12, .x_labels = 5, .y_labels = 5};
            panel->frame.x.from = left;
            panel->frame.x.to = left + FRAME_RIGHT;
            panel->frame.y.to = top + FRAME_TOP;
            panel->frame.y.from = top + FRAME_FOOT;
            add_panel(&svg, panel);
        }
    }
    plot_small_print(&svg,
                     "Bars: one standard error. Density: what error bars alone would give is "
                     "taken off in quadrature. Hollow: within the noise, drawn at the upper bound. "
                     "Measured on this machine.",
                     height - 26, width);
    text_add(&svg, "</svg>\n");
    svg.failed = svg.failed || !panel;
    free(panel);
    return text_take(&svg);
}

/* ------------------------------------------------------------------ legend */

static double add_key(struct text *svg, size_t style, const double at[2], const char *name)
{
    struct text mark = {0};
    text_add(&mark,
             "<path d=\"M0 0H24\" stroke=\"%s\" stroke-width=\"2\" stroke-dasharray=\"%s\"/>"
             "<path fill=\"%s\" d=\"",
             plot_style_colour(style), plot_style_dash(style), plot_style_colour(style));
    plot_style_add_marker(&mark, style, (double[]){12, 0}, marker_radius);
    text_add(&mark, "\"/>");
    char *finished = text_take(&mark);
    double next = finished ? plot_key_print(svg, at[0], at[1], finished, name) : at[0];
    svg->failed = svg->failed || !finished;
    free(finished);
    return next;
}

/* A method has one style in all panels: its place among the methods of the first scene, which all
 * scenes share. */
static void add_legend(struct text *svg, const struct work_precision *report, int width)
{
    const struct work_precision_result *list[WORK_PRECISION_SCENES];
    double x = 18, y = 56;
    if (list_scenes(report, list) == 0)
        return;
    for (size_t m = 0; m < list[0]->method_count; m++) {
        const char *name = list[0]->method[m].name;
        double room = 40 + 9.0 * (double)strlen(name);
        if (x + room > width) {
            x = 18;
            y += KEY_ROW;
        }
        x = add_key(svg, m, (double[]){x, y}, name);
    }
}

/* ------------------------------------------------------------------ panels */

struct dot {
    double x, y, low, high;
    bool lost; /* within the noise */
};

/* False = nothing to draw. */
static bool find_dot(const struct panel *panel, const struct work_precision_entry *entry,
                     struct dot *dot)
{
    struct work_precision_value value = entry->value[panel->kind];
    double size = fabs(value.error), bar = value.stderror;
    if (!(entry->cost > 0) || !isfinite(size) || !isfinite(entry->cost))
        return false;
    if (panel->kind == WORK_PRECISION_DENSITY) {
        bar = entry->density_noise / 2;
        size = sqrt(fmax(size * size - 4 * bar * bar, 0));
    }
    bar = isfinite(bar) ? bar : 0;
    dot->lost = !(size > 2 * bar);
    dot->x = entry->cost;
    dot->y = fmax(dot->lost ? size + bar : size, error_least);
    dot->low = dot->lost ? dot->y : size - bar;
    dot->high = fmax(size + bar, error_least);
    return true;
}

static void widen(struct plot_range *range, double v)
{
    range->lo = fmin(range->lo, v);
    range->hi = fmax(range->hi, v);
}

static void add_panel(struct text *svg, struct panel *panel)
{
    const struct work_precision_result *result = panel->result;
    struct plot_points ranges = {.log_x = true, .log_y = true};
    struct dot dot;
    ranges.x = ranges.y = (struct plot_range){INFINITY, -INFINITY};
    for (size_t i = 0; i < result->entry_count; i++) {
        if (!find_dot(panel, &result->entry[i], &dot))
            continue;
        widen(&ranges.x, dot.x);
        widen(&ranges.y, dot.y);
    }
    plot_frame_fit(&panel->frame, &ranges, panel->frame.x.from + 14, 30);
    text_add(svg, "<g class=\"panel\">\n");
    plot_frame_print_x(svg, &panel->frame, 34);
    plot_frame_print_y(svg, &panel->frame);
    for (size_t m = 0; m < result->method_count; m++)
        add_curve(svg, panel, &result->method[m], m);
    plot_frame_print(svg, &panel->frame);
    if (panel->kind == 0)
        plot_line_print(svg,
                        &(struct plot_line){panel->frame.x.from, panel->frame.y.to - 10, 200,
                                            LABEL_SIZE, PLOT_START, "fill=\"" PLOT_INK "\""},
                        result->scene->name);
    text_add(svg, "</g>\n");
}

static void add_curve(struct text *svg, const struct panel *panel,
                      const struct work_precision_method *method, size_t style)
{
    const struct plot_axis *x = &panel->frame.x, *y = &panel->frame.y;
    const char *colour = plot_style_colour(style);
    struct dot dot;
    size_t drawn = 0;
    struct text line = {0}, dots = {0};
    for (size_t i = 0; i < method->count; i++) {
        if (!find_dot(panel, &panel->result->entry[method->first + i], &dot))
            continue;
        double px = plot_axis_pixel(x, dot.x), py = plot_axis_pixel(y, dot.y);
        plot_add_point(&line, drawn++ ? 'L' : 'M', px, py);
        text_add(&dots, "<path d=\"");
        plot_add_point(&dots, 'M', px, plot_axis_pixel(y, dot.low));
        plot_add_point(&dots, 'L', px, plot_axis_pixel(y, dot.high));
        text_add(&dots, "\" stroke=\"%s\"/><path class=\"dot\" stroke=\"%s\" fill=\"%s\" d=\"",
                 colour, colour, dot.lost ? "#ffffff" : colour);
        plot_style_add_marker(&dots, style, (double[]){px, py}, marker_radius);
        text_add(&dots, "\"/>\n");
    }
    char *path = text_take(&line), *marks = text_take(&dots);
    if (drawn > 1 && path)
        text_add(svg,
                 "<path class=\"curve\" d=\"%s\" fill=\"none\" stroke=\"%s\" "
                 "stroke-width=\"1.5\" stroke-dasharray=\"%s\"/>\n",
                 path, colour, plot_style_dash(style));
    if (drawn > 0 && marks)
        text_add(svg, "%s", marks);
    svg->failed = svg->failed || !path || !marks;
    free(path);
    free(marks);
}
