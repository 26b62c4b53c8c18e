/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plot_marks.h - what is drawn inside a plot's frame: bands, lines, points, bars. All of it stays
 * between the ends of its axes.
 */
#ifndef PLOT_MARKS_H
#define PLOT_MARKS_H

#include "plot_axis.h"
#include "plot_points.h"
#include "text.h"

#define PLOT_BLUE "#0072B2"
#define PLOT_RED "#D55E00"

#define PLOT_STYLE_THEORY                                                                          \
    "fill=\"none\" stroke=\"" PLOT_RED "\" stroke-width=\"2\" stroke-dasharray=\"8 4\""

#define PLOT_STYLE_CURVE                                                                           \
    "fill=\"none\" stroke=\"" PLOT_RED "\" stroke-width=\"1.8\" stroke-linejoin=\"round\""

/* Samples for the legend, 24 pixels wide about y = 0. */
#define PLOT_KEY_VALUE                                                                             \
    "<path d=\"M0 0H24\" stroke=\"" PLOT_BLUE "\" stroke-width=\"2\"/>"                            \
    "<circle cx=\"12\" r=\"3\" fill=\"" PLOT_BLUE "\"/>"
#define PLOT_KEY_BAR                                                                               \
    "<rect x=\"5\" y=\"-6\" width=\"14\" height=\"12\" fill=\"" PLOT_BLUE "\" "                    \
                                                                          "fill-opacity=\".6\"/>"
#define PLOT_KEY_BAND                                                                              \
    "<rect y=\"-6\" width=\"24\" height=\"12\" fill=\"" PLOT_BLUE "\" fill-opacity=\".25\"/>"
#define PLOT_KEY_WHISKER                                                                           \
    "<path d=\"M2 -4V4M2 0H22M22 -4V4\" stroke=\"" PLOT_BLUE "\" stroke-width=\"1.5\"/>"
#define PLOT_KEY_STEP "<rect x=\"9\" y=\"-7\" width=\"6\" height=\"14\" fill=\"#bdbdbd\"/>"
#define PLOT_KEY_DOT "<circle cx=\"12\" r=\"3\" fill=\"" PLOT_BLUE "\"/>"
#define PLOT_KEY_DOT_BAR                                                                           \
    "<path d=\"M12 -8V8M9 -8H15M9 8H15\" stroke=\"" PLOT_BLUE "\"/>" PLOT_KEY_DOT
#define PLOT_KEY_CURVE "<path d=\"M0 0H24\" " PLOT_STYLE_CURVE "/>"
#define PLOT_KEY_THEORY "<path d=\"M0 0H24\" " PLOT_STYLE_THEORY "/>"

/* A pixel, to a hundredth; never depends on the locale. And one step of a path. */
void plot_add_pixel(struct text *svg, double v);
void plot_add_point(struct text *svg, char command, double x, double y);

/* A vertical stroke at pixel at[0] from at[1] to at[2], with a little foot at both ends. */
void plot_add_whisker(struct text *svg, const double at[3], double foot);

/* The points of a table, and (log-log only) thin lines of slope 1 and 1/2 beside them. */
void plot_marks_print(struct text *svg, const struct plot_points *points, const struct plot_axis *x,
                      const struct plot_axis *y);
void plot_guides_print(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y);

/* The same points the way small panels want them: theory as a full line, over it the values as
 * single points with error bars. Bars stay bars. */
void plot_dots_print(struct text *svg, const struct plot_points *points, const struct plot_axis *x,
                     const struct plot_axis *y);

/* One value along x, at the height `y`. */
void plot_scalar_print(struct text *svg, const struct plot_point *point, const struct plot_axis *x,
                       double y);

#endif
