/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "plot_frame.h"
#include "plot_marks.h"
#include "plot_words.h"

#include <math.h>

enum { EMPTY_SIZE = 18 };

#define GRID "#e4e4e4"

static double widest(const struct plot_ticks *ticks, int size);
static void add_tick_label(struct text *svg, const struct plot_tick *tick, const double at[2],
                           const char *anchor, int size);
static void add_factor(struct text *svg, const struct plot_ticks *ticks, const double at[2],
                       int size);

void plot_frame_fit(struct plot_frame *frame, const struct plot_points *points, double left,
                    double room)
{
    bool empty = points->x.lo > points->x.hi || points->y.lo > points->y.hi;
    struct plot_range rx = empty ? (struct plot_range){1, 10} : points->x;
    struct plot_range ry = empty ? (struct plot_range){1, 10} : points->y;
    frame->x.log = points->log_x;
    frame->y.log = points->log_y;
    plot_axis_fit(&frame->y, ry.lo, ry.hi, points->bars ? PLOT_FIT_BARS : PLOT_FIT_ACROSS);
    plot_axis_ticks(&frame->y, frame->y_labels, &frame->y_ticks);
    if (points->bars) {
        frame->x.min = rx.lo;
        frame->x.max = rx.hi;
    } else {
        plot_axis_fit(&frame->x, rx.lo, rx.hi, PLOT_FIT_ALONG);
    }
    frame->x.from = left + fmax(widest(&frame->y_ticks, frame->tick_size), room);
    /* Bars are labelled by whole numbers only: never more labels than bars. */
    if (points->bars && points->count < (size_t)frame->x_labels)
        frame->x_labels = (int)points->count;
    plot_frame_tick_x(frame);
}

void plot_frame_tick_x(struct plot_frame *frame)
{
    struct plot_ticks *ticks = &frame->x_ticks;
    size_t labels;
    int wanted = frame->x_labels;
    do {
        plot_axis_ticks(&frame->x, wanted, ticks);
        labels = 0;
        for (size_t i = 0; i < ticks->count; i++)
            labels += ticks->tick[i].major;
    } while ((double)labels * (widest(ticks, frame->tick_size) + 14) >
                 fabs(frame->x.to - frame->x.from) &&
             --wanted > 1);
}

void plot_frame_print_x(struct text *svg, const struct plot_frame *frame, double drop)
{
    const struct plot_axis *y = &frame->y;
    for (size_t i = 0; i < frame->x_ticks.count; i++) {
        const struct plot_tick *tick = &frame->x_ticks.tick[i];
        double at = plot_axis_pixel(&frame->x, tick->at);
        if (tick->major)
            plot_segment_print(svg, (double[]){at, y->from}, (double[]){at, y->to},
                               "stroke=\"" GRID "\"");
        plot_segment_print(svg, (double[]){at, y->from},
                           (double[]){at, y->from + (tick->major ? 6 : 3)},
                           "stroke=\"" PLOT_INK "\"");
        if (tick->major)
            add_tick_label(svg, tick, (double[]){at, y->from + frame->tick_size + 8}, "middle",
                           frame->tick_size);
    }
    add_factor(svg, &frame->x_ticks, (double[]){frame->x.to, y->from + drop}, frame->tick_size);
}

void plot_frame_print_y(struct text *svg, const struct plot_frame *frame)
{
    const struct plot_axis *x = &frame->x;
    for (size_t i = 0; i < frame->y_ticks.count; i++) {
        const struct plot_tick *tick = &frame->y_ticks.tick[i];
        double at = plot_axis_pixel(&frame->y, tick->at);
        if (tick->major)
            plot_segment_print(svg, (double[]){x->from, at}, (double[]){x->to, at},
                               "stroke=\"" GRID "\"");
        plot_segment_print(svg, (double[]){x->from - (tick->major ? 6 : 3), at},
                           (double[]){x->from, at}, "stroke=\"" PLOT_INK "\"");
        if (tick->major)
            add_tick_label(svg, tick, (double[]){x->from - 9, at + 4.5}, "end", frame->tick_size);
    }
    add_factor(svg, &frame->y_ticks, (double[]){x->from - 9, frame->y.to - 12}, frame->tick_size);
}

void plot_frame_print(struct text *svg, const struct plot_frame *frame)
{
    text_add(svg, "<path class=\"frame\" d=\"");
    plot_add_point(svg, 'M', frame->x.from, frame->y.to);
    plot_add_point(svg, 'L', frame->x.from, frame->y.from);
    plot_add_point(svg, 'L', frame->x.to, frame->y.from);
    text_add(svg, "\" fill=\"none\" stroke=\"" PLOT_INK "\"/>\n");
}

void plot_frame_print_empty(struct text *svg, const struct plot_frame *frame,
                            const struct bcd_table *table)
{
    const struct plot_axis *x = &frame->x, *y = &frame->y;
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const char *reason = value && !value->values ? value->reason : "";
    double middle = (x->from + x->to) / 2;
    struct plot_line line = {middle, (y->from + y->to) / 2, x->to - x->from - 20, EMPTY_SIZE,
                             PLOT_MIDDLE, "fill=\"" PLOT_PALE "\""};
    plot_line_print(svg, &line, "no data");
    line.y += 24;
    line.size = frame->tick_size;
    if (reason[0])
        plot_line_print(svg, &line, reason);
}

void plot_segment_print(struct text *svg, const double from[2], const double to[2],
                        const char *style)
{
    static const char *const names[] = {"x1", "y1", "x2", "y2"};
    const double v[] = {from[0], from[1], to[0], to[1]};
    text_add(svg, "<line");
    for (size_t i = 0; i < 4; i++) {
        text_add(svg, " %s=\"", names[i]);
        plot_add_pixel(svg, v[i]);
        text_add(svg, "\"");
    }
    text_add(svg, " %s/>\n", style);
}

static double widest(const struct plot_ticks *ticks, int size)
{
    double width = 0;
    for (size_t i = 0; i < ticks->count; i++)
        if (ticks->tick[i].major)
            width = fmax(width, plot_tick_width(&ticks->tick[i], size));
    return width;
}

static void add_tick_label(struct text *svg, const struct plot_tick *tick, const double at[2],
                           const char *anchor, int size)
{
    text_add(svg, "<text x=\"");
    plot_add_pixel(svg, at[0]);
    text_add(svg, "\" y=\"");
    plot_add_pixel(svg, at[1]);
    text_add(svg, "\" font-size=\"%d\" text-anchor=\"%s\" fill=\"" PLOT_INK "\">", size, anchor);
    plot_tick_print(tick, size, svg);
    text_add(svg, "</text>\n");
}

/* The power of ten that all labels of an axis share, at the axis's end. */
static void add_factor(struct text *svg, const struct plot_ticks *ticks, const double at[2],
                       int size)
{
    struct plot_tick factor = {.power = true, .exponent = ticks->exponent, .text = "\xC3\x97 10"};
    if (ticks->exponent != 0)
        add_tick_label(svg, &factor, at, "end", size);
}
