/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_plot.h"
#include "plot_figure.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NONE = SWEEP_AXES_MAX, ROWS_MAX = 2000 };
enum { X, VALUE, STDERR, COLUMNS };

/* Sums over the jobs of one curve, row by row. */
struct family {
    size_t at;                /* index into the values of the axis of curves */
    size_t rows;              /* along x */
    double *x, *sum, *square; /* [rows]: square: of standard errors */
    double *jobs;             /* [rows]: how many went into the sums */
    char label[PLOT_LABEL_SIZE];
    struct bcd_table table; /* when it is printed */
};

struct sweep_plot {
    const struct sweep *sweep;
    size_t along, curves; /* axes; NONE */
    struct family family[PLOT_STYLES];
    size_t count;
    struct bcd_table first;            /* what tables are like: labels, scales, name; no values */
    bool known, scalar, failed, asked; /* asked: for these curves */
};

static size_t values_of(const struct sweep *sweep, size_t axis);
static bool numeric(const struct sweep *sweep, size_t axis);
static bool is_seed(const struct sweep *sweep, size_t axis);
static size_t choose(const struct sweep *sweep, const char *name, const char *pointer, size_t not,
                     struct bcd_errors *errors);
static size_t shown(const struct sweep_plot *plot, size_t at);
static bool belongs(const struct sweep_plot *plot, const size_t at[SWEEP_AXES_MAX]);
static bool begin_family(struct sweep_plot *plot, struct family *family, size_t at, size_t rows);
static void add_row(struct family *family, size_t row, double x, const struct bcd_table *table,
                    size_t from);
static void fill_table(const struct sweep_plot *plot, struct family *family, double *values);
static void describe(const struct sweep_plot *plot, struct text *text);

struct sweep_plot *sweep_plot_create(const struct sweep *sweep, const char *along,
                                     const char *curves, struct bcd_errors *errors)
{
    struct sweep_plot *plot = calloc(1, sizeof(*plot));
    if (!plot)
        return NULL;
    plot->sweep = sweep;
    plot->asked = curves != NULL;
    plot->curves = curves ? choose(sweep, "curves", curves, NONE, errors) : NONE;
    plot->along = choose(sweep, "x", along, plot->curves, errors);
    if (!curves)
        plot->curves = choose(sweep, "curves", NULL, plot->along, errors);
    if (along && plot->along != NONE && !numeric(sweep, plot->along))
        bcd_errors_add(errors, "x", "%s does not go through numbers", along);
    if (errors->count == 0)
        return plot;
    free(plot);
    return NULL;
}

void sweep_plot_free(struct sweep_plot *plot)
{
    for (size_t i = 0; plot && i < plot->count; i++)
        free(plot->family[i].x);
    free(plot);
}

/* Before the first table is known, everything may be. */
bool sweep_plot_wants(const struct sweep_plot *plot, const struct sweep_point *point)
{
    size_t at[SWEEP_AXES_MAX];
    return !plot->known || (sweep_place_parse(plot->sweep, point->place, at) && belongs(plot, at));
}

void sweep_plot_add(struct sweep_plot *plot, const struct sweep_point *point,
                    const struct bcd_table *table)
{
    size_t at[SWEEP_AXES_MAX], i = 0;
    if (!plot->known) {
        plot->known = true;
        plot->scalar = table->scalar;
        plot->first = *table;
        plot->first.rows = plot->first.columns = plot->first.notes = 0;
        /* A list has its own x: the first axis is then one of curves. */
        if (!plot->scalar && !plot->asked)
            plot->curves = choose(plot->sweep, "curves", NULL, NONE, NULL);
    }
    if (table->scalar != plot->scalar || !sweep_place_parse(plot->sweep, point->place, at) ||
        !belongs(plot, at))
        return;
    size_t curve = plot->curves == NONE ? 0 : at[sweep_axis_group(plot->sweep, plot->curves)];
    if (shown(plot, curve) == NONE)
        return;
    size_t rows =
        plot->scalar ? plot->along == NONE ? 1 : values_of(plot->sweep, plot->along) : table->rows;
    while (i < plot->count && plot->family[i].at != curve)
        i++;
    if (i == plot->count && !begin_family(plot, &plot->family[i], curve, rows))
        return;
    struct family *family = &plot->family[i];
    if (plot->scalar) {
        size_t row = plot->along == NONE ? 0 : at[sweep_axis_group(plot->sweep, plot->along)];
        double x = plot->along == NONE ? 0 : sweep_number(plot->sweep, plot->along, row, NULL);
        if (row < family->rows && table->rows > 0)
            add_row(family, row, x, table, 0);
        return;
    }
    const struct bcd_column *x = bcd_table_column(table, BCD_ROLE_X);
    for (size_t row = 0; x && x->values && row < table->rows && row < family->rows; row++)
        add_row(family, row, x->values[row], table, row);
}

