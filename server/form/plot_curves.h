/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plot_curves.h - several curves between one pair of axes. Each has a colour, a marker and a dash
 * of its own, so that none has to be told by its colour alone; measured values have error bars and,
 * where there is theory, stand alone on its line. Beyond PLOT_STYLES there is no telling apart:
 * thin lines without a legend.
 */
#ifndef PLOT_CURVES_H
#define PLOT_CURVES_H

#include "plot_axis.h"
#include "plot_points.h"
#include "text.h"

enum { PLOT_STYLES = 12, PLOT_LABEL_SIZE = 64 };

/* The look of the style-th curve: no two of PLOT_STYLES share their colour, nor both marker and
 * dash. A dash is the value of stroke-dasharray, a marker a closed piece of a path's d. */
const char *plot_style_colour(size_t style);
const char *plot_style_dash(size_t style);
void plot_style_add_marker(struct text *svg, size_t style, const double at[2], double radius);

/* Some rows of a table by the roles of its columns, borrowed. rows == 0: the whole table. */
struct plot_curve {
    const struct bcd_table *table; /* not a scalar */
    size_t first, rows;
    const char *label; /* equal labels, in all panels of a picture, get equal looks */
};

/* The labels of a picture, in the order in which they came up. */
struct plot_legend {
    size_t count;
    const char *label[PLOT_STYLES];
    bool crowded; /* there were more: none is shown */
    bool theory;
};
void plot_legend_add(struct plot_legend *legend, const struct plot_curve *curve, size_t count);

/* Entries beside and below one another between at[0] and `right`, the first line about at[1].
 * Draws when svg is given; returns the number of lines. */
enum { PLOT_LEGEND_LINE = 18 };
int plot_legend_print(struct text *svg, const struct plot_legend *legend, const double at[2],
                      double right);

/* Curves ready to be drawn. */
struct plot_curves {
    const struct plot_curve *curve; /* borrowed */
    size_t count;
    struct plot_points *each; /* [count] */
    struct plot_points all;   /* of all curves together: what axes are fitted to */
};
bool plot_curves_init(struct plot_curves *curves, const struct plot_curve *curve, size_t count);
void plot_curves_fini(struct plot_curves *curves);
void plot_curves_print(struct text *svg, const struct plot_curves *curves,
                       const struct plot_legend *legend, const struct plot_axis axes[2]);

/* The curves that a table with a column BCD_ROLE_SERIES holds: "rod 3". */
struct plot_series {
    size_t count;
    struct plot_curve *curve;
    char label[PLOT_STYLES + 1][PLOT_LABEL_SIZE]; /* further ones share the last, which is empty */
};
bool plot_series_in(const struct bcd_table *table);
bool plot_series_init(struct plot_series *series, const struct bcd_table *table);
void plot_series_fini(struct plot_series *series);

#endif
