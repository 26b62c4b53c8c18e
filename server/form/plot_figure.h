/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plot_figure.h - several tables as the panels of one picture (SVG 1.1, self-contained): measured
 * values as points with error bars, theory as a line, each panel with axes of its own; one legend
 * for all. A panel may also hold several curves, told apart by plot_curves.h.
 */
#ifndef PLOT_FIGURE_H
#define PLOT_FIGURE_H

#include "plot_curves.h"

struct plot_panel {
    const struct bcd_table *table; /* not a scalar; NULL = the place stays empty */
    const char *title;             /* above the panel; NULL = none */
    const char *remark;            /* beside the title, in small print; NULL = none */
    const struct plot_curve *curves; /* instead of the table: axes as the first curve's table has */
    size_t curve_count;
    bool guides; /* beside curves, log-log: thin lines of slope 1 and 1/2 */
};

struct plot_figure {
    const char *title;
    const char *subtitle; /* below everything, in small print; NULL = none */
    size_t rows, columns; /* 1 or more each */
    const struct plot_panel *panels; /* [rows][columns] */
};

/* Malloc'ed text; NULL = out of memory. */
char *plot_figure_print(const struct plot_figure *figure);

#endif
