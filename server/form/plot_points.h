/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plot_points.h - the rows of a table as points that can be drawn: cleaned of what a plot cannot
 * show, thinned out when there are too many, and the range they span.
 */
#ifndef PLOT_POINTS_H
#define PLOT_POINTS_H

#include "bcd.h"

enum { PLOT_POINTS_MAX = 2000, PLOT_BARS_MAX = 150 };

/* NaN = nothing to draw there. */
struct plot_point {
    double x, value;
    double low, high;           /* value -+ one standard error */
    double step_low, step_high; /* value -+ its time-step error */
    double theory;
};

struct plot_range {
    double lo, hi; /* lo > hi = empty */
};

struct plot_points {
    struct plot_point *point;
    size_t count;
    bool log_x, log_y;
    bool bars;                  /* x are the integers 1, 2, 3, ...: to be drawn as bars */
    bool errors, steps, theory; /* there is at least one of them */
    struct plot_range x, y;
};

/* Fills *points from the table; false = out of memory. */
bool plot_points_init(struct plot_points *points, const struct bcd_table *table);

/* The same for one curve among others: `rows` rows from `first` on, never bars, thinned out to
 * about `most` points (a few at least). */
struct plot_rows {
    const struct bcd_table *table;
    size_t first, rows;
};
bool plot_points_init_curve(struct plot_points *points, const struct plot_rows *rows, size_t most);

/* Widens the range, empty or not, so that it holds v; NaN changes nothing. */
void plot_range_include(struct plot_range *range, double v);
void plot_points_fini(struct plot_points *points);

#endif
