/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_fit.h"

#include <math.h>

struct report_fit report_fit_power(const struct report_point *points, size_t count)
{
    struct report_fit fit = {NAN, NAN, NAN, 0};
    double weights = 0, x_mean = 0, y_mean = 0, xx = 0, xy = 0;
    /* Means first: the sums of squares about them do not cancel. */
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < count; i++) {
            double size = fabs(points[i].error), bar = points[i].stderror;
            if (!(size > 2 * bar) || !isfinite(size))
                continue;
            double x = log(points[i].step), y = log(size);
            double weight = 1 / (bar / size * (bar / size) + REPORT_FIT_SLACK * REPORT_FIT_SLACK);
            if (pass == 0) {
                fit.points++;
                weights += weight;
                x_mean += weight * x;
                y_mean += weight * y;
            } else {
                xx += weight * (x - x_mean) * (x - x_mean);
                xy += weight * (x - x_mean) * (y - y_mean);
            }
        }
        if (fit.points < 2)
            return fit;
        if (pass == 0) {
            x_mean /= weights;
            y_mean /= weights;
        }
    }
    if (!(xx > 1e-12 * weights)) /* all of one step */
        return fit;
    fit.order = xy / xx;
    fit.order_stderror = 1 / sqrt(xx);
    fit.factor = exp(y_mean - fit.order * x_mean);
    return fit;
}
