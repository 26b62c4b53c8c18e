/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_map.h - a single number of a sweep's jobs over two axes, as a heat map (SVG): a cell for
 * each pair of values, whatever their distance, its colour the mean over seeds. Cells without a
 * result are hatched, those without a place on a logarithmic scale are dotted; other axes stand at
 * their first value.
 */
#ifndef SWEEP_MAP_H
#define SWEEP_MAP_H

#include "sweep_rows.h"

struct sweep_map;

/* Axes by their pointers ("/potential/amplitude"; "/potential~1amplitude" is understood); x NULL =
 * the first that is fit for it. log: colours go by the logarithm. What cannot be is a fault of the
 * parameters "x" and "y". Borrows the sweep; NULL with no fault = no memory. */
struct sweep_map *sweep_map_create(const struct sweep *sweep, const char *x, const char *y,
                                   bool log, struct bcd_errors *errors);
void sweep_map_free(struct sweep_map *map);

/* Is this a point of the picture? Others need not be added. */
bool sweep_map_wants(const struct sweep_map *map, const struct sweep_point *point);

/* A point with a result; in any order. False: no single number, and no picture of it. */
bool sweep_map_add(struct sweep_map *map, const struct sweep_point *point,
                   const struct bcd_table *table);

/* Malloc'ed text; NULL = out of memory. */
char *sweep_map_print(const struct sweep_map *map, const char *observable);

#endif
