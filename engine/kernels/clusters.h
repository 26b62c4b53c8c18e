/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * clusters.h - clusters of rods as the papers on Brownian cluster dynamics tell them: what the
 * event by event form (chronological.h) and the premerging form (premerging.h) have in common.
 *
 * A lane holds n rods in reduced coordinates: on a ring y[0] <= ... <= y[n-1] <= y[0] + ell;
 * between walls low <= y[0] <= ... <= y[n-1] <= low + ell. Equal numbers mean contact, across the
 * seam y[n-1] == y[0] + ell. A step is the unit of time: the displacement z - y of a rod left alone
 * is its velocity, and is to its force as the mobility times the time step.
 */
#ifndef KERNELS_CLUSTERS_H
#define KERNELS_CLUSTERS_H

#include <stdbool.h>
#include <stdint.h>

struct lane {
    int64_t n;  /* >= 1 */
    double ell; /* reduced length, >= 0 */
    bool walls;
    double low; /* of walls */
};

/* Rods first, first + 1, .. last, counted round the ring: last < first when the cluster goes across
 * the seam. Its rods before the seam are at `at`, those behind it at `at` - ell. */
struct cluster {
    int64_t first, last;
    double sum;      /* of the velocities of its rods */
    double velocity; /* their mean */
    double at, when; /* position at a time of 0 .. 1 */
};

static inline int64_t lane_next(const struct lane *lane, int64_t i)
{
    return i + 1 < lane->n ? i + 1 : 0;
}

static inline int64_t lane_previous(const struct lane *lane, int64_t i)
{
    return i > 0 ? i - 1 : lane->n - 1;
}

/* Is rod i in contact with the next one round the ring? A rod is no neighbour of itself. */
static inline bool lane_contact(const struct lane *lane, const double *y, int64_t i)
{
    if (i + 1 < lane->n)
        return y[i] == y[i + 1];
    return lane->n > 1 && !lane->walls && y[i] == y[0] + lane->ell;
}

/* The least rod that begins a cluster; -1 = all are in contact all the way round. */
int64_t lane_start(const struct lane *lane, const double *y);

/* All rods are in contact and there is no room: z becomes the step of a rigid body. y: [n], where
 * it stands. */
void lane_move_rigid(const struct lane *lane, const double *y, double *z);

/* y: [n], in order but for rounding, becomes so to the last bit. Between walls rods beyond them
 * come to stand at them: positions in order, then cut off at both ends, are the nearest ones
 * within. */
void lane_settle(const struct lane *lane, double *y);

static inline bool cluster_crosses_seam(const struct cluster *c)
{
    return c->last < c->first;
}

static inline double cluster_count(const struct lane *lane, const struct cluster *c)
{
    return (double)(c->last - c->first + 1 + (cluster_crosses_seam(c) ? lane->n : 0));
}

/* Position at a time >= when. */
static inline double cluster_at(const struct cluster *c, double time)
{
    return c->at + c->velocity * (time - c->when);
}

/* What is added to positions of b, the cluster right of a, to compare them with those of a. */
static inline double cluster_offset(const struct lane *lane, const struct cluster *a,
                                    const struct cluster *b)
{
    return b->first == 0 || cluster_crosses_seam(a) ? lane->ell : 0;
}

/* Rod i, displaced from y[i] to z[i] in a step. */
static inline struct cluster cluster_of_one(const double *y, const double *z, int64_t i)
{
    double moved = z[i] - y[i];
    return (struct cluster){.first = i, .last = i, .sum = moved, .velocity = moved, .at = y[i]};
}

/* b, the cluster right of a, joins it: the centre of mass and its motion are kept (doi
 * 10.1103/PhysRevE.106.054606, Eqs. 13-19). Both at the same time. */
static inline void cluster_join(const struct lane *lane, struct cluster *a, const struct cluster *b)
{
    double count = cluster_count(lane, a), more = cluster_count(lane, b);
    a->at += (b->at + cluster_offset(lane, a, b) - a->at) * (more / (count + more));
    a->sum += b->sum;
    a->velocity = a->sum / (count + more);
    a->last = b->last;
}

/* Its rods go to where it is at the end of the step: out[first .. last]. */
void cluster_write(const struct lane *lane, const struct cluster *c, double *out);

#endif
