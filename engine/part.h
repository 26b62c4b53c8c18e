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
#include "theory/theory.h"

/* What every kind of part has: the head of its table, as member `base`. */
struct part_type {
    struct bcd_part part;
    size_t par_size; /* of par, zeroed: what rows describe, then what `complete` makes of it */
    /* Potentials and interactions, once all their rows are set and the geometry is known: checks
     * what rows alone cannot, and makes tables or byte code in members of par that no row
     * describes. NULL = nothing to do. */
    void (*complete)(struct bcd_group *group, const struct plan *plan, struct bcd_errors *errors);
    void (*release)(void *par); /* ends what complete made; also after none or a failed one */
};

/* ------------------------------------------------------------- potentials */

/* Rods as forces see them: x[i] = y[i] + i * diameter, or y[i] + offset[i] for rods of several
 * lanes (sim.h): add_force and flow take both, bit for bit the same for the same x. Of a ring that
 * several hands work at (sharing.h), y and count are those of rods `first` and on, x those of the
 * ring. */
struct rods {
    const double *y;
    int64_t count;
    double diameter;
    double time;
    const double *offset; /* NULL = none */
    int64_t first;        /* i of y[0]; 0 where there is an offset, and for sums */
};

/* x of rods start .. start + n - 1. */
static inline __attribute__((always_inline)) void rods_places(const struct rods *rods,
                                                              int64_t start, int n, double *x)
{
    const double base = (double)(rods->first + start);
    const double *y = rods->y + start, *offset = rods->offset ? rods->offset + start : NULL;
    for (int j = 0; j < n && offset; j++)
        x[j] = y[j] + offset[j];
    for (int j = 0; j < n && !offset; j++)
        x[j] = y[j] + (base + (double)j) * rods->diameter;
}

struct potential_type {
    struct part_type base;
    double (*period)(const void *par);        /* > 0; INFINITY = has none: walls only */
    bool (*flat)(const void *par);            /* exerts no force: the scene leaves it out */
    double (*curvature_max)(const void *par); /* max |U''| */
    /* out[i] += scale * F(x[i]), F = -U'; out may be rods->y itself */
    void (*add_force)(const void *par, const struct rods *rods, double scale, double *out);
    double (*energy_sum)(const void *par, const struct rods *rods); /* sum of U(x[i]) */
    /* energy[i] = U(x[i]) at time 0, i < n, bit for bit what energy_sum gives for one rod; NULL =
     * that is asked. */
    void (*energies)(const void *par, const double *x, int n, double *energy);
    /* y, which is rods->y, follow dx/dt = mu F(x) exactly for a duration, F as it is at rods->time.
     * growth: what flow_growth makes of the duration, once for many flows. NULL = not known. */
    void (*flow)(const void *par, const struct rods *rods, double growth, double *y);
    double (*flow_growth)(const void *par, double mobility, double duration);
    bool (*steady)(const void *par);     /* does not depend on time: there is an equilibrium */
    double (*velocity)(const void *par); /* of the whole pattern; NULL = at rest */
    bool (*rough)(const void *par);      /* smooth only in pieces; NULL = smooth everywhere */
    /* Rough cost of the force on one rod beyond a cosine's, and of one energy, for estimates
     * alone; NULL = like a cosine's. */
    double (*force_ns)(const void *par, const struct plan *plan);
    double (*energy_ns)(const void *par);
};

/* U(x) of a plan that has a potential, in the form theory/ wants it: ctx is the plan. */
static inline double plan_energy(const void *ctx, double x)
{
    const struct plan *plan = ctx;
    struct rods one = {.y = &x, .count = 1, .diameter = 0, .time = 0};
    return plan->potential->energy_sum(plan->potential_par, &one);
}

/* What it costs, roughly. */
static inline double plan_energy_ns(const struct plan *plan)
{
    const double cosine = 15;
    const struct potential_type *type = plan->potential;
    return type && type->energy_ns ? type->energy_ns(plan->potential_par) : cosine;
}

/* Is there a potential that acts and does not change with time? */
static inline bool plan_field_steady(const struct plan *plan)
{
    return plan->field && plan->potential->steady(plan->potential_par);
}

