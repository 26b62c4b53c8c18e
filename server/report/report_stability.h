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
 * hangs. */
struct stability_result stability_try(const struct stability_extreme *extreme, const char *method);

#endif
