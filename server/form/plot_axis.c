/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "plot_axis.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MINUS "\xE2\x88\x92"
#define TIMES "\xC3\x97"

static double power_of_ten(int exponent);
static double nice_step(double span, int wanted, int *exponent);
static void fit_linear(struct plot_axis *axis, double lo, double hi, enum plot_fit fit);
static void ticks_linear(const struct plot_axis *axis, int wanted, struct plot_ticks *ticks);
static void ticks_log(const struct plot_axis *axis, int wanted, struct plot_ticks *ticks);
static void label_log_tick(struct plot_tick *tick, int mantissa, bool plain);

void plot_axis_fit(struct plot_axis *axis, double lo, double hi, enum plot_fit fit)
{
    if (!axis->log) {
        fit_linear(axis, lo, hi, fit);
        return;
    }
    double a = log10(lo), b = log10(hi);
    double air = fit == PLOT_FIT_ALONG ? 0.02 * (b - a) : 0.06 * (b - a);
    if (fit == PLOT_FIT_BARS) /* bars need something to stand on */
        a = floor(a - 0.1);
    /* At least one decade across, or noise on a plateau would look like physics. */
    double least = fit == PLOT_FIT_ALONG ? 0.4 : 1;
    double wider = fmax(air, (least - (b - a)) / 2);
    axis->min = pow(10, fmax(a - (fit == PLOT_FIT_BARS ? 0 : wider), -307));
    axis->max = pow(10, fmin(b + wider, 307));
}

double plot_axis_pixel(const struct plot_axis *axis, double v)
{
    double share;
    if (axis->log)
        share = v > 0 ? (log10(v) - log10(axis->min)) / (log10(axis->max) - log10(axis->min)) : 0;
    else
        share = (v - axis->min) / (axis->max - axis->min);
    return axis->from + (axis->to - axis->from) * fmin(fmax(share, 0), 1);
}

void plot_axis_ticks(const struct plot_axis *axis, int wanted, struct plot_ticks *ticks)
{
    ticks->count = 0;
    ticks->exponent = 0;
    if (axis->log)
        ticks_log(axis, wanted, ticks);
    else
        ticks_linear(axis, wanted, ticks);
}

double plot_tick_width(const struct plot_tick *tick, double size)
{
    char exponent[16];
    double characters = 0;
    for (const char *c = tick->text; *c; c++)
        characters += ((unsigned char)*c & 0xC0) != 0x80;
    if (tick->power)
        characters += 0.75 * snprintf(exponent, sizeof exponent, "%d", tick->exponent);
    return 0.63 * size * characters;
}

void plot_tick_print(const struct plot_tick *tick, double size, struct text *svg)
{
    text_add_xml(svg, tick->text);
    if (tick->power)
        text_add(svg, "<tspan dy=\"-%d\" font-size=\"%d\">%s%d</tspan>", (int)(0.42 * size),
                 (int)(0.78 * size), tick->exponent < 0 ? MINUS : "",
                 tick->exponent < 0 ? -tick->exponent : tick->exponent);
}

void plot_print_fixed(char *out, size_t size, double v, int decimals)
{
    /* Through an integer: printf's %f would write the locale's decimal point. */
    long long scale = 1;
    for (int i = 0; i < decimals; i++)
        scale *= 10;
    double scaled = round(fabs(v) * (double)scale);
    long long n = scaled < 9e18 ? (long long)scaled : 9000000000000000000;
    const char *sign = v < 0 && n != 0 ? MINUS : "";
    char fraction[24];
    snprintf(fraction, sizeof fraction, "%lld", scale + n % scale); /* "1042" for .042 */
    fraction[0] = '.';
    snprintf(out, size, "%s%lld%s", sign, n / scale, decimals > 0 ? fraction : "");
}

/* 10^exponent, 0 below what a double can hold. */
static double power_of_ten(int exponent)
{
    return pow(10, exponent);
}

/* 1, 2 or 5 times a power of ten, so that `span` holds about `wanted` of them. *exponent: that
 * power. */
static double nice_step(double span, int wanted, int *exponent)
{
    double raw = span / wanted;
    *exponent = (int)floor(log10(raw));
    double mantissa = raw / power_of_ten(*exponent);
    if (mantissa > 7.1) {
        *exponent += 1;
        return power_of_ten(*exponent);
    }
    return (mantissa > 3.2 ? 5 : mantissa > 1.45 ? 2 : 1) * power_of_ten(*exponent);
}

