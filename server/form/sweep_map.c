/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_map.h"
#include "limits.h"
#include "plot_axis.h"
#include "plot_words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NONE = SWEEP_AXES_MAX };
/* Pixels: the field of cells, the bar of colours beside it, and the room around. */
enum { LEFT = 96, TOP = 56, FIELD = 480, BELOW = 62, BAR_GAP = 24, BAR = 18, RIGHT = 120 };
enum { TITLE_SIZE = 20, LABEL_SIZE = 15, TICK_SIZE = 12, LABELS_X = 8, LABELS_Y = 12, SHADES = 64 };
enum { TOLD_MAX = 2500 }; /* so many cells say what they are when they are pointed at */

struct cell {
    double sum, square, jobs; /* square: of standard errors */
};

struct sweep_map {
    const struct sweep *sweep;
    size_t x, y; /* axes */
    size_t columns, rows;
    bool log;           /* the scale of colours */
    char label[96];     /* of the values */
    struct cell *cells; /* [rows * columns] */
};

static size_t values_of(const struct sweep *sweep, size_t axis);
static size_t choose(const struct sweep *sweep, const char *name, const char *pointer, size_t not,
                     struct bcd_errors *errors);
static double mean_of(const struct cell *cell);
static bool has_colour(const struct sweep_map *map, double mean);
static bool range_of(const struct sweep_map *map, double range[2]);
static double share_of(const struct sweep_map *map, double value, const double range[2]);
static void add_head(const struct sweep_map *map, struct text *svg, const char *observable);
static void add_cells(const struct sweep_map *map, struct text *svg, const double range[2]);
static void add_axes(const struct sweep_map *map, struct text *svg);
static void add_bar(const struct sweep_map *map, struct text *svg, const double range[2]);
static void describe(const struct sweep_map *map, struct text *text);

struct sweep_map *sweep_map_create(const struct sweep *sweep, const char *x, const char *y,
                                   bool log, struct bcd_errors *errors)
{
    size_t down = choose(sweep, "y", y, NONE, errors);
    size_t along = choose(sweep, "x", x, down, errors);
    if (errors->count == 0 && along == NONE)
        bcd_errors_add(errors, "x", "there is no other axis of several values");
    if (errors->count == 0 &&
        (along == down || sweep_axis_group(sweep, along) == sweep_axis_group(sweep, down)))
        bcd_errors_add(errors, "x", "goes together with y: there are no pairs of their values");
    if (errors->count > 0)
        return NULL;
    size_t columns = values_of(sweep, along), rows = values_of(sweep, down);
    if (columns * rows > LIMIT_MAP_CELLS_MAX) {
        bcd_errors_add(errors, "y", "makes %zu cells; LIMIT_MAP_CELLS_MAX is %d", columns * rows,
                       LIMIT_MAP_CELLS_MAX);
        return NULL;
    }
    struct sweep_map *map = calloc(1, sizeof(*map));
    if (!map)
        return NULL;
    *map = (struct sweep_map){
        .sweep = sweep, .x = along, .y = down, .columns = columns, .rows = rows, .log = log};
    map->cells = calloc(columns * rows + 1, sizeof(*map->cells));
    if (map->cells)
        return map;
    free(map);
    return NULL;
}

void sweep_map_free(struct sweep_map *map)
{
    if (map)
        free(map->cells);
    free(map);
}

bool sweep_map_wants(const struct sweep_map *map, const struct sweep_point *point)
{
    const struct sweep *sweep = map->sweep;
    size_t at[SWEEP_AXES_MAX];
    if (!sweep_place_parse(sweep, point->place, at))
        return false;
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        size_t group = sweep_axis_group(sweep, a);
        bool shown = group == sweep_axis_group(sweep, map->x) ||
                     group == sweep_axis_group(sweep, map->y) ||
                     strcmp(sweep_axis(sweep, a), "/seed") == 0;
        if (!shown && at[group] > 0)
            return false;
    }
    return true;
}

