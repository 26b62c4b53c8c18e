/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "plot_points.h"
#include "plot_axis.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* When there are too many rows, every bucket of them keeps its first, its last, and one for each
 * way of sticking out. */
enum { WAYS = 5, KEPT = WAYS + 2 };

static bool counts_from_one(const struct bcd_table *table);
static bool take_rows(struct plot_points *points, const struct plot_rows *rows);
static void trim(struct plot_points *points);
static void thin(struct plot_points *points, size_t limit);
static void measure(struct plot_points *points);

bool plot_points_init(struct plot_points *points, const struct bcd_table *table)
{
    if (!take_rows(points, &(struct plot_rows){table, 0, table->rows}))
        return false;
    if (counts_from_one(table)) {
        trim(points);
        points->bars = points->count <= PLOT_BARS_MAX;
    }
    thin(points, PLOT_POINTS_MAX);
    measure(points);
    return true;
}

bool plot_points_init_curve(struct plot_points *points, const struct plot_rows *rows, size_t most)
{
    if (!take_rows(points, rows))
        return false;
    thin(points, most);
    measure(points);
    return true;
}

void plot_points_fini(struct plot_points *points)
{
    free(points->point);
    points->point = NULL;
}

static bool counts_from_one(const struct bcd_table *table)
{
    const struct bcd_column *x = bcd_table_column(table, BCD_ROLE_X);
    if (!x || !x->values || table->log_x)
        return false;
    for (size_t i = 0; i < table->rows; i++)
        if (x->values[i] != (double)(i + 1))
            return false;
    return table->rows > 0;
}

/* One number of the table, NaN unless it can be drawn. */
static double at(const struct bcd_column *column, size_t row, bool logarithmic)
{
    double v = column && column->values ? column->values[row] : NAN;
    if (fabs(v) < PLOT_VALUE_MIN)
        v = 0;
    if (!(fabs(v) <= PLOT_VALUE_MAX) || (logarithmic && v <= 0))
        return NAN;
    return v;
}

static bool take_rows(struct plot_points *points, const struct plot_rows *rows)
{
    const struct bcd_table *table = rows->table;
    *points = (struct plot_points){.log_x = table->log_x, .log_y = table->log_y};
    points->point = calloc(rows->rows + 1, sizeof *points->point);
    if (!points->point)
        return false;
    points->count = rows->rows;
    const struct bcd_column *x = bcd_table_column(table, BCD_ROLE_X);
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const struct bcd_column *error = bcd_table_column(table, BCD_ROLE_STDERR);
    const struct bcd_column *step = bcd_table_column(table, BCD_ROLE_TIME_STEP_ERROR);
    const struct bcd_column *theory = bcd_table_column(table, BCD_ROLE_THEORY);
    for (size_t i = 0; i < points->count; i++) {
        struct plot_point *p = &points->point[i];
        size_t row = rows->first + i;
        p->x = table->scalar ? 0 : at(x, row, points->log_x);
        p->value = isnan(p->x) ? NAN : at(value, row, points->log_y);
        p->theory = isnan(p->x) ? NAN : at(theory, row, points->log_y);
        double e = fabs(at(error, row, false)), s = fabs(at(step, row, false));
        p->low = p->value - e;
        p->high = p->value + e;
        p->step_low = p->value - s;
        p->step_high = p->value + s;
    }
    return true;
}

/* Sizes beyond the largest that ever occurred say nothing. */
static void trim(struct plot_points *points)
{
    while (points->count > 1) {
        const struct plot_point *last = &points->point[points->count - 1];
        if (last->value > 0 || last->high > 0 || last->theory > 0)
            break;
        points->count--;
    }
}

/* How far a point sticks out in the k-th way; NaN = not at all. */
static double prominence(const struct plot_point *p, size_t k)
{
    switch (k) {
    case 0:
        return fmax(p->value, p->high);
    case 1:
        return -fmin(p->value, p->low);
    case 2:
        return p->theory;
    case 3:
        return -p->theory;
    default:
        return isnan(p->value) ? 0 : NAN; /* a gap has to stay one */
    }
}

/* Keeps the first and last row of each bucket, and the one that sticks out most in every way. */
static void thin(struct plot_points *points, size_t limit)
{
    struct plot_point *p = points->point;
    size_t rows = points->count, buckets = limit > 2 * KEPT ? limit / KEPT : 2;
    if (rows <= limit || rows <= buckets * KEPT)
        return;
    points->count = 0;
    for (size_t b = 0; b < buckets; b++) {
        size_t from = b * rows / buckets, to = (b + 1) * rows / buckets;
        size_t keep[KEPT] = {[WAYS] = from, [WAYS + 1] = to - 1};
        for (size_t k = 0; k < WAYS; k++) {
            double most = NAN;
            keep[k] = from;
            for (size_t i = from; i < to; i++)
                if (prominence(&p[i], k) > most || (isnan(most) && !isnan(prominence(&p[i], k)))) {
                    most = prominence(&p[i], k);
                    keep[k] = i;
                }
        }
        /* In order of rows. The kept ones move down, never past one that is still to be read. */
        for (size_t i = from; i < to; i++) {
            bool wanted = false;
            for (size_t k = 0; k < KEPT; k++)
                wanted = wanted || keep[k] == i;
            if (wanted)
                p[points->count++] = p[i];
        }
    }
}

void plot_range_include(struct plot_range *range, double v)
{
    if (isnan(v))
        return;
    range->lo = fmin(range->lo, v);
    range->hi = fmax(range->hi, v);
}

static void measure(struct plot_points *points)
{
    points->x = points->y = (struct plot_range){DBL_MAX, -DBL_MAX};
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        if (isnan(p->value) && isnan(p->theory))
            continue;
        plot_range_include(&points->x, p->x);
        plot_range_include(&points->y, p->value);
        plot_range_include(&points->y, p->theory);
        /* On a logarithmic axis an error bar may reach to 0 and below; a tenth is enough of it.
         * Bars of counts stand on 0. */
        double floor_y = points->log_y                   ? p->value / 10
                         : points->bars && p->value >= 0 ? 0
                                                         : -DBL_MAX;
        plot_range_include(&points->y, isnan(p->low) ? NAN : fmax(p->low, floor_y));
        plot_range_include(&points->y, p->high);
        plot_range_include(&points->y, isnan(p->step_low) ? NAN : fmax(p->step_low, floor_y));
        plot_range_include(&points->y, p->step_high);
        points->errors = points->errors || !isnan(p->low);
        points->steps = points->steps || !isnan(p->step_low);
        points->theory = points->theory || !isnan(p->theory);
    }
    if (points->bars && points->x.lo <= points->x.hi) {
        points->x.lo = 0.5;
        points->x.hi = (double)points->count + 0.5;
        plot_range_include(&points->y, points->log_y ? NAN : 0);
    }
}
