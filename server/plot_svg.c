/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A plot is 800 wide and 540 high (one number: 276): title, legend, frame, axis titles and small
 * print below one another, so that nothing ever lies over the data. Colours are Okabe and Ito's,
 * told apart by colour-blind readers, and lines differ in their dashes as well.
 */
#include "plot_svg.h"
#include "plot_axis.h"
#include "plot_marks.h"
#include "plot_points.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 800, HEIGHT = 540, SCALAR_HEIGHT = 276, RIGHT = WIDTH - 28, SMALL_LINES_MAX = 3 };
enum { TITLE_SIZE = 18, LABEL_SIZE = 15, TICK_SIZE = 13, SMALL_SIZE = 11 };

#define INK "#222222"
#define PALE "#595959"
#define GRID "#e4e4e4"

static void open_picture(struct text *svg, const struct bcd_table *table, const char *title,
                         int height);
static void draw_plot(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                      const char *subtitle);
static void draw_scalar(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                        const char *subtitle);

char *plot_svg_print(const struct bcd_table *table, const char *title, const char *subtitle)
{
    struct text svg = {0};
    struct plot_points points;
    if (!plot_points_init(&points, table))
        return NULL;
    open_picture(&svg, table, title, table->scalar ? SCALAR_HEIGHT : HEIGHT);
    if (table->scalar)
        draw_scalar(&svg, table, &points, subtitle ? subtitle : "");
    else
        draw_plot(&svg, table, &points, subtitle ? subtitle : "");
    text_add(&svg, "</svg>\n");
    plot_points_fini(&points);
    return text_take(&svg);
}

/* ------------------------------------------------------------------- words */

enum anchor { START, MIDDLE, END };

/* One line of text, made smaller when it is too long for `room` pixels, and cut with an ellipsis
 * when even that is not enough. `style` are further attributes. */
struct line {
    double x, y, room;
    int size;
    enum anchor anchor;
    const char *style;
};

static size_t characters(const char *string)
{
    size_t n = 0;
    for (const char *c = string; *c; c++)
        n += ((unsigned char)*c & 0xC0) != 0x80;
    return n;
}

/* Adds at most `most` characters of the string; the rest becomes an ellipsis. */
static void add_cut(struct text *svg, const char *string, size_t most)
{
    char shown[1024];
    size_t size = 0, n = 0;
    bool cut = characters(string) > most;
    for (const char *c = string; *c && size + 8 < sizeof shown; c++) {
        n += ((unsigned char)*c & 0xC0) != 0x80;
        if (cut && n >= most)
            break;
        shown[size++] = *c;
    }
    shown[size] = '\0';
    text_add_xml(svg, shown);
    if (cut)
        text_add(svg, "\xE2\x80\xA6");
}

static void add_line(struct text *svg, const struct line *line, const char *string)
{
    static const char *const anchors[] = {"start", "middle", "end"};
    double size = line->size, width = 0.6 * (double)characters(string);
    if (width * size > line->room)
        size = fmax(floor(line->room / width), 0.7 * size);
    text_add(svg, "<text x=\"");
    plot_add_pixel(svg, line->x);
    text_add(svg, "\" y=\"");
    plot_add_pixel(svg, line->y);
    text_add(svg, "\" font-size=\"");
    plot_add_pixel(svg, size);
    text_add(svg, "\" text-anchor=\"%s\" %s>", anchors[line->anchor], line->style);
    add_cut(svg, string, (size_t)(line->room / (0.6 * size)));
    text_add(svg, "</text>\n");
}