static void fit_linear(struct plot_axis *axis, double lo, double hi, enum plot_fit fit)
{
    int exponent;
    double size = fmax(fabs(lo), fabs(hi));
    double least = size > 0 ? 1e-9 * size : 2; /* below this, labels would need too many digits */
    if (size > 0 && lo == hi)
        least = 0.2 * size;
    if (hi - lo < least) {
        double middle = lo / 2 + hi / 2;
        lo = middle - least / 2;
        hi = middle + least / 2;
    }
    double span = hi - lo;
    if (fit == PLOT_FIT_ALONG) {
        double minor = nice_step(span, 6, &exponent) / 2;
        double below = floor(lo / minor) * minor, above = ceil(hi / minor) * minor;
        axis->min = lo - below <= 0.04 * span ? below : lo - 0.02 * span;
        axis->max = above - hi <= 0.04 * span ? above : hi + 0.02 * span;
        return;
    }
    bool positive = lo >= 0, negative = hi <= 0;
    axis->min = lo - 0.07 * span;
    axis->max = hi + 0.07 * span;
    if (positive && (fit == PLOT_FIT_BARS || lo < 0.4 * hi))
        axis->min = 0;
    if (negative && (fit == PLOT_FIT_BARS || hi > 0.4 * lo))
        axis->max = 0;
}

static void ticks_linear(const struct plot_axis *axis, int wanted, struct plot_ticks *ticks)
{
    int power;
    double step = nice_step(axis->max - axis->min, wanted, &power);
    double size = fmax(fabs(axis->min), fabs(axis->max));
    if (size >= 1e5 || size < 0.02)
        ticks->exponent = (int)floor(log10(size) + 1e-9);
    int decimals = ticks->exponent - power;
    decimals = decimals < 0 ? 0 : decimals > 15 ? 15 : decimals;
    double eps = 1e-9 * (axis->max - axis->min);
    double n = ceil((axis->min - eps) / step);
    for (; n * step <= axis->max + eps && ticks->count < PLOT_TICKS_MAX; n++) {
        struct plot_tick *tick = &ticks->tick[ticks->count++];
        *tick = (struct plot_tick){.at = n * step, .major = true};
        plot_print_fixed(tick->text, sizeof tick->text, tick->at / power_of_ten(ticks->exponent),
                         decimals);
    }
}

static void ticks_log(const struct plot_axis *axis, int wanted, struct plot_ticks *ticks)
{
    double a = log10(axis->min) - 1e-9, b = log10(axis->max) + 1e-9;
    int first = (int)floor(a), last = (int)floor(b);
    int decades = last - (int)ceil(a); /* whole ones inside */
    int least = decades / (wanted + 3) + 1, stride = 1;
    for (int nice = 1; stride < least; nice++) /* 1, 2, 5, 10, 20, 50, 100 */
        stride = nice % 3 == 1 ? 2 * stride : nice % 3 == 2 ? stride / 2 * 5 : 2 * stride;
    bool plain = first >= -3 && last <= 3;
    for (int decade = first; decade <= last; decade++) {
        for (int m = 1; m <= (stride == 1 ? 9 : 1) && ticks->count < PLOT_TICKS_MAX; m++) {
            double at = decade + log10(m);
            /* With fewer than two whole decades, 2 and 5 get labels too, or 3 in little room. */
            bool major = m == 1 ? decade % stride == 0
                         : wanted > 3 ? decades < 2 && (m == 2 || m == 5)
                                      : decades < wanted - 1 && m == 3;
            if (at < a || at > b || (!major && stride > 10))
                continue;
            struct plot_tick *tick = &ticks->tick[ticks->count++];
            *tick = (struct plot_tick){
                .at = m * power_of_ten(decade), .major = major, .exponent = decade};
            label_log_tick(tick, m, plain);
        }
    }
}

static void label_log_tick(struct plot_tick *tick, int mantissa, bool plain)
{
    tick->power = !plain;
    if (plain)
        plot_print_fixed(tick->text, sizeof tick->text, tick->at,
                         tick->exponent < 0 ? -tick->exponent : 0);
    else if (mantissa == 1)
        snprintf(tick->text, sizeof tick->text, "10");
    else
        snprintf(tick->text, sizeof tick->text, "%d" TIMES "10", mantissa);
}
