/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * ring_sort_marked.h - ring_sort.h for rods that carry a number with them: each free path keeps its
 * mark while rods that cross swap their roles. A path mirrored at a wall has its mark mirrored too,
 * as a velocity has.
 */
#ifndef KERNELS_RING_SORT_MARKED_H
#define KERNELS_RING_SORT_MARKED_H

#include <stdbool.h>
#include <stdint.h>

struct marked_rods {
    double *y, *mark; /* [count] each, in and out */
    int64_t count;
    double *scratch; /* [2 * count] */
};

/* y becomes what ring_sort makes of it, bit for bit; mark[i] is that of the path that ends as rod
 * i. Of paths that end in the same point, which is whose is left open but always the same. ell = 0:
 * one rigid body, marks stay where they are. O(n) for small displacements, O(n log n) for large
 * ones. */
void ring_sort_marked(const struct marked_rods *rods, double ell);

/* The same between walls, as reflect_walls; marks change sign with every reflection. low == high:
 * all rods there, marks stay. */
void reflect_walls_marked(const struct marked_rods *rods, double low, double high);

/* In parts, as in ring_sort.h: `part` is of rods that have a place of their own in y, mark and
 * scratch; scratch of the whole is not needed to join. */
void ring_sort_marked_part(const struct marked_rods *part);
bool ring_sort_marked_join(const struct marked_rods *rods, int64_t at, int64_t end);
void ring_sort_marked_close(const struct marked_rods *rods, double ell);
void reflect_marked_part(const struct marked_rods *part, double low, double high);

#endif
