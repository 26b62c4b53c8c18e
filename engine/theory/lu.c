/* SPDX-License-Identifier: GPL-3.0-or-later
 * lu.c - see lu.h. */
#include <float.h>
#include <math.h>

#include "lu.h"

static void swap_rows(size_t n, double *a, double *b)
{
    for (size_t j = 0; j < n; j++) {
        double keep = a[j];
        a[j] = b[j];
        b[j] = keep;
    }
}

void lu_factor(size_t n, double *a, size_t *pivot)
{
    double largest = 0;
    for (size_t i = 0; i < n * n; i++) {
        largest = fabs(a[i]) > largest ? fabs(a[i]) : largest;
    }
    double least = largest > 0 ? largest * DBL_EPSILON : 1;
    for (size_t k = 0; k < n; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < n; i++) {
            best = fabs(a[i * n + k]) > fabs(a[best * n + k]) ? i : best;
        }
        pivot[k] = best;
        if (best != k) {
            swap_rows(n, a + k * n, a + best * n);
        }
        if (fabs(a[k * n + k]) < least * DBL_EPSILON) {
            a[k * n + k] = least;
        }
        for (size_t i = k + 1; i < n; i++) {
            double factor = a[i * n + k] /= a[k * n + k];
            double *restrict row = a + i * n;
            const double *restrict top = a + k * n;
            for (size_t j = k + 1; j < n; j++) {
                row[j] -= factor * top[j];
            }
        }
    }
}

void lu_solve(size_t n, const double *a, const size_t *pivot, double *b)
{
    for (size_t k = 0; k < n; k++) {
        double keep = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = keep;
    }
    for (size_t i = 1; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            b[i] -= a[i * n + j] * b[j];
        }
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t j = i + 1; j < n; j++) {
            b[i] -= a[i * n + j] * b[j];
        }
        b[i] /= a[i * n + i];
    }
}

void lu_solve_transposed(size_t n, const double *a, const size_t *pivot, double *b)
{
    for (size_t i = 0; i < n; i++) {
        b[i] /= a[i * n + i];
        for (size_t j = i + 1; j < n; j++) {
            b[j] -= a[i * n + j] * b[i];
        }
    }
    for (size_t i = n; i-- > 1;) {
        for (size_t j = 0; j < i; j++) {
            b[j] -= a[i * n + j] * b[i];
        }
    }
    for (size_t k = n; k-- > 0;) {
        double keep = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = keep;
    }
}
