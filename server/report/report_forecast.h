/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_forecast.h - how large a job's statistical errors will be, from a small sample of it: its
 * errors times the root of (realizations times time of the sample over those of the job). Where the
 * sample cannot be as long as the job, a second one of a quarter of its time must have about twice
 * the error: else the root does not hold, and nothing is foretold. Not so msd, of lags up to half
 * the sample's time: what is one lag later is new, and its time counts without the longest lag.
 *
 * ERRORS  Relative, one standard error: root of the sum of squares of the errors of all rows over
 *         that of the values; of what spans decades (msd, cluster_sizes, contact_force) the root
 *         mean square of the rows' shares.
 */
#ifndef REPORT_FORECAST_H
#define REPORT_FORECAST_H

#include "bcd.h"

#include <stdatomic.h>

enum { FORECAST_ROWS_MAX = 16, FORECAST_REASON = 160 };
#define FORECAST_CORE_SECONDS 0.25 /* nominal, of the first sample; the second takes a quarter */

struct forecast {
    size_t count; /* observables asked for, in the job's order */
    struct forecast_row {
        const char *observable;
        double relative; /* NaN = not known, and why */
        char reason[FORECAST_REASON];
    } row[FORECAST_ROWS_MAX];
    int64_t realizations; /* of the sample; 0 = there was none */
    double time, core_seconds;
};

/* Runs on the calling thread, for about a third of a second (at most thirty times that, and what
 * preparation takes). The same job gives the same answer, unless *stop is not 0 before the end
 * (NULL = never). */
void report_forecast(const struct bcd_scene *scene, const atomic_int *stop,
                     struct forecast *forecast);

#endif