bool sweep_map_add(struct sweep_map *map, const struct sweep_point *point,
                   const struct bcd_table *table)
{
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const struct bcd_column *error = bcd_table_column(table, BCD_ROLE_STDERR);
    size_t at[SWEEP_AXES_MAX];
    if (!table->scalar)
        return false;
    if (!sweep_map_wants(map, point) || !sweep_place_parse(map->sweep, point->place, at))
        return true;
    snprintf(map->label, sizeof(map->label), "%s",
             table->y_label[0] ? table->y_label : table->name);
    if (table->rows == 0 || !value || !value->values || !isfinite(value->values[0]))
        return true;
    size_t column = at[sweep_axis_group(map->sweep, map->x)];
    size_t row = at[sweep_axis_group(map->sweep, map->y)];
    struct cell *cell = &map->cells[row * map->columns + column];
    double e = error && error->values ? error->values[0] : NAN;
    cell->sum += value->values[0];
    cell->square += e * e;
    cell->jobs++;
    return true;
}

char *sweep_map_print(const struct sweep_map *map, const char *observable)
{
    struct text svg = {0};
    double range[2] = {0, 1};
    bool any = range_of(map, range);
    add_head(map, &svg, observable);
    add_cells(map, &svg, range);
    add_axes(map, &svg);
    if (any)
        add_bar(map, &svg, range);
    text_add(&svg, "</svg>\n");
    return text_take(&svg);
}

/* -------------------------------------------------------------------- axes */

static size_t values_of(const struct sweep *sweep, size_t axis)
{
    struct text text = {0};
    size_t count = 0;
    for (; sweep_add_value(&text, sweep, axis, count); count++)
        text.size = 0;
    free(text.bytes);
    return count;
}

/* As it stands in the sweep, or with the slashes after the first escaped. */
static bool same_pointer(const char *axis, const char *asked)
{
    for (; *axis && *asked; axis++, asked++) {
        bool escaped = *axis == '/' && asked[0] == '~' && asked[1] == '1';
        if (!escaped && *axis != *asked)
            return false;
        asked += escaped;
    }
    return *axis == *asked;
}

/* The axis asked for; without one the first of several values that is no seed. */
static size_t choose(const struct sweep *sweep, const char *name, const char *pointer, size_t not,
                     struct bcd_errors *errors)
{
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        bool seed = strcmp(sweep_axis(sweep, a), "/seed") == 0;
        bool asked = pointer && same_pointer(sweep_axis(sweep, a), pointer);
        bool fit = !pointer && a != not &&!seed && values_of(sweep, a) > 1;
        if (asked && seed)
            bcd_errors_add(errors, name, "the map is of means over seeds");
        if (asked || fit)
            return a;
    }
    if (pointer)
        bcd_errors_add(errors, name, "\"%.60s\" is no axis of this sweep", pointer);
    return NONE;
}

/* ------------------------------------------------------------------ colours */

static double mean_of(const struct cell *cell)
{
    return cell->jobs > 0 ? cell->sum / cell->jobs : NAN;
}

static bool has_colour(const struct sweep_map *map, double mean)
{
    return map->log ? mean > 0 : !isnan(mean);
}

/* Lowest and highest mean that have a colour; false when there is none. */
static bool range_of(const struct sweep_map *map, double range[2])
{
    bool any = false;
    for (size_t i = 0; i < map->rows * map->columns; i++) {
        double mean = mean_of(&map->cells[i]);
        if (!has_colour(map, mean))
            continue;
        range[0] = any ? fmin(range[0], mean) : mean;
        range[1] = any ? fmax(range[1], mean) : mean;
        any = true;
    }
    return any;
}

/* Viridis (van der Walt and Smith, 2015): even steps look even, also to the colour-blind, and it
 * grows lighter all the way, so that a print in grey reads the same. share: 0..1. */
static void colour(char hex[8], double share)
{
    static const unsigned char stops[][3] = {{68, 1, 84},    {72, 36, 117},  {65, 68, 135},
                                             {53, 95, 141},  {42, 120, 142}, {33, 145, 140},
                                             {34, 168, 132}, {68, 191, 112}, {122, 209, 81},
                                             {189, 223, 38}, {253, 231, 37}};
    enum { LAST = sizeof(stops) / sizeof(stops[0]) - 1 };
    double at = fmax(0, fmin(1, share)) * LAST;
    int below = at < LAST ? (int)at : LAST - 1, parts[3];
    for (int c = 0; c < 3; c++)
        parts[c] =
            (int)lrint(stops[below][c] + (at - below) * (stops[below + 1][c] - stops[below][c]));
    snprintf(hex, 8, "#%02x%02x%02x", (unsigned)parts[0] & 255, (unsigned)parts[1] & 255,
             (unsigned)parts[2] & 255);
}

