/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_work_precision.h - error against run time: every method on five scenes over a range of
 * time steps, as measured on this machine by one thread.
 *
 * UNITS  wavelength, kT and mobility are 1. Costs are nanoseconds of one core per rod and unit of
 *        simulated time, sampling included (by default at most a fifth).
 */
#ifndef REPORT_WORK_PRECISION_H
#define REPORT_WORK_PRECISION_H

#include "bcd.h"
#include "report_fit.h"

#include <stdatomic.h>

#define WORK_PRECISION_TOLERANCE 0.005 /* of the density's L1, for cost_at_tolerance */

enum {
    WORK_PRECISION_SCENES = 5,
    WORK_PRECISION_LEVELS_MAX = 6,
    WORK_PRECISION_METHODS_MAX = 24,
    WORK_PRECISION_ENTRIES_MAX = WORK_PRECISION_LEVELS_MAX * WORK_PRECISION_METHODS_MAX,
    WORK_PRECISION_BINS = 50, /* of the density */
    WORK_PRECISION_REASON = 384,
    WORK_PRECISION_JOB = 768,
};

/* What is in error. Energy: mean external energy per rod minus the exact one. Density: integral of
 * |measured - exact| over a period, relative to that of the exact one. Contact: mean contact
 * density relative to the exact one, minus 1. Drift: drift velocity under a constant force,
 * relative to a reference run, minus 1. */
enum work_precision_kind {
    WORK_PRECISION_ENERGY,
    WORK_PRECISION_DENSITY,
    WORK_PRECISION_CONTACT,
    WORK_PRECISION_DRIFT,
    WORK_PRECISION_KINDS
};
const char *work_precision_kind_name(enum work_precision_kind kind); /* "energy_error", ... */

struct work_precision_scene {
    const char *name;
    int particles;
    const char *members; /* geometry and forces as members of a job */
    double drift_force;
    bool filled;  /* one rod in each well: a lattice soon forgets that it was one */
    double share; /* of the budget: 1, or more where steps are short */
};
const struct work_precision_scene *work_precision_scene(size_t index); /* NULL past the last */

struct work_precision_value {
    double error, stderror; /* NaN = not measured */
};

struct work_precision_entry {
    const char *method; /* one of report_run_method's names */
    double time_step, cost;
    struct work_precision_value value[WORK_PRECISION_KINDS];
    double density_noise; /* L1 that error bars alone would give */
    double time;          /* measured, all realizations together */
    double drift_time;
    char reason[WORK_PRECISION_REASON];       /* why it failed; "" = it did not */
    char drift_reason[WORK_PRECISION_REASON]; /* why there is no drift velocity; "" = there is */
};

/* All of one method on one scene; entries[first .. first + count). */
struct work_precision_method {
    const char *name;
    char refused[WORK_PRECISION_REASON]; /* why it has no entries; "" = it has */
    size_t first, count;
    struct report_fit fit[WORK_PRECISION_KINDS];
    double cost_at_tolerance; /* NaN = not to be had */
    char how[128];            /* "interpolated", "extrapolated", "measured", or why not */
};

struct work_precision_result {
    const struct work_precision_scene *scene; /* NULL = not asked for */
    char job[WORK_PRECISION_JOB];             /* of the first entry, as it was run (JSON) */
    double energy, contact;                   /* exact */
    struct {
        double velocity, stderror, time_step;
        char reason[WORK_PRECISION_REASON]; /* why there is none; "" = there is */
    } reference;
    size_t entry_count, method_count;
    struct work_precision_entry entry[WORK_PRECISION_ENTRIES_MAX];
    struct work_precision_method method[WORK_PRECISION_METHODS_MAX];
};

struct work_precision_options {
    const char *scene, *method; /* only these; NULL = all */
    double core_seconds;        /* for each entry's static averages; half as much for its drift */
    int levels;                 /* time steps of each method, 2 .. LEVELS_MAX */
    const atomic_int *stop;    /* ends it soon; NULL = never */
    void (*progress)(void *context, double share); /* 0..1; NULL = not told */
    void *context;
};

struct work_precision {
    struct work_precision_options options;
    double share, share_step; /* of all work; of one method on one scene */
    struct work_precision_result result[WORK_PRECISION_SCENES];
};

/* The three sizes of a report. */
#define WORK_PRECISION_SHORT ((struct work_precision_options){.core_seconds = 0.15, .levels = 4})
#define WORK_PRECISION_DEFAULT ((struct work_precision_options){.core_seconds = 1.5, .levels = 5})
#define WORK_PRECISION_FULL ((struct work_precision_options){.core_seconds = 15, .levels = 6})

/* Are there such a scene and method (NULL = any)? Then both point to names that last. */
bool work_precision_known(struct work_precision_options *options);

/* Measures everything; a method that refuses a scene is left out of it, with its words. False =
 * stopped, or an exact reference could not be had (`reason`, then not empty). The report is large:
 * allocate it. */
bool work_precision_measure(struct work_precision *report,
                            const struct work_precision_options *options,
                            char reason[WORK_PRECISION_REASON]);

/* report_work_precision_fit.c: fit, cost_at_tolerance and how, from the method's entries. */
void work_precision_fit(struct work_precision_method *method,
                        const struct work_precision_entry *entries);

/* The order of one kind of error in the time step; NaN: `reason` says why there is none. */
double work_precision_order(const struct report_fit *fit, const char **reason);

/* report_work_precision_print.c: malloc'ed, NULL = out of memory. */
char *work_precision_print_json(const struct work_precision *report);
char *work_precision_print_csv(const struct work_precision *report);
char *work_precision_print_table(const struct work_precision *report);

/* report_work_precision_plot.c: log-log, one column of panels a scene, one row a kind of error. */
char *work_precision_print_svg(const struct work_precision *report);

#endif