/* ------------------------------------------------------------------ pairs */

/* Neighbours as pair forces see them: gaps y[i+1] - y[i] and, unless there are walls, y[0] +
 * free_length - y[count-1]. Distance of the centres of the k-th neighbours: y[i+k] - y[i] + k *
 * diameter. */
struct ring {
    const double *y;
    int64_t count; /* >= 2 */
    double free_length, diameter, temperature;
    bool walls; /* an open line: no pair across the seam */
};

/* Rods first .. end-1 of a line. */
struct pair_stretch {
    int64_t first, end;
};

struct pair_type {
    struct part_type base;
    bool (*absent)(const void *par); /* exerts no force: the scene leaves it out */
    /* Acts at contact alone, as bonds that methods with `bonds` make and break: exerts no force to
     * add. NULL = never. */
    bool (*contact)(const void *par);
    double (*range)(const void *par); /* no force between gaps beyond */
    bool alone; /* complete and stiffness read nothing of the plan but the diameter */
    /* max |dF/dg| / kT over the distances that rods come to */
    double (*stiffness)(const void *par, const struct plan *plan);
    bool athermal; /* its energies do not scale with kT: stiffness is max |dF/dg| itself */
    void (*theory)(const void *par, struct theory_pair *pair); /* NULL = no exact theory */
    /* out[i] += scale * F_i */
    void (*add_force)(const void *par, const struct ring *ring, double scale, double *out);
    /* The same for some rods, whose out[i] alone it changes, with the same bits; the whole line is
     * in ring and out. NULL = sums run along the whole line. */
    void (*add_force_within)(const void *par, const struct ring *ring,
                             const struct pair_stretch *within, double scale, double *out);
    bool nearest; /* only nearest neighbours feel it; else all pairs whose gap, the distance of
                   * their centres less a diameter, is within range */
    /* Energy of two rods whose centres are `distance` >= diameter apart, 0 out of range; never
     * INFINITY (overlaps are the caller's business), never NULL. Own elementary functions. */
    double (*energy)(const void *par, double distance, double temperature);
    /* Rough cost of one pair's force, for estimates alone; NULL = the usual. */
    double (*force_ns)(const void *par);
};

/* ---------------------------------------------------------------- methods */

/* Points within a step at which static observables may look. */
enum view { VIEW_MID_NOISE, VIEW_MID_DRIFT, VIEWS };

struct step_limit;

struct method_type {
    struct bcd_part part;
    const char *experimental; /* what is not yet understood of it, for results; NULL = nothing */
    bool bonds;               /* rods that stick at contact alone */
    bool keeps_contacts;      /* noise ends in exact contacts: too many of them, as sqrt(h) */
    double order;             /* weak order in the time step at contacts: errors fall as h^order */
    double step_ns; /* rough cost of one rod and step, for estimates and sampling intervals */
    double view_ns; /* the same of both views together */
    bool sorts;     /* ring_sort.h: takes longer where noise carries rods past many others */
    /* Why it cannot run this plan; NULL = it can. A NULL slot: it can run all. */
    const char *(*cannot)(const struct plan *plan);
    /* Does it give the exact law here at any time step, of motion or (not dynamic) of positions in
     * equilibrium? NULL = never. */
    bool (*exact)(const struct plan *plan, bool dynamic);
    /* Advances several lanes at once (sim.h); begin makes them all ready. What it keeps are numbers
     * for rods alone (sim_take_rods). */
    bool lanes;
    bool any_step; /* no step is so long that profiles melt or interactions fall silent */
    /* The largest step that keeps the tolerance (L1 error of the density). */
    struct step_limit (*time_step)(const struct plan *plan);
    /* Memory: `kept` goes into checkpoints (plain data, no pointers), `scratch` does not. */
    void (*layout)(struct sim *sim, struct arena *kept, struct arena *scratch);
    void (*begin)(struct sim *sim); /* rods are placed, tick 0: its kept memory; NULL = none */
    void (*advance)(struct sim *sim, int64_t ticks);
    /* Positions within the next step, [N], valid until the next call; the run is left as it is.
     * NULL = static observables look at the rods themselves. */
    const double *(*view)(struct sim *sim, enum view view);
    /* force[i] = force with which rod i pushes rod i + 1 (mod N) during the next step, 0 where they
     * are not in contact; the run is left as it is. NULL = it knows no contact forces. */
    void (*contact_forces)(struct sim *sim, double *force);
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
    enum view view;      /* where in a step it looks */
};

