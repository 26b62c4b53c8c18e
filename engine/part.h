/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * part.h - the tables that parts fill in: one const table per file in methods/, potentials/ and
 * observables/, listed in parts.c. A NULL slot means "cannot".
 */
#ifndef PART_H
#define PART_H

#include "bcd.h"
#include "param.h"
#include "sim.h"

/* What every kind of part has: the head of its table, as member `base`. */
struct part_type {
    struct bcd_part part;
    size_t par_size;
};

/* ------------------------------------------------------------- potentials */

/* Rods as forces see them: x[i] = y[i] + i * diameter. */
struct rods {
    const double *y;
    int64_t count;
    double diameter;
    double time;
};

struct potential_type {
    struct part_type base;
    void (*check)(const struct bcd_group *group, struct bcd_errors *errors); /* NULL = rows do */
    double (*period)(const void *par);     /* > 0 */
    bool (*flat)(const void *par);         /* exerts no force: the scene leaves it out */
    double (*curvature_max)(const void *par); /* max |U''| */
    double (*force_max)(const void *par);     /* max |U'| */
    /* out[i] += scale * F(x[i]), F = -U' */
    void (*add_force)(const void *par, const struct rods *rods, double scale, double *out);
    double (*energy_sum)(const void *par, const struct rods *rods); /* sum of U(x[i]) */
};

/* ------------------------------------------------------------------ pairs */

/* Neighbours as pair forces see them: gaps y[i+1] - y[i], and y[0] + free_length - y[count-1]. */
struct ring {
    const double *y;
    int64_t count; /* >= 2 */
    double free_length, temperature;
};

struct pair_type {
    struct part_type base;
    void (*check)(const struct bcd_group *group, struct bcd_errors *errors); /* NULL = rows do */
    bool (*absent)(const void *par);    /* exerts no force: the scene leaves it out */
    double (*range)(const void *par);   /* no force between gaps beyond */
    double (*stiffness)(const void *par); /* max |dF/dg| / kT */
    double (*boltzmann)(const void *par, double gap); /* exp(-V(gap)/kT), for the exact theory */
    /* out[i] += scale * F_i */
    void (*add_force)(const void *par, const struct ring *ring, double scale, double *out);
};

/* ---------------------------------------------------------------- methods */

struct method_type {
    struct bcd_part part;
    double step_ns;    /* rough cost of one rod and step, for estimates and sampling intervals */
    double bytes_per_rod; /* scratch */
    /* The largest step that keeps the tolerance (L1 error of the density), and why. */
    double (*time_step)(const struct plan *plan, const char **why);
    void (*layout)(struct sim *sim, struct arena *scratch);
    void (*advance)(struct sim *sim, int64_t ticks);
};

/* ------------------------------------------------------------ observables */

/* One observable of a run in motion. memory is the type's own, plain data without pointers, kept in
 * checkpoints. */
struct observer {
    const struct observable_type *type;
    const void *par;
    const struct plan *plan;
    void *memory;
    size_t first, count; /* its values within a tally */
};

/* Statistics of one observable's values over independent samples (realizations or blocks). Arrays of
 * `count`: number of samples that had a value, their mean, sum of squared deviations. */
struct moments {
    const double *samples, *mean, *square;
    size_t count;
};

struct observable_type {
    struct part_type base;
    void (*check)(const struct bcd_group *group, const struct plan *plan,
                  struct bcd_errors *errors);
    /* The longest time step that still resolves what is asked; INFINITY = no demand. */
    double (*time_step_max)(const void *par, const struct plan *plan);
    bool theory;      /* its table has a column for exact theory */
    double sample_ns; /* rough cost of looking at one rod, for the sampling interval; 0 = other */
    size_t (*count)(const void *par, const struct plan *plan);  /* values of one sample */
    size_t (*memory)(const void *par, const struct plan *plan); /* bytes */
    void (*begin)(struct observer *observer, const struct sim *sim); /* measured tick 0 */
    /* The next measured tick > `after` at which it wants to look; NULL = every sample_steps. */
    int64_t (*next)(const struct observer *observer, int64_t after);
    void (*sample)(struct observer *observer, const struct sim *sim); /* NULL = only block ends */
    /* values[count] of the block that ends now; NaN = nothing to say. Starts the next block. */
    void (*end_block)(struct observer *observer, const struct sim *sim, double *values);
    enum bcd_status (*table)(const void *par, const struct plan *plan,
                             const struct moments *moments, struct bcd_table *table);
};

#endif