static double share_of(const struct sweep_map *map, double value, const double range[2])
{
    if (!(range[1] > range[0]))
        return 0.5;
    return map->log ? log(value / range[0]) / log(range[1] / range[0])
                    : (value - range[0]) / (range[1] - range[0]);
}

/* ------------------------------------------------------------------ drawing */

static void add_rect(struct text *svg, const double box[4], const char *fill)
{
    text_add(svg, "<rect x=\"");
    text_add_number(svg, rint(100 * box[0]) / 100);
    text_add(svg, "\" y=\"");
    text_add_number(svg, rint(100 * box[1]) / 100);
    text_add(svg, "\" width=\"");
    text_add_number(svg, rint(100 * box[2]) / 100);
    text_add(svg, "\" height=\"");
    text_add_number(svg, rint(100 * box[3]) / 100);
    text_add(svg, "\" fill=\"%s\"", fill);
}

static void add_head(const struct sweep_map *map, struct text *svg, const char *observable)
{
    int width = LEFT + FIELD + BAR_GAP + BAR + RIGHT, height = TOP + FIELD + BELOW;
    struct text small = {0};
    describe(map, &small);
    char *subtitle = text_take(&small);
    int lines = plot_small_print(NULL, subtitle ? subtitle : "", 0, width);
    height += lines ? 15 * lines + 4 : 0;
    text_add(svg,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
             "height=\"%d\" role=\"img\" font-family=\"sans-serif\">\n<title>",
             width, height, width, height);
    text_add_xml(svg, observable);
    text_add(svg,
             "</title>\n<defs><pattern id=\"none\" width=\"6\" height=\"6\" "
             "patternUnits=\"userSpaceOnUse\"><rect width=\"6\" height=\"6\" fill=\"#ffffff\"/>"
             "<path d=\"M-1 1L1 -1M0 6L6 0M5 7L7 5\" stroke=\"#888888\"/></pattern>"
             "<pattern id=\"low\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\">"
             "<rect width=\"6\" height=\"6\" fill=\"#ffffff\"/><circle cx=\"3\" cy=\"3\" r=\"1.2\" "
             "fill=\"#888888\"/></pattern></defs>\n"
             "<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n",
             width, height);
    plot_line_print(svg,
                    &(struct plot_line){16, 30, width - 32, TITLE_SIZE, PLOT_START,
                                        "font-weight=\"bold\" fill=\"" PLOT_INK "\""},
                    observable);
    plot_small_print(svg, subtitle ? subtitle : "", height - 8 - 15 * (lines - 1), width);
    svg->failed = svg->failed || !subtitle;
    free(subtitle);
}

static void add_rounded(struct text *text, double v, int digits)
{
    double scale = v == 0 ? 1 : pow(10, digits - 1 - floor(log10(fabs(v))));
    double rounded = rint(v * scale) / scale;
    text_add_number(text, isfinite(rounded) ? rounded : v);
}

/* "diameter = 0.3, potential/amplitude = 2: 1.25 +- 0.02 (4 jobs)" */
static void add_told(const struct sweep_map *map, struct text *svg, size_t row, size_t column)
{
    const struct cell *cell = &map->cells[row * map->columns + column];
    struct text told = {0};
    text_add(&told, "%s = ", sweep_axis(map->sweep, map->x) + 1);
    sweep_add_value(&told, map->sweep, map->x, column);
    text_add(&told, ", %s = ", sweep_axis(map->sweep, map->y) + 1);
    sweep_add_value(&told, map->sweep, map->y, row);
    if (cell->jobs > 0) {
        text_add(&told, ": ");
        add_rounded(&told, mean_of(cell), 6);
        if (cell->square > 0) {
            text_add(&told, " \xC2\xB1 ");
            add_rounded(&told, sqrt(cell->square) / cell->jobs, 2);
        }
        text_add(&told, " (%.0f)", cell->jobs);
    } else {
        text_add(&told, ": no result");
    }
    char *string = text_take(&told);
    text_add(svg, "><title>");
    text_add_xml(svg, string ? string : "");
    text_add(svg, "</title></rect>\n");
    free(string);
}