/* Statistics of one observable's values over independent samples (realizations or blocks). Arrays
 * of `count`: number of samples that had a value, their mean, sum of squared deviations. */
struct moments {
    const double *samples, *mean, *square;
    size_t count;
};

/* Exact values of an observable: asked for by reference.c, filled in by the observable. */
struct exact {
    const struct theory_result *equilibrium; /* NULL = there is none, why_not says why */
    const char *equilibrium_kind;            /* "canonical" or "infinite" */
    const char *why_not;
    size_t rows;
    double *values;        /* [rows], to be filled in; NaN where none is known */
    struct bcd_watch *watch; /* may be NULL; whatever it ends may leave any values */
    const char *reference; /* "canonical", "infinite", "asymptote"; NULL = none: */
    const char *reason;
};

/* The usual answer of a static observable: `from` (NULL where the theory has none) is exact. */
static inline void exact_from(struct exact *exact, const double *from)
{
    exact->reason = exact->why_not;
    if (!exact->equilibrium || !from)
        return;
    for (size_t i = 0; i < exact->rows; i++)
        exact->values[i] = from[i];
    exact->reference = exact->equilibrium_kind;
}

struct observable_type {
    struct part_type base;
    void (*check)(const struct bcd_group *group, const struct plan *plan,
                  struct bcd_errors *errors);
    /* The longest time step that still resolves what is asked; INFINITY = no demand. */
    double (*time_step_max)(const void *par, const struct plan *plan);
    const char *value;              /* name of the column of measured values */
    const char *no_time_step_error; /* why it makes no sense here; NULL = it does */
    const char *no_error_bar;       /* why it has none over realizations; NULL = it has */
    bool dynamic;                   /* depends on how rods move, not only on where they are */
    bool contact_forces;            /* asks the method for contact forces */
    bool mid_drift;  /* looks at the rods there: paths without the noise of half a step */
    bool at_contact; /* measures rods that nearly touch, where errors fall as sqrt(h) only */
    bool one_view;   /* the difference between two views does not bound its time-step error */
    /* Rough cost of looking at one rod, for the sampling interval; NULL = looks at its own
     * times. */
    double (*sample_ns)(const void *par, const struct plan *plan);
    /* Rough cost per rod and step of looks at times of its own, for estimates only; NULL = none. */
    double (*step_ns)(const void *par, const struct plan *plan);
    size_t (*count)(const void *par, const struct plan *plan);       /* values of one sample */
    size_t (*memory)(const void *par, const struct plan *plan);      /* bytes */
    void (*begin)(struct observer *observer, const struct sim *sim); /* measured tick 0 */
    /* The next measured tick > `after` at which it wants to look; NULL = every sample_steps. */
    int64_t (*next)(const struct observer *observer, int64_t after);
    void (*sample)(struct observer *observer, const struct sim *sim); /* NULL = only block ends */
    /* values[count] of the block that ends now; NaN = nothing to say. Starts the next block. */
    void (*end_block)(struct observer *observer, const struct sim *sim, double *values);
    /* Name, rows, axes and the x column of its table. moments may be NULL: nothing measured yet. */
    enum bcd_status (*describe)(const void *par, const struct plan *plan,
                                const struct moments *moments, struct bcd_table *table);
    /* Further columns and notes of a measured table; NULL = none. */
    enum bcd_status (*extend)(const void *par, const struct plan *plan, struct bcd_table *table);
    /* What it wants from the exact equilibrium beyond the mean energy; NULL = nothing at all. */
    void (*want)(const void *par, const struct plan *plan, struct theory_wanted *wanted);
    /* Exact values of its rows; NULL = none are known, no column. */
    void (*exact)(const void *par, const struct plan *plan, struct exact *exact);
    /* What that takes, roughly; NULL = nothing to speak of. */
    double (*exact_ns)(const void *par, const struct plan *plan);
};

#endif
