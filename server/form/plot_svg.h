/* SPDX-License-Identifier: GPL-3.0-or-later
 * plot_svg.h - one table as a picture (SVG 1.1, self-contained): value against x with an error
 * band, theory as a line when there is one; axes, ticks, units, legend. See table_json.h. */
#ifndef PLOT_SVG_H
#define PLOT_SVG_H

#include "bcd.h"

/* title goes above the plot, subtitle (may be NULL) below it in small print: the job's
 * parameters. */
char *plot_svg_print(const struct bcd_table *table, const char *title, const char *subtitle);

#endif