/* The first row is the lowest. */
static void add_cells(const struct sweep_map *map, struct text *svg, const double range[2])
{
    const double wide = (double)FIELD / (double)map->columns,
                 high = (double)FIELD / (double)map->rows;
    bool told = map->rows * map->columns <= TOLD_MAX;
    text_add(svg, "<g class=\"cells\" shape-rendering=\"crispEdges\">\n");
    for (size_t row = 0; row < map->rows; row++)
        for (size_t column = 0; column < map->columns; column++) {
            const double box[4] = {LEFT + wide * (double)column,
                                   TOP + FIELD - high * (double)(row + 1), wide, high};
            double mean = mean_of(&map->cells[row * map->columns + column]);
            char hex[8];
            bool known = has_colour(map, mean);
            if (known)
                colour(hex, share_of(map, mean, range));
            add_rect(svg, box, known ? hex : isnan(mean) ? "url(#none)" : "url(#low)");
            if (told)
                add_told(map, svg, row, column);
            else
                text_add(svg, "/>\n");
        }
    text_add(svg,
             "</g>\n<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"none\" "
             "stroke=\"" PLOT_INK "\"/>\n",
             LEFT, TOP, FIELD, FIELD);
}

/* A value beside its cells; texts without the quotes of JSON. */
static void add_value(const struct sweep_map *map, struct text *svg, size_t axis, size_t at,
                      const struct plot_line *line)
{
    struct text value = {0};
    double number = sweep_number(map->sweep, axis, at, NULL);
    if (isnan(number))
        sweep_add_value(&value, map->sweep, axis, at);
    else
        add_rounded(&value, number, 4);
    char *string = text_take(&value);
    size_t length = string ? strlen(string) : 0;
    bool quoted = length >= 2 && string[0] == '"';
    if (quoted)
        string[length - 1] = '\0';
    plot_line_print(svg, line, string ? string + quoted : "");
    svg->failed = svg->failed || !string;
    free(string);
}

/* Every n-th value, from the first. */
static void add_axes(const struct sweep_map *map, struct text *svg)
{
    static const char style[] = "fill=\"" PLOT_INK "\"";
    const double wide = (double)FIELD / (double)map->columns,
                 high = (double)FIELD / (double)map->rows;
    size_t every = (map->columns + LABELS_X - 1) / LABELS_X;
    for (size_t i = 0; i < map->columns; i += every)
        add_value(map, svg, map->x, i,
                  &(const struct plot_line){LEFT + wide * ((double)i + 0.5), TOP + FIELD + 18,
                                            wide * (double)every - 6, TICK_SIZE, PLOT_MIDDLE,
                                            style});
    every = (map->rows + LABELS_Y - 1) / LABELS_Y;
    for (size_t i = 0; i < map->rows; i += every)
        add_value(map, svg, map->y, i,
                  &(const struct plot_line){LEFT - 6, TOP + FIELD - high * ((double)i + 0.5) + 4,
                                            LEFT - 36, TICK_SIZE, PLOT_END, style});
    plot_line_print(svg,
                    &(const struct plot_line){LEFT + FIELD / 2.0, TOP + FIELD + 44, FIELD,
                                              LABEL_SIZE, PLOT_MIDDLE, style},
                    sweep_axis(map->sweep, map->x) + 1);
    text_add(svg, "<g transform=\"translate(24 %d) rotate(-90)\">\n", TOP + FIELD / 2);
    plot_line_print(svg, &(const struct plot_line){0, 0, FIELD, LABEL_SIZE, PLOT_MIDDLE, style},
                    sweep_axis(map->sweep, map->y) + 1);
    text_add(svg, "</g>\n");
}

/* Numbers beside the bar; within a decade or so, where a logarithmic axis has few, those of its
 * ends. */