/* The small print, broken at spaces. Draws when svg is given; returns the number of lines. */
static int small_print(struct text *svg, const char *string, int y)
{
    size_t most = (size_t)((WIDTH - 32) / (0.54 * SMALL_SIZE));
    int lines = 0;
    while (*string && lines < SMALL_LINES_MAX) {
        char piece[1024];
        size_t n = 0, size = 0, end = 0;
        for (; string[size] && size + 1 < sizeof piece; size++) {
            n += ((unsigned char)string[size] & 0xC0) != 0x80;
            if (n > most)
                break;
            if (string[size] == ' ')
                end = size;
        }
        bool last = lines + 1 == SMALL_LINES_MAX;
        if (string[size] == '\0' || end == 0)
            end = size;
        snprintf(piece, sizeof piece, "%.*s%s", (int)end, string,
                 last && string[end] ? "\xE2\x80\xA6" : "");
        if (svg)
            add_line(svg,
                     &(struct line){16, y + 15 * lines, 2 * WIDTH, SMALL_SIZE, START,
                                    "fill=\"" PALE "\""},
                     piece);
        string += end + strspn(string + end, " ");
        lines++;
    }
    return lines;
}

static void open_picture(struct text *svg, const struct bcd_table *table, const char *title,
                         int height)
{
    text_add(svg,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
             "height=\"%d\" role=\"img\" font-family=\"sans-serif\">\n<title>",
             WIDTH, height, WIDTH, height);
    text_add_xml(svg, title);
    text_add(svg, "</title>\n<desc>");
    text_add_xml(svg, table->y_label[0] ? table->y_label : table->name);
    if (!table->scalar && table->x_label[0]) {
        text_add(svg, " against ");
        text_add_xml(svg, table->x_label);
    }
    for (size_t i = 0; i < table->notes && i < BCD_NOTES_MAX; i++) {
        text_add(svg, "; ");
        text_add_xml(svg, table->note[i].name);
        text_add(svg, ": ");
        if (table->note[i].text[0])
            text_add_xml(svg, table->note[i].text);
        else
            text_add_number(svg, table->note[i].number);
    }
    text_add(svg, "</desc>\n<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n", WIDTH, height);
    add_line(svg,
             &(struct line){16, 30, WIDTH - 32, TITLE_SIZE, START,
                            "font-weight=\"bold\" fill=\"" INK "\""},
             title);
}

/* ------------------------------------------------------------------ legend */

static double add_key(struct text *svg, double x, double y, const char *mark, const char *string)
{
    text_add(svg, "<g transform=\"translate(");
    plot_add_pixel(svg, x);
    text_add(svg, " ");
    plot_add_pixel(svg, y);
    text_add(svg, ")\">%s</g>\n", mark);
    add_line(svg, &(struct line){x + 30, y + 4.5, 300, TICK_SIZE, START, "fill=\"" INK "\""},
             string);
    return x + 30 + 0.6 * TICK_SIZE * (double)characters(string) + 22;
}

static void add_legend(struct text *svg, const struct bcd_table *table,
                       const struct plot_points *points, double x, double y)
{
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    x = add_key(svg, x, y, points->bars ? PLOT_KEY_BAR : PLOT_KEY_VALUE,
                value ? value->name : table->name);
    if (points->errors)
        x = add_key(svg, x, y, points->bars || table->scalar ? PLOT_KEY_WHISKER : PLOT_KEY_BAND,
                    "\xC2\xB1 standard error");
    if (points->steps)
        x = add_key(svg, x, y, PLOT_KEY_STEP, "time-step error");
    if (points->theory)
        add_key(svg, x, y, PLOT_KEY_THEORY, "theory");
}

/* -------------------------------------------------------------------- plot */

static void add_segment(struct text *svg, const double from[2], const double to[2],
                        const char *style)
{
    static const char *const names[] = {"x1", "y1", "x2", "y2"};
    const double v[] = {from[0], from[1], to[0], to[1]};
    text_add(svg, "<line");
    for (size_t i = 0; i < 4; i++) {
        text_add(svg, " %s=\"", names[i]);
        plot_add_pixel(svg, v[i]);
        text_add(svg, "\"");
    }
    text_add(svg, " %s/>\n", style);
}

