/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plot_axis.h - one axis of a plot: a range of values laid out along a range of pixels, linear or
 * logarithmic, and where its ticks go.
 */
#ifndef PLOT_AXIS_H
#define PLOT_AXIS_H

#include "text.h"

#include <stdbool.h>
#include <stddef.h>

/* Values whose magnitude lies outside cannot be drawn (their sums and ratios must stay finite). */
#define PLOT_VALUE_MAX 1e300
#define PLOT_VALUE_MIN 1e-290

/* How a range is widened to the one shown. */
enum plot_fit {
    PLOT_FIT_ALONG,  /* an independent variable: ends on a tick when one is near */
    PLOT_FIT_ACROSS, /* a measured one: some air at both ends, down to 0 when that is near */
    PLOT_FIT_BARS,   /* measured, drawn as bars: 0 is always shown */
};

struct plot_axis {
    bool log;
    double min, max; /* values at the ends */
    double from, to; /* pixels at the ends */
};

struct plot_tick {
    double at;  /* value */
    bool major; /* has a label */
    bool power; /* the label is text, then 10 to the exponent */
    int exponent;
    char text[32]; /* UTF-8 */
};
enum { PLOT_TICKS_MAX = 128 };
struct plot_ticks {
    size_t count;
    int exponent; /* linear axis: all labels are in units of 10^exponent */
    struct plot_tick tick[PLOT_TICKS_MAX];
};

/* Chooses min and max of an axis (log and pixels already set) so that lo..hi is shown well. For a
 * logarithmic axis both are positive. lo <= hi, of magnitude 0 or PLOT_VALUE_MIN..MAX; equal is
 * fine. */
void plot_axis_fit(struct plot_axis *axis, double lo, double hi, enum plot_fit fit);

/* Pixel of a value; beyond the ends, the pixel of the end. */
double plot_axis_pixel(const struct plot_axis *axis, double v);

/* Ticks from min to max; about `wanted` labels. */
void plot_axis_ticks(const struct plot_axis *axis, int wanted, struct plot_ticks *ticks);

/* Estimated width of a label in a sans-serif font of `size` pixels. */
double plot_tick_width(const struct plot_tick *tick, double size);

/* The label as content of a <text> of `size` pixels. */
void plot_tick_print(const struct plot_tick *tick, double size, struct text *svg);

/* v with a fixed number of decimals (0..15), and U+2212 for minus: what a reader sees. */
void plot_print_fixed(char *out, size_t size, double v, int decimals);

#endif
