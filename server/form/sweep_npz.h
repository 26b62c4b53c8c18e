/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_npz.h - an observable of a whole sweep as numpy's archive of arrays (numpy.lib.format 1.0
 * in a zip): "job" and "state" [points], an array for each axis [points], named as filters are
 * ("potential.amplitude"), one for each column [points] or [points][rows], NaN where there is no
 * number. Written front to back in as many passes over the points as there are columns, so that
 * nothing but an index of the points is held.
 */
#ifndef SWEEP_NPZ_H
#define SWEEP_NPZ_H

#include "sweep_rows.h"

struct sweep_npz;

/* Borrows the sweep. NULL = no memory. */
struct sweep_npz *sweep_npz_create(const struct sweep *sweep, size_t points);
void sweep_npz_free(struct sweep_npz *npz);

/* The caller hands in all points in order, again and again, until sweep_npz_ended; table is NULL
 * for those without a result. In the first pass (*text may stay empty) they become known. What a
 * point has to be in later passes, it has been in the first: a table that came meanwhile does not
 * count. */
void sweep_npz_add(struct sweep_npz *npz, struct text *text, const struct sweep_point *point,
                   const struct bcd_table *table);

/* After the last point of a pass. */
void sweep_npz_end_pass(struct sweep_npz *npz, struct text *text);
bool sweep_npz_ended(const struct sweep_npz *npz);

#endif
