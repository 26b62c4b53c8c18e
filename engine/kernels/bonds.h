/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bonds.h - the noise of a step for rods that stick at contact alone: Baxter's sticky rods on a
 * ring, weight prod_i (dg_i + gamma delta(g_i)) of the gaps g_i.
 *
 * Clusters of bonded rods fly through the step (its length is the unit of time) at velocities that
 * are the means of their rods' normal displacements: a gas of masses 1 per rod with Maxwell's
 * velocities. Deviation of a relative velocity, bond or gap between a and b rods:
 *
 *     s = deviation sqrt(1/a + 1/b)
 *
 * In order of time, whenever clusters meet they stick with probability q, else they are reflected
 * elastically; and every bond breaks at the rate q s / (gamma sqrt(2 pi)), its parts leaving with a
 * relative velocity s sqrt(-2 ln U), the flux of Maxwell's velocities; momentum is kept in all of
 * it. q = min(1, gamma sqrt(2 pi) / s): no bond breaks more than once a step on average. What
 * follows breaks with the masses that are there at its time.
 *
 * Each of these is its own reverse: a bond that breaks at a time t, with a velocity v, is a
 * collision at 1 - t with -v, and gamma (rate) (density of v) = q v (Maxwell's density of v). So
 * the weight above is stationary for any number of rods and any step; not only for a pair. Flight
 * and elastic collisions of single rods are a sort (ring_sort.h).
 *
 * A drift acts as constant acceleration during the flight: of a rod with the drift d, d t^2 at the
 * time t, of a cluster its rods' mean; meeting is the root of a quadratic. Forces that are constant
 * leave the flights reversible and the weight times exp(-U/kT) stationary.
 */
#ifndef KERNELS_BONDS_H
#define KERNELS_BONDS_H

#include "normals.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A stretch of bonded rods, stored at its first rod; `other` at its last rod as well. */
struct bond_cluster {
    double at;       /* y of the first rod at the time `since` */
    double velocity; /* then; in lengths per step */
    double drift;    /* half the acceleration: displacement of a whole step */
    double since;    /* 0 .. 1 */
    int64_t other;   /* last rod at the first, first rod at the last */
};

/* Workspace for n rods, arrays owned by the caller, queued zeroed before the first step. */
struct bond_space {
    struct bond_cluster *clusters; /* [n] */
    double *due;                   /* [n] time of the next event of a gap */
    int64_t *heap;                 /* [n + 1] gaps in order of time, from 1 */
    int64_t *queued;               /* [n] place in the heap, 0 = not in it */
};

struct bond_ring {
    int64_t n;             /* >= 2 */
    double ell;            /* reduced length of the ring, > 0 */
    double *y;             /* [n], in order */
    unsigned char *bonded; /* [n] rods i and i + 1 mod n are bonded: 1, or 0; not all are */
};

struct bond_noise {
    double strength;        /* gamma > 0 */
    double deviation;       /* of one rod's displacement, > 0 */
    const double *velocity; /* [n] the rods' displacements */
    const double *drift;    /* [n] the rods' own displacement by forces; NULL = 0 */
    struct noise_key key;   /* of uniform numbers */
    int64_t tick;
};

/* One step's noise: y and bonds change, bonded rods have bitwise equal y, also across the seam.
 * O(n) + O(events log n); always ends: beyond 64 n + 1024 events all that meet stick. */
void bonds_move(const struct bond_ring *ring, const struct bond_noise *noise,
                const struct bond_space *space);

/* y[i] of bonded rods become the mean of their cluster, bitwise equal also across the seam. */
void bonds_average(const struct bond_ring *ring);

#endif
