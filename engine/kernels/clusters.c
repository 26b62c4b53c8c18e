/* SPDX-License-Identifier: GPL-3.0-or-later
 * clusters.c - see clusters.h. */
#include "clusters.h"

int64_t lane_start(const struct lane *lane, const double *y)
{
    if (!lane_contact(lane, y, lane->n - 1))
        return 0;
    for (int64_t i = 0; i + 1 < lane->n; i++)
        if (y[i] != y[i + 1])
            return i + 1;
    return -1;
}

void lane_move_rigid(const struct lane *lane, const double *y, double *z)
{
    double sum = 0;
    for (int64_t i = 0; i < lane->n; i++)
        sum += z[i] - y[i];
    double at = y[0] + sum / (double)lane->n;
    for (int64_t i = 0; i < lane->n; i++)
        z[i] = at;
}

void lane_settle(const struct lane *lane, double *y)
{
    int64_t n = lane->n;
    for (int64_t i = 1; i < n; i++)
        if (y[i] < y[i - 1])
            y[i] = y[i - 1];
    double high = (lane->walls ? lane->low : y[0]) + lane->ell;
    for (int64_t i = n - 1; i >= 0 && y[i] > high; i--)
        y[i] = high;
    for (int64_t i = 0; lane->walls && i < n && y[i] < lane->low; i++)
        y[i] = lane->low;
}

void cluster_write(const struct lane *lane, const struct cluster *c, double *out)
{
    double end = cluster_at(c, 1);
    if (!cluster_crosses_seam(c)) {
        for (int64_t i = c->first; i <= c->last; i++)
            out[i] = end;
        return;
    }
    /* The position behind the seam is rounded first, the other made from it: contact is bitwise. */
    double head = end - lane->ell, tail = head + lane->ell;
    for (int64_t i = c->first; i < lane->n; i++)
        out[i] = tail;
    for (int64_t i = 0; i <= c->last; i++)
        out[i] = head;
}
