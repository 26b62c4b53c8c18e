/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * random_ring.h - random rings of rods to test resolvers with: contacts open and closed, also
 * across the seam, far from the origin, with room or without. Tests only.
 */
#ifndef REFERENCE_RANDOM_RING_H
#define REFERENCE_RANDOM_RING_H

#include <stdint.h>

/* A small generator of its own (splitmix64): tests of the noise must not depend on the noise. */
struct dice {
    uint64_t state;
};

double dice_uniform(struct dice *dice); /* in [0, 1) */
double dice_normal(struct dice *dice);

enum displacement_kind {
    DISPLACE_NORMAL, /* independent normal deviates */
    DISPLACE_TIES,   /* small whole numbers: many means are exactly equal */
    DISPLACE_FLOW,   /* a smooth force that gathers rods in one place */
    DISPLACE_KICK,   /* one rod is pushed, all others are left alone */
    DISPLACE_KINDS,
};

struct ring_recipe {
    int n;
    double ell;       /* reduced length of the ring; 0: all rods in contact */
    double origin;    /* about where rod 0 is */
    double closed;    /* probability that a contact is closed */
    double amplitude; /* size of the displacements */
    enum displacement_kind kind;
};

/* Fills y[n] (in order, contacts bitwise equal, y[n-1] <= y[0] + ell) and displacement[n]. */
void random_ring(double *y, double *displacement, const struct ring_recipe *recipe,
                 struct dice *dice);

#endif
