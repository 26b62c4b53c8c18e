/* SPDX-License-Identifier: GPL-3.0-or-later
 * plot_frame.h - two axes fitted to points, with ticks, labels, grid and the frame's two lines. */
#ifndef PLOT_FRAME_H
#define PLOT_FRAME_H

#include "plot_axis.h"
#include "plot_points.h"
#include "text.h"

struct plot_frame {
    struct plot_axis x, y;
    struct plot_ticks x_ticks, y_ticks;
    int tick_size;          /* of the labels' font, pixels */
    int x_labels, y_labels; /* about how many */
};

/* Fits both axes to the points. Given: y.from (bottom), y.to (top), x.to (right), tick_size and how
 * many labels. x.from becomes `left` plus the width of the labels beside the y axis, but at least
 * `room`, so that frames above one another can stand in line. */
void plot_frame_fit(struct plot_frame *frame, const struct plot_points *points, double left,
                    double room);

/* Ticks of x alone, only as many labels as fit beside one another. */
void plot_frame_tick_x(struct plot_frame *frame);

/* Grid, ticks and labels: along x, with the power of ten that the labels share `drop` below the
 * frame; and along y. Then the frame's own two lines. */
void plot_frame_print_x(struct text *svg, const struct plot_frame *frame, double drop);
void plot_frame_print_y(struct text *svg, const struct plot_frame *frame);
void plot_frame_print(struct text *svg, const struct plot_frame *frame);

/* "no data" in the middle of the frame, and the reason if there is one. */
void plot_frame_print_empty(struct text *svg, const struct plot_frame *frame,
                            const struct bcd_table *table);

/* A straight line between two points; `style` are further attributes. */
void plot_segment_print(struct text *svg, const double from[2], const double to[2],
                        const char *style);

#endif