static void add_tick_label(struct text *svg, const struct plot_tick *tick, double x, double y,
                           enum anchor anchor)
{
    text_add(svg, "<text x=\"");
    plot_add_pixel(svg, x);
    text_add(svg, "\" y=\"");
    plot_add_pixel(svg, y);
    text_add(svg, "\" font-size=\"%d\" text-anchor=\"%s\" fill=\"" INK "\">", TICK_SIZE,
             anchor == END ? "end" : "middle");
    plot_tick_print(tick, TICK_SIZE, svg);
    text_add(svg, "</text>\n");
}

/* Grid line, tick and label of every tick along the bottom of the frame. */
static void add_x_axis(struct text *svg, const struct plot_axis *x, const struct plot_axis *y,
                       const struct plot_ticks *ticks)
{
    for (size_t i = 0; i < ticks->count; i++) {
        const struct plot_tick *tick = &ticks->tick[i];
        double at = plot_axis_pixel(x, tick->at);
        if (tick->major)
            add_segment(svg, (double[]){at, y->from}, (double[]){at, y->to}, "stroke=\"" GRID "\"");
        add_segment(svg, (double[]){at, y->from}, (double[]){at, y->from + (tick->major ? 6 : 3)},
                    "stroke=\"" INK "\"");
        if (tick->major)
            add_tick_label(svg, tick, at, y->from + 21, MIDDLE);
    }
}

static void add_y_axis(struct text *svg, const struct plot_axis *x, const struct plot_axis *y,
                       const struct plot_ticks *ticks)
{
    for (size_t i = 0; i < ticks->count; i++) {
        const struct plot_tick *tick = &ticks->tick[i];
        double at = plot_axis_pixel(y, tick->at);
        if (tick->major)
            add_segment(svg, (double[]){x->from, at}, (double[]){x->to, at}, "stroke=\"" GRID "\"");
        add_segment(svg, (double[]){x->from - (tick->major ? 6 : 3), at}, (double[]){x->from, at},
                    "stroke=\"" INK "\"");
        if (tick->major)
            add_tick_label(svg, tick, x->from - 9, at + 4.5, END);
    }
}

/* The power of ten that all labels of an axis share, at the axis's end. */
static void add_factor(struct text *svg, const struct plot_ticks *ticks, double x, double y)
{
    struct plot_tick factor = {.power = true, .exponent = ticks->exponent, .text = "\xC3\x97 10"};
    if (ticks->exponent != 0)
        add_tick_label(svg, &factor, x, y, END);
}

static double widest(const struct plot_ticks *ticks)
{
    double width = 0;
    for (size_t i = 0; i < ticks->count; i++)
        if (ticks->tick[i].major)
            width = fmax(width, plot_tick_width(&ticks->tick[i], TICK_SIZE));
    return width;
}

/* As many labels along x as fit beside one another, at most `wanted`. */
static void x_ticks(const struct plot_axis *x, int wanted, struct plot_ticks *ticks)
{
    size_t labels;
    do {
        plot_axis_ticks(x, wanted, ticks);
        labels = 0;
        for (size_t i = 0; i < ticks->count; i++)
            labels += ticks->tick[i].major;
    } while ((double)labels * (widest(ticks) + 14) > fabs(x->to - x->from) && --wanted > 1);
}

/* Fits both axes to the points and lays them out between the margins. */
static void lay_out(const struct plot_points *points, struct plot_axis *x, struct plot_axis *y,
                    struct plot_ticks ticks[2])
{
    enum plot_fit along = points->bars ? PLOT_FIT_BARS : PLOT_FIT_ALONG;
    bool empty = points->x.lo > points->x.hi || points->y.lo > points->y.hi;
    struct plot_range rx = empty ? (struct plot_range){1, 10} : points->x;
    struct plot_range ry = empty ? (struct plot_range){1, 10} : points->y;
    plot_axis_fit(y, ry.lo, ry.hi, points->bars ? PLOT_FIT_BARS : PLOT_FIT_ACROSS);
    plot_axis_ticks(y, 6, &ticks[1]);
    if (along == PLOT_FIT_BARS) {
        x->min = rx.lo;
        x->max = rx.hi;
    } else {
        plot_axis_fit(x, rx.lo, rx.hi, along);
    }
    x->from = 52 + widest(&ticks[1]);
    x->to = RIGHT;
    /* Bars are labelled by whole numbers only: never more labels than bars. */
    x_ticks(x, points->bars && points->count < 8 ? (int)points->count : 8, &ticks[0]);
}

