/* SPDX-License-Identifier: GPL-3.0-or-later
 * overlap_sweep.c - see overlap_sweep.h. */
#include "overlap_sweep.h"
#include "ring_sort.h"

#include <stdbool.h>

enum { SWEEPS_MAX = 64 }; /* each O(n); a rod that crosses m others needs about m */

/* Every overlapping pair along the line once; did any overlap? */
static bool sweep_line(double *y, int64_t n)
{
    bool any = false;
    double before = y[0];
    for (int64_t i = 1; i < n; i++) {
        double here = y[i];
        bool overlap = before > here;
        y[i - 1] = overlap ? here : before;
        before = overlap ? before : here;
        any |= overlap;
    }
    y[n - 1] = before;
    return any;
}

void sweep_ring(double *y, int64_t n, double ell, double *scratch)
{
    bool any = ell > 0;
    for (int sweep = 0; sweep < SWEEPS_MAX && any; sweep++) {
        any = sweep_line(y, n);
        double last = y[n - 1], next = y[0] + ell;
        if (last > next) { /* the pair across the seam */
            y[n - 1] = next;
            y[0] = last - ell;
            any = true;
        }
    }
    if (any || !(ell > 0))
        ring_sort(y, n, ell, scratch);
}

void sweep_walls(double *y, int64_t n, double low, double high, double *scratch)
{
    bool any = low < high;
    for (int sweep = 0; sweep < SWEEPS_MAX && any; sweep++) {
        any = sweep_line(y, n);
        if (y[0] < low) {
            y[0] = 2 * low - y[0];
            any = true;
        }
        if (y[n - 1] > high) {
            y[n - 1] = 2 * high - y[n - 1];
            any = true;
        }
    }
    if (any || !(low < high))
        reflect_walls(y, n, low, high, scratch);
}
