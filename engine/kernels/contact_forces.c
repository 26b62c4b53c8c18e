/* SPDX-License-Identifier: GPL-3.0-or-later
 * contact_forces.c - see contact_forces.h. */
#include "contact_forces.h"

#include <math.h>

/* What is asked for. */
struct pushes {
    const struct lane *lane;
    const double *z, *y;
    double scale, *force;
};

/* Mean of z - y over rods first .. last: a free cluster moves by it, so that only rounding is
 * left. */
static double common(const struct pushes *p, int64_t first, int64_t last)
{
    double sum = p->z[last] - p->y[last], count = 1;
    for (int64_t i = first; i != last; i = lane_next(p->lane, i), count++)
        sum += p->z[i] - p->y[i];
    return sum / count;
}

static void add_up_from_left(const struct pushes *p, int64_t first, int64_t last, double shared)
{
    double push = 0;
    for (int64_t i = first; i != last; i = lane_next(p->lane, i)) {
        push += p->z[i] - p->y[i] - shared;
        p->force[i] = p->scale * fmax(push, 0); /* < 0: rounding */
    }
    p->force[last] = 0;
}

static void add_up_from_right(const struct pushes *p, int64_t first, int64_t last)
{
    double push = 0;
    p->force[last] = 0;
    for (int64_t i = last; i != first; i--) {
        push += p->y[i] - p->z[i];
        p->force[i - 1] = p->scale * fmax(push, 0);
    }
}

/* All contacts are closed; between walls those with the walls, too. */
static void push_without_room(const struct pushes *p)
{
    int64_t n = p->lane->n, contacts = p->lane->walls ? n - 1 : n;
    double shared = p->lane->walls ? 0 : common(p, 0, n - 1), push = 0, least = 0;
    for (int64_t i = 0; i < n; i++) {
        push += p->z[i] - p->y[i] - shared;
        p->force[i] = push;
        least = fmin(least, push);
    }
    for (int64_t i = 0; i < n; i++)
        p->force[i] = i < contacts ? p->scale * (p->force[i] - least) : 0;
}

static void push_within(const struct pushes *p, int64_t first, int64_t last)
{
    const struct lane *lane = p->lane;
    if (lane->walls && p->y[first] <= lane->low)
        add_up_from_right(p, first, last);
    else if (lane->walls && p->y[last] >= lane->low + lane->ell)
        add_up_from_left(p, first, last, 0);
    else
        add_up_from_left(p, first, last, common(p, first, last));
}

void contact_forces(const struct lane *lane, const double *z, const double *y, double scale,
                    double *force)
{
    const struct pushes pushes = {lane, z, y, scale, force};
    int64_t start = lane_start(lane, y);
    bool filled = lane->walls && y[0] <= lane->low && y[0] >= lane->low + lane->ell;
    if (start < 0 || filled) {
        push_without_room(&pushes);
        return;
    }
    int64_t first = start;
    do {
        int64_t last = first;
        while (lane_contact(lane, y, last))
            last = lane_next(lane, last);
        push_within(&pushes, first, last);
        first = lane_next(lane, last);
    } while (first != start);
}