static void add_nothing(struct text *svg, const struct bcd_table *table, const struct plot_axis *x,
                        const struct plot_axis *y)
{
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const char *reason = value && !value->values ? value->reason : "";
    double middle = (x->from + x->to) / 2;
    struct line line = {middle, (y->from + y->to) / 2, x->to - x->from - 20, TITLE_SIZE,
                        MIDDLE, "fill=\"" PALE "\""};
    add_line(svg, &line, "no data");
    line.y += 24;
    line.size = TICK_SIZE;
    if (reason[0])
        add_line(svg, &line, reason);
}

static void draw_plot(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                      const char *subtitle)
{
    struct plot_ticks ticks[2];
    struct plot_axis x = {.log = points->log_x}, y = {.log = points->log_y, .to = 76};
    int lines = small_print(NULL, subtitle, 0);
    bool empty = points->x.lo > points->x.hi;
    y.from = HEIGHT - 62 - (lines ? 15 * lines + 8 : 0);
    lay_out(points, &x, &y, ticks);
    if (!empty) {
        add_x_axis(svg, &x, &y, &ticks[0]);
        add_y_axis(svg, &x, &y, &ticks[1]);
        add_factor(svg, &ticks[0], x.to, y.from + 44);
        add_factor(svg, &ticks[1], x.from - 9, y.to - 12);
        add_legend(svg, table, points, x.from + 4, y.to - 19);
        plot_marks_print(svg, points, &x, &y);
        if (strcmp(table->name, "msd") == 0)
            plot_guides_print(svg, points, &x, &y);
    } else {
        add_nothing(svg, table, &x, &y);
    }
    text_add(svg, "<path class=\"frame\" d=\"");
    plot_add_point(svg, 'M', x.from, y.to);
    plot_add_point(svg, 'L', x.from, y.from);
    plot_add_point(svg, 'L', x.to, y.from);
    text_add(svg, "\" fill=\"none\" stroke=\"" INK "\"/>\n");
    double middle = (y.from + y.to) / 2;
    add_line(svg,
             &(struct line){(x.from + x.to) / 2, y.from + 44, x.to - x.from - 120, LABEL_SIZE,
                            MIDDLE, "fill=\"" INK "\""},
             table->x_label);
    text_add(svg, "<g transform=\"translate(24 %d) rotate(-90)\">\n", (int)middle);
    add_line(svg, &(struct line){0, 0, y.from - y.to, LABEL_SIZE, MIDDLE, "fill=\"" INK "\""},
             table->y_label[0] ? table->y_label : table->name);
    text_add(svg, "</g>\n");
    small_print(svg, subtitle, HEIGHT - 6 - 15 * (lines - 1));
}

/* ------------------------------------------------------------------ scalar */

/* " x 10^n", the exponent in raised digits; nothing for n = 0. */
static void print_power(char *out, size_t size, int power)
{
    static const char *const raised[] = {
        "\xE2\x81\xB0", "\xC2\xB9",     "\xC2\xB2",     "\xC2\xB3",     "\xE2\x81\xB4",
        "\xE2\x81\xB5", "\xE2\x81\xB6", "\xE2\x81\xB7", "\xE2\x81\xB8", "\xE2\x81\xB9"};
    char digits[16];
    out[0] = '\0';
    if (power == 0)
        return;
    snprintf(digits, sizeof digits, "%d", power < 0 ? -power : power);
    size_t n = (size_t)snprintf(out, size, " \xC3\x97 10%s", power < 0 ? "\xE2\x81\xBB" : "");
    for (const char *d = digits; *d && n + 4 < size; d++)
        n += (size_t)snprintf(out + n, size - n, "%s", raised[*d - '0']);
}

