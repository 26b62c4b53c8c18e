/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * central.h - what all pair interactions V(r) with a cutoff share: checks, the loop over k-th
 * neighbours, stiffness and the door to exact theory. A type gives its law and its rows; the slots
 * of its table are the functions below, for par begins with struct central.
 *
 * V is shifted so that V(cutoff) = 0; the force is that of V, cut at the cutoff. All pairs closer
 * than the cutoff act on each other, on a ring also across the seam, each pair once.
 *
 * NEAREST  Where repulsion grows so high that rods do not come closer, it goes on with the constant
 *          force it has there: positions that noise or a random start put too close are pushed
 *          apart by bounded steps, and no distance gives infinities. The distance is the largest
 *          below which everywhere
 *            - the energy is 15 kT above that at the mean distance L/N (its tangent, where rods
 *              repel each other there): a weight of 3e-7,
 *            - the force is twice what field, drag and neighbours can press with.
 *          Without noise the first says nothing: there it is half the mean distance (or half the
 *          cutoff). Never below the diameter; rods whose repulsion at contact is weaker than that
 *          feel V alone.
 */
#ifndef CENTRAL_H
#define CENTRAL_H

#include "part.h"

struct central_law {
    const char *cutoff, *strength; /* the rows that faults of either are about */
    /* V(r) before the shift; infinite where it diverges, NaN where it has no value. */
    double (*energy)(const void *par, double r);
    /* force[i] = -V'(r[i]), i = 0 .. count-1, nearest <= r[i] <= cutoff. */
    void (*force)(const void *par, const double *r, int64_t count, double *force);
};

struct central {
    const struct central_law *law;
    double cutoff, diameter, shift;
    double nearest, nearest_energy, nearest_force; /* V (shifted) and F at that distance */
    double stiff; /* the same at 5 kT: steps must resolve what lies beyond */
    bool flat;                                     /* no force anywhere */
};

/* Fills in the struct central at the beginning of group->values. The law must be ready to be
 * evaluated; false = refused, with a fault. */
bool central_complete(struct bcd_group *group, const struct central_law *law, double cutoff,
                      const struct plan *plan, struct bcd_errors *errors);

/* Slots of struct pair_type. */
bool central_absent(const void *par);
double central_range(const void *par);
double central_stiffness(const void *par, const struct plan *plan);
void central_theory(const void *par, struct theory_pair *pair);
void central_add_force(const void *par, const struct ring *ring, double scale, double *out);
double central_energy(const void *par, double distance, double temperature);

#endif