static void choose_ticks(const struct plot_axis *axis, struct plot_ticks *ticks)
{
    size_t majors = 0;
    *ticks = (struct plot_ticks){.count = 1, .tick = {{.at = axis->min, .major = true}}};
    if (!(axis->max > axis->min))
        return;
    *ticks = (struct plot_ticks){0};
    plot_axis_ticks(axis, 6, ticks);
    for (size_t i = 0; i < ticks->count; i++)
        majors += ticks->tick[i].major;
    if (axis->log && majors < 2)
        *ticks = (struct plot_ticks){
            .count = 2,
            .tick = {{.at = axis->min, .major = true}, {.at = axis->max, .major = true}}};
}

/* Which colour is which value, and what hatching is. */
static void add_bar(const struct sweep_map *map, struct text *svg, const double range[2])
{
    static const char style[] = "fill=\"" PLOT_INK "\"";
    const double left = LEFT + FIELD + BAR_GAP, step = (double)FIELD / SHADES;
    struct plot_axis axis = {
        .log = map->log, .min = range[0], .max = range[1], .from = TOP + FIELD, .to = TOP};
    struct plot_ticks ticks;
    text_add(svg, "<g class=\"scale\" shape-rendering=\"crispEdges\">\n");
    for (int i = 0; i < SHADES; i++) {
        char hex[8];
        colour(hex, range[1] > range[0] ? (i + 0.5) / SHADES : 0.5);
        add_rect(svg, (const double[4]){left, TOP + FIELD - step * (i + 1), BAR, step}, hex);
        text_add(svg, "/>\n");
    }
    text_add(svg, "</g>\n");
    choose_ticks(&axis, &ticks);
    for (size_t i = 0; i < ticks.count; i++) {
        struct text label = {0};
        if (!ticks.tick[i].major)
            continue;
        bool zero = !map->log && fabs(ticks.tick[i].at) < 1e-12 * (range[1] - range[0]);
        add_rounded(&label, zero ? 0 : ticks.tick[i].at, map->log ? 4 : 6);
        char *string = text_take(&label);
        double y =
            range[1] > range[0] ? plot_axis_pixel(&axis, ticks.tick[i].at) : TOP + FIELD / 2.0;
        plot_line_print(svg,
                        &(const struct plot_line){left + BAR + 6, y + 4, RIGHT - 30, TICK_SIZE,
                                                  PLOT_START, style},
                        string ? string : "");
        free(string);
    }
    text_add(svg, "<g transform=\"translate(%d %d) rotate(-90)\">\n",
             LEFT + FIELD + BAR_GAP + BAR + RIGHT - 10, TOP + FIELD / 2);
    plot_line_print(svg, &(const struct plot_line){0, 0, FIELD, LABEL_SIZE, PLOT_MIDDLE, style},
                    map->label);
    text_add(svg, "</g>\n");
}

/* What is not seen: "mean over seeds; /time = 2; hatched: no result yet". */
static void describe(const struct sweep_map *map, struct text *text)
{
    const struct sweep *sweep = map->sweep;
    size_t missing = 0, low = 0;
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        size_t group = sweep_axis_group(sweep, a);
        bool shown =
            group == sweep_axis_group(sweep, map->x) || group == sweep_axis_group(sweep, map->y);
        if (shown || values_of(sweep, a) < 2)
            continue;
        text_add(text, text->size > 0 ? "; " : "");
        if (strcmp(sweep_axis(sweep, a), "/seed") == 0) {
            text_add(text, "mean over seeds");
        } else {
            text_add(text, "%s = ", sweep_axis(sweep, a) + 1);
            sweep_add_value(text, sweep, a, 0);
        }
    }
    for (size_t i = 0; i < map->rows * map->columns; i++) {
        missing += map->cells[i].jobs == 0;
        low += map->cells[i].jobs > 0 && !has_colour(map, mean_of(&map->cells[i]));
    }
    if (map->log)
        text_add(text, "%slogarithmic colours", text->size > 0 ? "; " : "");
    if (low > 0)
        text_add(text, "; dotted: not above 0 (%zu of %zu cells)", low, map->rows * map->columns);
    if (missing > 0)
        text_add(text, "%shatched: no result (%zu of %zu cells)", text->size > 0 ? "; " : "",
                 missing, map->rows * map->columns);
}