/* "0.7960 +- 0.0021": the error to two digits, the value as far as they reach. Without an error
 * (NaN) the value to six digits. */
static void print_value(char *out, size_t size, double value, double error)
{
    bool alone = isnan(error);
    double scale = fmax(fabs(value), alone ? 0 : error);
    int exponent = scale > 0 ? (int)floor(log10(scale)) : 0;
    int power = exponent < -3 || exponent > 5 ? exponent : 0;
    double finest = error > 0 ? floor(log10(error)) - 1 : exponent - 5;
    int digits = (int)fmin(fmax(power - finest, 0), 12);
    char v[48], e[48], times[48];
    /* In two steps: 10^-power need not be a double. */
    double half = pow(10, power / 2), rest = pow(10, power - power / 2);
    plot_print_fixed(v, sizeof v, value / half / rest, digits);
    plot_print_fixed(e, sizeof e, alone ? 0 : error / half / rest, digits);
    if (alone && strchr(v, '.')) { /* "2.50000" */
        size_t end = strlen(v);
        while (v[end - 1] == '0')
            end--;
        v[v[end - 1] == '.' ? end - 1 : end] = '\0';
    }
    print_power(times, sizeof times, power);
    if (alone)
        snprintf(out, size, "%s%s", v, times);
    else
        snprintf(out, size, power ? "(%s \xC2\xB1 %s)%s" : "%s \xC2\xB1 %s%s", v, e, times);
}

/* Value, whisker of one standard error, and theory on a line of numbers. */
static void draw_scalar(struct text *svg, const struct bcd_table *table, struct plot_points *points,
                        const char *subtitle)
{
    struct plot_point p = points->count ? points->point[0] : (struct plot_point){.value = NAN};
    struct plot_axis x = {.from = 40, .to = WIDTH - 40}, y = {.from = 186, .to = 136};
    struct plot_ticks ticks;
    char words[160], theory[80];
    int lines = small_print(NULL, subtitle, 0);
    if (isnan(p.value)) {
        add_nothing(svg, table, &x, &y);
        small_print(svg, subtitle, SCALAR_HEIGHT - 8 - 15 * (lines - 1));
        return;
    }
    double error = p.high - p.value;
    print_value(words, sizeof words, p.value, error);
    add_line(svg, &(struct line){16, 72, 520, 30, START, "fill=\"" PLOT_BLUE "\""}, words);
    if (points->theory) {
        print_value(theory, sizeof theory, p.theory, NAN);
        snprintf(words, sizeof words, "theory %s", theory);
        add_line(svg, &(struct line){WIDTH - 16, 72, 300, 18, END, "fill=\"" PLOT_RED "\""}, words);
    }
    add_line(svg, &(struct line){16, 98, WIDTH - 32, LABEL_SIZE, START, "fill=\"" INK "\""},
             table->y_label[0] ? table->y_label : table->name);
    plot_axis_fit(&x, points->y.lo, points->y.hi, PLOT_FIT_ACROSS);
    x_ticks(&x, 7, &ticks);
    add_x_axis(svg, &x, &y, &ticks);
    add_factor(svg, &ticks, x.to, y.from + 38);
    add_segment(svg, (double[]){x.from, y.from}, (double[]){x.to, y.from}, "stroke=\"" INK "\"");
    plot_scalar_print(svg, &p, &x, (y.from + y.to) / 2);
    add_legend(svg, table, points, 40, 118);
    small_print(svg, subtitle, SCALAR_HEIGHT - 8 - 15 * (lines - 1));
}
