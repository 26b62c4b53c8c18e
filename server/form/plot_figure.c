/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Panels of one size stand in a grid. Axis titles that a whole row or column shares are written
 * once, at its outer side, so that little is left but data.
 */
#include "plot_figure.h"
#include "plot_frame.h"
#include "plot_marks.h"
#include "plot_points.h"
#include "plot_words.h"

#include <stdio.h>
#include <string.h>

/* A panel's cell, and in it the frame; margins of the whole picture. */
enum { CELL_WIDTH = 330, CELL_HEIGHT = 236, FRAME_RIGHT = 312, FRAME_TOP = 34, FRAME_BOTTOM = 200 };
enum { LEFT = 34, TOP = 66, BELOW = 34, TITLE_SIZE = 20, LABEL_SIZE = 15, PANEL_SIZE = 14 };
enum { TICK_SIZE = 12, REMARK_SIZE = 12, LABEL_ROOM = 26, LABEL_GAP = 16 };

static void open_picture(struct text *svg, const struct plot_figure *figure, int width, int height);
static void collect_legend(struct plot_legend *legend, const struct plot_figure *figure);
static void add_legend(struct text *svg, const struct plot_figure *figure);
static void add_axis_titles(struct text *svg, const struct plot_figure *figure, double top);
static bool add_panel(struct text *svg, const struct plot_panel *panel,
                      const struct plot_legend *legend, const double corner[2]);

/* The table that names a panel's axes; NULL = the panel is empty. */
static const struct bcd_table *leading(const struct plot_panel *panel)
{
    return panel->curve_count > 0 ? panel->curves[0].table : panel->table;
}

char *plot_figure_print(const struct plot_figure *figure)
{
    struct text svg = {0};
    const char *subtitle = figure->subtitle ? figure->subtitle : "";
    const double keys[2] = {18, 52};
    struct plot_legend legend = {0};
    int width = LEFT + CELL_WIDTH * (int)figure->columns;
    int lines = plot_small_print(NULL, subtitle, 0, width);
    collect_legend(&legend, figure);
    int first =
        TOP + PLOT_LEGEND_LINE * (plot_legend_print(NULL, &legend, keys, width) - 1);
    int height = first + CELL_HEIGHT * (int)figure->rows + BELOW + (lines ? 15 * lines + 4 : 0);
    open_picture(&svg, figure, width, height);
    if (legend.count)
        plot_legend_print(&svg, &legend, keys, width);
    else
        add_legend(&svg, figure);
    add_axis_titles(&svg, figure, first);
    for (size_t i = 0; i < figure->rows * figure->columns; i++) {
        const double corner[2] = {LEFT + CELL_WIDTH * (double)(i % figure->columns),
                                  first + CELL_HEIGHT * (double)(i / figure->columns)};
        if (leading(&figure->panels[i]) && !add_panel(&svg, &figure->panels[i], &legend, corner))
            svg.failed = true;
    }
    plot_small_print(&svg, subtitle, height - 8 - 15 * (lines - 1), width);
    text_add(&svg, "</svg>\n");
    return text_take(&svg);
}

static void open_picture(struct text *svg, const struct plot_figure *figure, int width, int height)
{
    text_add(svg,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
             "height=\"%d\" role=\"img\" font-family=\"sans-serif\">\n<title>",
             width, height, width, height);
    text_add_xml(svg, figure->title);
    text_add(svg, "</title>\n<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n", width, height);
    plot_line_print(svg,
                    &(struct plot_line){16, 30, width - 32, TITLE_SIZE, PLOT_START,
                                        "font-weight=\"bold\" fill=\"" PLOT_INK "\""},
                    figure->title);
}

static void collect_legend(struct plot_legend *legend, const struct plot_figure *figure)
{
    for (size_t i = 0; i < figure->rows * figure->columns; i++)
        plot_legend_add(legend, figure->panels[i].curves, figure->panels[i].curve_count);
}

static bool has(const struct bcd_table *table, enum bcd_role role)
{
    const struct bcd_column *column = bcd_table_column(table, role);
    return column && column->values;
}

static void add_legend(struct text *svg, const struct plot_figure *figure)
{
    bool errors = false, theory = false, steps = false;
    for (size_t i = 0; i < figure->rows * figure->columns; i++) {
        const struct bcd_table *table = figure->panels[i].table;
        if (!table)
            continue;
        errors = errors || has(table, BCD_ROLE_STDERR);
        theory = theory || has(table, BCD_ROLE_THEORY);
        steps = steps || has(table, BCD_ROLE_TIME_STEP_ERROR);
    }
    double x = plot_key_print(svg, 18, 52, errors ? PLOT_KEY_DOT_BAR : PLOT_KEY_DOT,
                              errors ? "simulation \xC2\xB1 standard error" : "simulation");
    if (steps)
        x = plot_key_print(svg, x, 52, PLOT_KEY_STEP, "time-step error");
    if (theory)
        plot_key_print(svg, x, 52, PLOT_KEY_CURVE, "exact theory");
}

/* ------------------------------------------------------------- axis titles */

