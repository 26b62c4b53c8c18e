/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_report_msd.h"
#include "plot_figure.h"
#include "text.h"

#include <math.h>
#include <stdio.h>

enum { CURVES_MAX = 16, WORDS = 48 };
#define EARLY_LAG 0.01
#define WELL_LAG 1.0 /* a plateau, if any, lies below: later rods leave their wells */

/* ----------------------------------------------------------------- picture */

/* The curve after `first` that begins another panel. */
static size_t panel_end(const struct msd_curve *curves, size_t count, size_t first)
{
    size_t i = first;
    while (i < count && curves[i].scene->diameter == curves[first].scene->diameter)
        i++;
    return i;
}

char *msd_figure_print(const struct msd_curve *curves, size_t count, const char *title,
                       const char *subtitle)
{
    struct plot_curve plotted[CURVES_MAX];
    struct plot_panel panels[CURVES_MAX] = {0};
    char labels[CURVES_MAX][WORDS], titles[CURVES_MAX][WORDS];
    size_t columns = 0;
    count = count < CURVES_MAX ? count : CURVES_MAX;
    for (size_t i = 0; i < count; i++) {
        snprintf(labels[i], WORDS, "\xCE\xB3 = %g", curves[i].scene->stickiness);
        plotted[i] = (struct plot_curve){.table = curves[i].table, .label = labels[i]};
    }
    for (size_t first = 0; first < count; columns++) {
        size_t end = panel_end(curves, count, first);
        snprintf(titles[columns], WORDS, "\xCF\x83 = %g, \xCF\x81 = %g",
                 curves[first].scene->diameter, curves[first].scene->density);
        panels[columns] = (struct plot_panel){.title = titles[columns],
                                              .curves = plotted + first,
                                              .curve_count = end - first,
                                              .guides = true};
        first = end;
    }
    const struct plot_figure plot = {
        .title = title, .subtitle = subtitle, .rows = 1, .columns = columns, .panels = panels};
    return plot_figure_print(&plot);
}

/* ---------------------------------------------------------------- verdicts */

struct reading {
    double msd, error; /* NaN = not measured there */
};

static struct reading row(const struct bcd_table *table, size_t i)
{
    const struct bcd_column *error = bcd_table_column(table, BCD_ROLE_STDERR);
    return (struct reading){bcd_table_column(table, BCD_ROLE_VALUE)->values[i],
                            error && error->values ? error->values[i] : NAN};
}

static double lag(const struct bcd_table *table, size_t i)
{
    return bcd_table_column(table, BCD_ROLE_X)->values[i];
}

/* A straight line between two rows in the logarithms. */
static struct reading at_lag(const struct bcd_table *table, double t)
{
    for (size_t i = 0; i + 1 < table->rows; i++) {
        double a = lag(table, i), b = lag(table, i + 1);
        if (t < a * (1 - 1e-9) || t > b * (1 + 1e-9))
            continue;
        struct reading one = row(table, i), other = row(table, i + 1);
        double share = log(t / a) / log(b / a);
        double msd = one.msd * pow(other.msd / one.msd, share);
        return (struct reading){msd, msd * ((1 - share) * one.error / one.msd +
                                            share * other.error / other.msd)};
    }
    return (struct reading){NAN, NAN};
}

/* Exponent of the power law between two lags, and its standard error, of independent ends. */
static struct reading exponent(const struct bcd_table *table, double from, double to)
{
    struct reading a = at_lag(table, from), b = at_lag(table, to);
    double decades = log(to / from);
    return (struct reading){log(b.msd / a.msd) / decades,
                            hypot(a.error / a.msd, b.error / b.msd) / decades};
}

/* Where the curve is flattest before rods leave their wells: the row. */
static size_t plateau(const struct bcd_table *table)
{
    size_t best = 1;
    double flattest = INFINITY;
    for (size_t i = 1; i + 1 < table->rows && lag(table, i + 1) < WELL_LAG; i++) {
        double slope = log(row(table, i + 1).msd / row(table, i - 1).msd) /
                       log(lag(table, i + 1) / lag(table, i - 1));
        if (slope < flattest) {
            flattest = slope;
            best = i;
        }
    }
    return best;
}

static void add_curve(struct text *text, const struct msd_curve *curve)
{
    const struct bcd_table *table = curve->table;
    char words[256];
    size_t flat = plateau(table);
    double last = lag(table, table->rows - 1);
    struct reading early = at_lag(table, EARLY_LAG), middle = row(table, flat),
                   late = at_lag(table, last), tail = exponent(table, last / 10, last);
    double slope = exponent(table, lag(table, flat - 1), lag(table, flat + 1)).msd;
    snprintf(words, sizeof words,
             "%5g %5g  %8.5f(%.0e)  %8.5f(%.0e) at t = %-7.3g %5.2f  %8.4g(%.1g) at t = %-5.4g "
             "%6.3f(%.3f)\n",
             curve->scene->diameter, curve->scene->stickiness, early.msd, early.error, middle.msd,
             middle.error, lag(table, flat), slope, late.msd, late.error, last, tail.msd,
             tail.error);
    text_add(text, "%s", words);
}

/* Two stickinesses of one diameter at a lag: who is ahead, and by how many standard errors. */
static void add_order(struct text *text, const struct msd_curve pair[2], double t, const char *when)
{
    struct reading one = at_lag(pair[0].table, t), other = at_lag(pair[1].table, t);
    double ratio = other.msd / one.msd;
    double error = ratio * hypot(one.error / one.msd, other.error / other.msd);
    char words[256];
    snprintf(words, sizeof words,
             "sigma %g, %s, t = %.3g: MSD(gamma %g) / MSD(gamma %g) = %.4f +- %.4f, %s by %.1f "
             "standard errors\n",
             pair[0].scene->diameter, when, t, pair[1].scene->stickiness,
             pair[0].scene->stickiness, ratio, error, ratio < 1 ? "below" : "above",
             fabs(ratio - 1) / error);
    text_add(text, "%s", words);
}

char *msd_verdict_print(const struct msd_curve *curves, size_t count)
{
    struct text text = {0};
    text_add(&text,
             "\n%5s %5s  %-16s %-33s %5s  %-27s %s\n", "sigma", "gamma", "MSD at t = 0.01",
             "flattest (2<x^2> = 0.0169)", "slope", "at the longest lag",
             "exponent over the last decade");
    for (size_t i = 0; i < count; i++)
        add_curve(&text, &curves[i]);
    for (size_t first = 0, end; first < count; first = end) {
        end = panel_end(curves, count, first);
        for (size_t i = first; i + 1 < end; i++) {
            double a = lag(curves[i].table, curves[i].table->rows - 1);
            double b = lag(curves[i + 1].table, curves[i + 1].table->rows - 1);
            add_order(&text, curves + i, EARLY_LAG, "early");
            add_order(&text, curves + i, fmin(a, b), "late");
        }
    }
    return text_take(&text);
}
