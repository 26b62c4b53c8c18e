/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_stability.h - every method at the extremes: right, biased by how much, or refused with a
 * reason. Anything else is a failure that nobody would have been told of.
 *
 * UNITS  wavelength and mobility are 1, and kT unless the extreme says otherwise.
 */
#ifndef REPORT_STABILITY_H
#define REPORT_STABILITY_H

#include "bcd.h"

#include <stdatomic.h>

enum stability_verdict {
    STABILITY_RIGHT,   /* within 3 standard errors of the exact value */
    STABILITY_BIASED,  /* beyond that, by `off`, but less than the extreme's bound */
    STABILITY_RAN,     /* finite and in order; there is no exact value, or `words` say why the run
                          cannot tell: too short, or its error bars exceed the bound */
    STABILITY_REFUSED, /* `words` say why */
    /* From here on: failures. */
    STABILITY_MELTED,   /* off by more than the bound, and nobody said so */
    STABILITY_ACCEPTED, /* ran what must be refused */
    STABILITY_NAN,
    STABILITY_DISORDER, /* rods overlap or have changed places */
    STABILITY_LATE,     /* far more time than its steps may take */
    STABILITY_BROKEN,   /* an error of our own; or, told by who started it, a crash */
    STABILITY_VERDICTS
};
const char *stability_verdict_name(enum stability_verdict verdict);
bool stability_failed(enum stability_verdict verdict);

enum stability_judge {
    STABILITY_BY_ENERGY,   /* against exact theory, or a value given here */
    STABILITY_BY_DENSITY,  /* relative L1, against exact theory */
    STABILITY_BY_VELOCITY, /* drift velocity, against a value given here, relative */
    STABILITY_BY_REFUSAL,  /* must be refused */
};

struct stability_extreme {
    const char *name, *members; /* members of the job */
    enum stability_judge judge;
    double expected; /* BY_ENERGY: 0 = the theory's */
    double bound;    /* a larger error is a failure */
    double time;     /* simulated, if that many steps are few enough */
    double equilibration; /* the same, before; 0 = none is asked for */
    double least_time; /* measured less, it tells nothing; 0 = 1 / D k^2 of wavelength and kT 1 */
    int64_t ticks_max;  /* of a realization; 0 = as many as are quick */
    bool drawn;         /* from exact equilibrium */
};
const struct stability_extreme *stability_extreme(size_t index); /* NULL past the last */

struct stability_result {
    enum stability_verdict verdict;
    double off, stderror;      /* NaN = not judged */
    double time_step_error;    /* the engine's own estimate; NaN = it gives none */
    double time_step, time;    /* of each realization; NaN = did not run */
    double core_seconds;
    char words[300];
};

/* Judges one method at one extreme; takes a few seconds of one core at most, unless a single step
 * hangs. Told to stop (NULL = never) it ends soon, and what it gives back is nothing. */
struct stability_result stability_try(const struct stability_extreme *extreme, const char *method,
                                      const atomic_int *stop);

struct stability_entry {
    const struct stability_extreme *extreme;
    const char *method; /* one of report_run_method's names */
    struct stability_result result;
};

enum { STABILITY_ENTRIES_MAX = 512 };

struct stability {
    size_t count, failed, planned;
    struct stability_entry entry[STABILITY_ENTRIES_MAX]; /* extreme after extreme */
};

/* The index-th method at the extremes whose name holds `only` (NULL = all), all methods or one:
 * false past the last. */
bool stability_plan(const char *only, const char *method, size_t index,
                    struct stability_entry *entry);

struct stability_options {
    const char *only;        /* NULL = all */
    const atomic_int *stop; /* ends it soon; NULL = never */
    void (*found)(void *context, const struct stability *so_far); /* after each; NULL = not told */
    void *context;
};

/* Judges one after the other on the calling thread, unlike `bcd report stability`, which has a
 * process for each: a crash here is one of the program, as that of a job would be. False = stopped.
 * The report is large: allocate it. */
bool stability_measure(struct stability *report, const struct stability_options *options);

/* report_stability_print.c: malloc'ed, NULL = out of memory. Of the entries: JSON objects with a
 * comma between them. */
char *stability_print_entries(const struct stability_entry *entries, size_t count);
char *stability_print_json(const struct stability *report);
char *stability_print_csv(const struct stability *report);
/* The two ends of the JSON, for who writes its entries as they are found. */
char *stability_print_begin(void);
char *stability_print_end(size_t tried, size_t failed, bool interrupted);

/* report_stability_plot.c: a table of signs, a row an extreme, a column a method. */
char *stability_print_svg(const struct stability *report);

#endif