/* The title that all panels from `first`, `step` apart, have in common; NULL = none. */
static const char *shared(const struct plot_figure *figure, size_t first, size_t step, size_t count,
                          bool along)
{
    const char *title = NULL;
    for (size_t i = 0; i < count; i++) {
        const struct bcd_table *table = leading(&figure->panels[first + i * step]);
        if (!table)
            continue;
        const char *own = along ? table->x_label : table->y_label[0] ? table->y_label : table->name;
        if (title && strcmp(title, own) != 0)
            return NULL;
        title = own;
    }
    return title;
}

static void add_axis_titles(struct text *svg, const struct plot_figure *figure, double top)
{
    const size_t rows = figure->rows, columns = figure->columns;
    for (size_t row = 0; row < rows; row++) {
        const char *title = shared(figure, row * columns, 1, columns, false);
        double middle = top + CELL_HEIGHT * (double)row + (FRAME_TOP + FRAME_BOTTOM) / 2.0;
        if (!title)
            continue;
        text_add(svg, "<g transform=\"translate(24 %d) rotate(-90)\">\n", (int)middle);
        plot_line_print(svg,
                        &(struct plot_line){0, 0, CELL_HEIGHT - 8, LABEL_SIZE, PLOT_MIDDLE,
                                            "fill=\"" PLOT_INK "\""},
                        title);
        text_add(svg, "</g>\n");
    }
    for (size_t column = 0; column < columns; column++) {
        const char *title = shared(figure, column, columns, rows, true);
        double left = LEFT + CELL_WIDTH * (double)column;
        if (title)
            plot_line_print(
                svg,
                &(struct plot_line){left + (LABEL_GAP + LABEL_ROOM + FRAME_RIGHT) / 2.0,
                                    top + CELL_HEIGHT * (double)rows + 12, CELL_WIDTH - 40,
                                    LABEL_SIZE, PLOT_MIDDLE, "fill=\"" PLOT_INK "\""},
                title);
    }
}

/* ------------------------------------------------------------------ panels */

/* Error bars of what is nowhere negative are cut at 0, so that 0 is the frame's foot. */
static void stand_on_zero(struct plot_points *points)
{
    for (size_t i = 0; i < points->count; i++)
        if (points->point[i].value < 0 || points->point[i].theory < 0)
            return;
    if (points->y.lo < 0 && points->y.hi > 0)
        points->y.lo = 0;
}

/* The axes of a panel, fitted to its points. */
static void add_frame(struct text *svg, const struct plot_panel *panel, struct plot_frame *frame,
                      struct plot_points *points, const double corner[2])
{
    stand_on_zero(points);
    *frame = (struct plot_frame){.tick_size = TICK_SIZE, .x_labels = 6, .y_labels = 4};
    frame->x.to = corner[0] + FRAME_RIGHT;
    frame->y.to = corner[1] + FRAME_TOP;
    frame->y.from = corner[1] + FRAME_BOTTOM;
    plot_frame_fit(frame, points, corner[0] + LABEL_GAP, LABEL_ROOM);
    text_add(svg, "<g class=\"panel\">\n");
    if (points->x.lo <= points->x.hi) {
        plot_frame_print_x(svg, frame, 34);
        plot_frame_print_y(svg, frame);
    } else {
        plot_frame_print_empty(svg, frame, leading(panel));
    }
}

static void close_panel(struct text *svg, const struct plot_panel *panel,
                        const struct plot_frame *frame)
{
    plot_frame_print(svg, frame);
    double room = frame->x.to - frame->x.from;
    if (panel->title)
        plot_line_print(svg,
                        &(struct plot_line){frame->x.from, frame->y.to - 10, room, PANEL_SIZE,
                                            PLOT_START, "fill=\"" PLOT_INK "\""},
                        panel->title);
    if (panel->remark)
        plot_line_print(svg,
                        &(struct plot_line){frame->x.to, frame->y.to - 10, room / 2, REMARK_SIZE,
                                            PLOT_END, "fill=\"" PLOT_PALE "\""},
                        panel->remark);
    text_add(svg, "</g>\n");
}

static bool add_curves(struct text *svg, const struct plot_panel *panel,
                       const struct plot_legend *legend, const double corner[2])
{
    struct plot_curves curves;
    struct plot_frame frame;
    if (!plot_curves_init(&curves, panel->curves, panel->curve_count))
        return false;
    add_frame(svg, panel, &frame, &curves.all, corner);
    if (curves.all.x.lo <= curves.all.x.hi)
        plot_curves_print(svg, &curves, legend, (struct plot_axis[]){frame.x, frame.y});
    if (panel->guides)
        plot_guides_print(svg, &curves.all, &frame.x, &frame.y);
    close_panel(svg, panel, &frame);
    plot_curves_fini(&curves);
    return true;
}

static bool add_panel(struct text *svg, const struct plot_panel *panel,
                      const struct plot_legend *legend, const double corner[2])
{
    struct plot_points points;
    struct plot_frame frame;
    if (panel->curve_count > 0)
        return add_curves(svg, panel, legend, corner);
    if (!plot_points_init(&points, panel->table))
        return false;
    add_frame(svg, panel, &frame, &points, corner);
    if (points.x.lo <= points.x.hi)
        plot_dots_print(svg, &points, &frame.x, &frame.y);
    close_panel(svg, panel, &frame);
    plot_points_fini(&points);
    return true;
}