char *sweep_plot_print(const struct sweep_plot *plot, const char *observable)
{
    struct plot_curve curves[PLOT_STYLES];
    struct sweep_plot copy = *plot; /* tables are filled in, nothing is owned */
    struct text small = {0};
    double *values[PLOT_STYLES] = {NULL};
    char *svg = NULL, *subtitle;
    bool sound = !plot->failed;
    for (size_t i = 0; i < plot->count && sound; i++) {
        struct family *family = &copy.family[i];
        values[i] = calloc(COLUMNS * family->rows + 1, sizeof(double));
        sound = values[i] != NULL;
        if (sound)
            fill_table(plot, family, values[i]);
        curves[i] = (struct plot_curve){.table = &family->table, .label = family->label};
    }
    describe(plot, &small);
    subtitle = text_take(&small);
    const struct plot_panel panel = {.curves = plot->count > 0 ? curves : NULL,
                                     .curve_count = plot->count};
    const struct plot_figure figure = {
        .title = observable, .subtitle = subtitle, .rows = 1, .columns = 1, .panels = &panel};
    if (sound)
        svg = plot_figure_print(&figure);
    for (size_t i = 0; i < PLOT_STYLES; i++)
        free(values[i]);
    free(subtitle);
    return svg;
}

static size_t values_of(const struct sweep *sweep, size_t axis)
{
    struct text text = {0};
    size_t count = 0;
    while (sweep_add_value(&text, sweep, axis, count))
        count++;
    free(text.bytes);
    return count;
}

static bool numeric(const struct sweep *sweep, size_t axis)
{
    struct text text = {0};
    bool numbers = true;
    for (size_t i = 0; numbers && sweep_add_value(&text, sweep, axis, i); i++)
        numbers = !isnan(sweep_number(sweep, axis, i, NULL));
    free(text.bytes);
    return numbers;
}

static bool is_seed(const struct sweep *sweep, size_t axis)
{
    return strcmp(sweep_axis(sweep, axis), "/seed") == 0;
}

/* The axis asked for; without one the first of several values that is no seed. */
static size_t choose(const struct sweep *sweep, const char *name, const char *pointer, size_t not,
                     struct bcd_errors *errors)
{
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        bool asked = pointer && strcmp(sweep_axis(sweep, a), pointer) == 0;
        bool fit = !pointer && a != not &&!is_seed(sweep, a) && values_of(sweep, a) > 1 &&
                   (strcmp(name, "x") != 0 || numeric(sweep, a));
        if (asked && a == not )
            bcd_errors_add(errors, name, "%s tells the curves apart already", pointer);
        if (asked || fit)
            return a;
    }
    if (pointer)
        bcd_errors_add(errors, name, "\"%.60s\" is no axis of this sweep", pointer);
    return NONE;
}

/* Which place among those shown a curve has, NONE: too many, this one is left out. */
static size_t shown(const struct sweep_plot *plot, size_t at)
{
    size_t count = plot->curves == NONE ? 1 : values_of(plot->sweep, plot->curves);
    if (count <= PLOT_STYLES)
        return at;
    for (size_t i = 0; i < PLOT_STYLES; i++)
        if (i * (count - 1) / (PLOT_STYLES - 1) == at)
            return i;
    return NONE;
}

