/* SPDX-License-Identifier: GPL-3.0-or-later
 * lu.h - small dense real linear systems, by LU with partial pivoting; plain arrays.
 *
 * Own code rather than GSL's, because a singular matrix is an ordinary event here (inverse
 * iteration is at its best next to one) and GSL calls its error handler for it. A vanishing pivot
 * is replaced by the rounding level of the matrix. */
#ifndef THEORY_LU_H
#define THEORY_LU_H

#include <stddef.h>

/* Overwrites a [n][n] with its factors; pivot [n]. */
void lu_factor(size_t n, double *a, size_t *pivot);
/* b := a^-1 b, and b := a^-T b. */
void lu_solve(size_t n, const double *a, const size_t *pivot, double *b);
void lu_solve_transposed(size_t n, const double *a, const size_t *pivot, double *b);

#endif
