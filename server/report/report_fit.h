/* SPDX-License-Identifier: GPL-3.0-or-later
 * report_fit.h - power laws through measured errors: error = factor * step^order. */
#ifndef REPORT_FIT_H
#define REPORT_FIT_H

#include <stddef.h>

struct report_point {
    double step, error, stderror; /* step > 0; error of either sign; NaN = left out */
};

struct report_fit {
    double order, order_stderror; /* NaN = fewer than two points tell anything */
    double factor;
    size_t points; /* those with |error| > 2 stderror */
};

/* Weighted least squares of ln|error| against ln step. To each point's own relative error
 * REPORT_FIT_SLACK is added: coarse steps have tiny error bars, but lie off any power law by more
 * than that. */
#define REPORT_FIT_SLACK 0.1
struct report_fit report_fit_power(const struct report_point *points, size_t count);

#endif
