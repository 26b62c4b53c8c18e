/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_plot.h - an observable of a sweep as a family of curves (SVG): each curve belongs to a
 * value of one axis. Lists of numbers go along their own x; single numbers along a second axis.
 * Jobs that differ in seed alone are averaged; other axes stand at their first value.
 */
#ifndef SWEEP_PLOT_H
#define SWEEP_PLOT_H

#include "sweep_rows.h"

struct sweep_plot;

/* Which axes: pointers, NULL = the first that is fit for it. Single numbers ("energy") go along
 * `along`; of lists that is left out. What cannot be is a fault of the parameters "x" and "curves".
 * Borrows the sweep; NULL with no fault = no memory. */
struct sweep_plot *sweep_plot_create(const struct sweep *sweep, const char *along,
                                     const char *curves, struct bcd_errors *errors);
void sweep_plot_free(struct sweep_plot *plot);

/* Is this a point of the picture? Others need not be added. */
bool sweep_plot_wants(const struct sweep_plot *plot, const struct sweep_point *point);

/* A point with a result; in any order. */
void sweep_plot_add(struct sweep_plot *plot, const struct sweep_point *point,
                    const struct bcd_table *table);

/* Malloc'ed text; NULL = out of memory. */
char *sweep_plot_print(const struct sweep_plot *plot, const char *observable);

#endif