/* Is the point on a curve: all other axes but seeds at their first value? */
static bool belongs(const struct sweep_plot *plot, const size_t at[SWEEP_AXES_MAX])
{
    const struct sweep *sweep = plot->sweep;
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        size_t group = sweep_axis_group(sweep, a);
        bool drawn = a == plot->curves || (plot->scalar && a == plot->along);
        bool beside = plot->curves != NONE && group == sweep_axis_group(sweep, plot->curves);
        beside = beside || (plot->scalar && plot->along != NONE &&
                            group == sweep_axis_group(sweep, plot->along));
        if (!drawn && !beside && !is_seed(sweep, a) && at[group] > 0)
            return false;
    }
    return true;
}

static bool begin_family(struct sweep_plot *plot, struct family *family, size_t at, size_t rows)
{
    struct text value = {0};
    *family = (struct family){.at = at, .rows = rows < ROWS_MAX ? rows : ROWS_MAX};
    family->x = calloc(4 * family->rows + 1, sizeof(double));
    if (!family->x) {
        plot->failed = true;
        return false;
    }
    family->sum = family->x + family->rows;
    family->square = family->sum + family->rows;
    family->jobs = family->square + family->rows;
    if (plot->curves != NONE) {
        sweep_add_value(&value, plot->sweep, plot->curves, at);
        char *text = text_take(&value);
        snprintf(family->label, sizeof(family->label), "%.40s = %.20s",
                 sweep_axis(plot->sweep, plot->curves) + 1, text ? text : "");
        free(text);
    }
    plot->count++;
    return true;
}

static void add_row(struct family *family, size_t row, double x, const struct bcd_table *table,
                    size_t from)
{
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const struct bcd_column *error = bcd_table_column(table, BCD_ROLE_STDERR);
    if (!value || !value->values || !isfinite(value->values[from]))
        return;
    double e = error && error->values ? error->values[from] : NAN;
    family->x[row] = x;
    family->sum[row] += value->values[from];
    family->square[row] += e * e;
    family->jobs[row]++;
}

/* Means, with the error of independent runs. */
static void fill_table(const struct sweep_plot *plot, struct family *family, double *values)
{
    struct bcd_table *table = &family->table;
    *table = plot->first;
    table->scalar = false;
    table->rows = family->rows;
    table->columns = COLUMNS;
    if (plot->scalar) {
        table->log_x = table->log_y = false;
        snprintf(table->x_label, sizeof(table->x_label), "%.60s",
                 plot->along == NONE ? "" : sweep_axis(plot->sweep, plot->along) + 1);
    }
    static const enum bcd_role roles[COLUMNS] = {BCD_ROLE_X, BCD_ROLE_VALUE, BCD_ROLE_STDERR};
    static const char *const names[COLUMNS] = {"x", "value", "stderr"};
    for (size_t c = 0; c < COLUMNS; c++) {
        table->column[c] =
            (struct bcd_column){.role = roles[c], .values = values + c * family->rows};
        snprintf(table->column[c].name, sizeof(table->column[c].name), "%s", names[c]);
    }
    for (size_t row = 0; row < family->rows; row++) {
        double n = family->jobs[row];
        table->column[X].values[row] = n > 0 ? family->x[row] : NAN;
        table->column[VALUE].values[row] = n > 0 ? family->sum[row] / n : NAN;
        table->column[STDERR].values[row] = n > 0 ? sqrt(family->square[row]) / n : NAN;
    }
}

/* What is not seen: "mean over seeds; /time = 2". */
static void describe(const struct sweep_plot *plot, struct text *text)
{
    const struct sweep *sweep = plot->sweep;
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        bool drawn = a == plot->curves || (plot->scalar && a == plot->along);
        if (drawn || values_of(sweep, a) < 2)
            continue;
        text_add(text, text->size > 0 ? "; " : "");
        if (is_seed(sweep, a)) {
            text_add(text, "mean over seeds");
        } else {
            text_add(text, "%s = ", sweep_axis(sweep, a) + 1);
            sweep_add_value(text, sweep, a, 0);
        }
    }
    if (plot->curves != NONE && values_of(sweep, plot->curves) > PLOT_STYLES)
        text_add(text, "%s%d of %zu curves", text->size > 0 ? "; " : "", PLOT_STYLES,
                 values_of(sweep, plot->curves));
    if (plot->count == 0)
        text_add(text, "%sno results yet", text->size > 0 ? "; " : "");
}
