/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "plot_marks.h"

#include <math.h>

enum { DOTS_MAX = 80 }; /* more points than that are shown as a line only */

static void print_steps(struct text *svg, const struct plot_points *points,
                        const struct plot_axis *x, const struct plot_axis *y);
static void print_bars(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y);
static void print_bands(struct text *svg, const struct plot_points *points,
                        const struct plot_axis *x, const struct plot_axis *y);
static void print_line(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y);
static void print_dots(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y);
static void print_theory(struct text *svg, const struct plot_points *points,
                         const struct plot_axis *x, const struct plot_axis *y, const char *style);
static bool print_guide(struct text *svg, const struct plot_points *points,
                        const struct plot_axis axes[2], double slope);

void plot_add_pixel(struct text *svg, double v)
{
    long hundredths = lround(fmin(fmax(v, -1e6), 1e6) * 100);
    long size = hundredths < 0 ? -hundredths : hundredths;
    text_add(svg, "%s%ld", hundredths < 0 ? "-" : "", size / 100);
    if (size % 100)
        text_add(svg, size % 10 ? ".%02ld" : ".%ld", size % 10 ? size % 100 : size % 100 / 10);
}

void plot_add_point(struct text *svg, char command, double x, double y)
{
    text_add(svg, "%c", command);
    plot_add_pixel(svg, x);
    text_add(svg, " ");
    plot_add_pixel(svg, y);
}

void plot_marks_print(struct text *svg, const struct plot_points *points, const struct plot_axis *x,
                      const struct plot_axis *y)
{
    if (points->steps)
        print_steps(svg, points, x, y);
    if (points->bars) {
        print_bars(svg, points, x, y);
    } else {
        print_bands(svg, points, x, y);
        print_line(svg, points, x, y);
    }
    if (points->theory)
        print_theory(svg, points, x, y, PLOT_STYLE_THEORY);
}

void plot_dots_print(struct text *svg, const struct plot_points *points, const struct plot_axis *x,
                     const struct plot_axis *y)
{
    if (points->steps)
        print_steps(svg, points, x, y);
    if (points->bars)
        print_bars(svg, points, x, y);
    if (points->theory)
        print_theory(svg, points, x, y, PLOT_STYLE_CURVE);
    if (!points->bars)
        print_dots(svg, points, x, y);
}

void plot_add_whisker(struct text *svg, const double at[3], double foot)
{
    plot_add_point(svg, 'M', at[0], at[1]);
    plot_add_point(svg, 'L', at[0], at[2]);
    for (size_t end = 1; end <= 2; end++) {
        plot_add_point(svg, 'M', at[0] - foot, at[end]);
        plot_add_point(svg, 'L', at[0] + foot, at[end]);
    }
}

static void print_steps(struct text *svg, const struct plot_points *points,
                        const struct plot_axis *x, const struct plot_axis *y)
{
    double width = fmin(6, 0.5 * fabs(x->to - x->from) / (double)points->count);
    text_add(svg, "<path class=\"step\" fill=\"none\" stroke=\"#bdbdbd\" stroke-width=\"");
    plot_add_pixel(svg, fmax(width, 0.5));
    text_add(svg, "\" d=\"");
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        if (isnan(p->step_low))
            continue;
        plot_add_point(svg, 'M', plot_axis_pixel(x, p->x), plot_axis_pixel(y, p->step_low));
        plot_add_point(svg, 'L', plot_axis_pixel(x, p->x), plot_axis_pixel(y, p->step_high));
    }
    text_add(svg, "\"/>\n");
}

static void print_bars(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y)
{
    double half = fmin(0.38 * (x->to - x->from) / (x->max - x->min), 40);
    double ground = plot_axis_pixel(y, y->log ? y->min : 0);
    text_add(svg, "<path class=\"bars\" fill=\"" PLOT_BLUE "\" fill-opacity=\".6\" d=\"");
    for (size_t i = 0; i < points->count; i++) {
        double at = plot_axis_pixel(x, points->point[i].x);
        double top = plot_axis_pixel(y, points->point[i].value);
        if (isnan(points->point[i].value))
            continue;
        plot_add_point(svg, 'M', at - half, ground);
        plot_add_point(svg, 'L', at - half, top);
        plot_add_point(svg, 'L', at + half, top);
        plot_add_point(svg, 'L', at + half, ground);
        text_add(svg, "Z");
    }
    text_add(svg, "\"/>\n<path class=\"band\" fill=\"none\" stroke=\"#004B75\" d=\"");
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        double at[3] = {plot_axis_pixel(x, p->x), plot_axis_pixel(y, p->low),
                        plot_axis_pixel(y, p->high)};
        if (!isnan(p->low))
            plot_add_whisker(svg, at, fmin(half / 2, 5));
    }
    text_add(svg, "\"/>\n");
}

/* From `from` on, the first point without error bar: the end of a band. */
static size_t band_end(const struct plot_points *points, size_t from)
{
    while (from < points->count && !isnan(points->point[from].low))
        from++;
    return from;
}

static void print_bands(struct text *svg, const struct plot_points *points,
                        const struct plot_axis *x, const struct plot_axis *y)
{
    for (size_t from = 0; from < points->count; from++) {
        size_t to = band_end(points, from);
        const struct plot_point *p = points->point;
        if (to == from)
            continue;
        /* A band of one point has no width: a whisker instead. */
        text_add(svg, to - from > 1 ? "<path class=\"band\" fill=\"" PLOT_BLUE
                                      "\" fill-opacity=\".25\" d=\""
                                    : "<path class=\"band\" fill=\"none\" stroke=\"" PLOT_BLUE
                                      "\" stroke-width=\"1.5\" d=\"");
        if (to - from == 1) {
            double at[3] = {plot_axis_pixel(x, p[from].x), plot_axis_pixel(y, p[from].low),
                            plot_axis_pixel(y, p[from].high)};
            plot_add_whisker(svg, at, 4);
        } else {
            for (size_t i = from; i < to; i++)
                plot_add_point(svg, i == from ? 'M' : 'L', plot_axis_pixel(x, p[i].x),
                               plot_axis_pixel(y, p[i].high));
            for (size_t i = to; i-- > from;)
                plot_add_point(svg, 'L', plot_axis_pixel(x, p[i].x), plot_axis_pixel(y, p[i].low));
            text_add(svg, "Z");
        }
        text_add(svg, "\"/>\n");
        from = to;
    }
}

static void print_line(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y)
{
    const struct plot_point *p = points->point;
    bool pen = false;
    text_add(svg, "<path class=\"value\" fill=\"none\" stroke=\"" PLOT_BLUE
                  "\" stroke-width=\"2\" stroke-linejoin=\"round\" d=\"");
    for (size_t i = 0; i < points->count; i++) {
        if (!isnan(p[i].value))
            plot_add_point(svg, pen ? 'L' : 'M', plot_axis_pixel(x, p[i].x),
                           plot_axis_pixel(y, p[i].value));
        pen = !isnan(p[i].value);
    }
    text_add(svg, "\"/>\n");
    for (size_t i = 0; i < points->count; i++) {
        bool alone =
            (i == 0 || isnan(p[i - 1].value)) && (i + 1 == points->count || isnan(p[i + 1].value));
        if (isnan(p[i].value) || (points->count > DOTS_MAX && !alone))
            continue;
        text_add(svg, "<circle class=\"dot\" cx=\"");
        plot_add_pixel(svg, plot_axis_pixel(x, p[i].x));
        text_add(svg, "\" cy=\"");
        plot_add_pixel(svg, plot_axis_pixel(y, p[i].value));
        text_add(svg, "\" r=\"%s\" fill=\"" PLOT_BLUE "\"/>\n", points->count > 40 ? "2.2" : "3.2");
    }
}

/* Points alone: whiskers in one path, then the dots, so small that neighbours do not touch. */
static void print_dots(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y)
{
    double pitch = fabs(x->to - x->from) / (double)(points->count ? points->count : 1);
    double radius = fmax(fmin(0.42 * pitch, 3), 0.8);
    text_add(svg, "<path class=\"band\" fill=\"none\" stroke=\"" PLOT_BLUE "\" d=\"");
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        double at[3] = {plot_axis_pixel(x, p->x), plot_axis_pixel(y, p->low),
                        plot_axis_pixel(y, p->high)};
        if (!isnan(p->low))
            plot_add_whisker(svg, at, fmin(radius, 2.5));
    }
    text_add(svg, "\"/>\n<g fill=\"" PLOT_BLUE "\">\n");
    for (size_t i = 0; i < points->count; i++) {
        if (isnan(points->point[i].value))
            continue;
        text_add(svg, "<circle class=\"dot\" cx=\"");
        plot_add_pixel(svg, plot_axis_pixel(x, points->point[i].x));
        text_add(svg, "\" cy=\"");
        plot_add_pixel(svg, plot_axis_pixel(y, points->point[i].value));
        text_add(svg, "\" r=\"");
        plot_add_pixel(svg, radius);
        text_add(svg, "\"/>\n");
    }
    text_add(svg, "</g>\n");
}

static void print_theory(struct text *svg, const struct plot_points *points,
                         const struct plot_axis *x, const struct plot_axis *y, const char *style)
{
    const struct plot_point *p = points->point;
    bool pen = false;
    text_add(svg, "<path class=\"theory\" %s d=\"", style);
    for (size_t i = 0; i < points->count; i++) {
        double at[2] = {plot_axis_pixel(x, p[i].x), plot_axis_pixel(y, p[i].theory)};
        bool next = i + 1 < points->count && !isnan(p[i + 1].theory);
        if (!isnan(p[i].theory))
            plot_add_point(svg, pen ? 'L' : 'M', at[0], at[1]);
        if (!isnan(p[i].theory) && !pen && !next) { /* alone: a dash of its own */
            plot_add_point(svg, 'M', fmax(at[0] - 7, x->from), at[1]);
            plot_add_point(svg, 'L', fmin(at[0] + 7, x->to), at[1]);
        }
        pen = !isnan(p[i].theory);
    }
    text_add(svg, "\"/>\n");
}

void plot_guides_print(struct text *svg, const struct plot_points *points,
                       const struct plot_axis *x, const struct plot_axis *y)
{
    const struct plot_axis axes[2] = {*x, *y};
    if (!x->log || !y->log)
        return;
    print_guide(svg, points, axes, 1);
    print_guide(svg, points, axes, 0.5);
}

/* The data's highest (sign = 1) or lowest (-1) distance from a line y = x^slope between two
 * abscissae, all in log10; NaN when there is no data. */
static double distance(const struct plot_points *points, const double ends[2], double slope,
                       double sign)
{
    double far = NAN;
    for (size_t i = 0; i < points->count; i++) {
        const struct plot_point *p = &points->point[i];
        double at = log10(p->x);
        if (at < ends[0] || at > ends[1])
            continue;
        const double ys[] = {p->value, p->theory, sign > 0 ? p->high : p->low};
        for (size_t k = 0; k < 3; k++)
            if (ys[k] > 0)
                far = fmax(far, sign * (log10(ys[k]) - slope * at));
    }
    return sign * far;
}

/* Slope 1 goes above the early data, slope 1/2 below the late data: a mean squared displacement
 * rises at most so fast there. As long as fits into the frame; false when there is no room. */
static bool print_guide(struct text *svg, const struct plot_points *points,
                        const struct plot_axis axes[2], double slope)
{
    bool early = slope > 0.75;
    double a = log10(axes[0].min), b = log10(axes[0].max), share = 0.34;
    double bottom = log10(axes[1].min), top = log10(axes[1].max), gap = 0.05 * (top - bottom);
    for (; share > 0.1; share -= 0.02) {
        double ends[2] = {early ? a + 0.05 * (b - a) : b - (share + 0.04) * (b - a), 0};
        ends[1] = ends[0] + share * (b - a);
        double shift = distance(points, ends, slope, early ? 1 : -1) + (early ? gap : -gap);
        double y[2] = {shift + slope * ends[0], shift + slope * ends[1]};
        if (!(y[0] > bottom + gap && y[1] < top - gap))
            continue;
        double px[2], py[2];
        for (size_t i = 0; i < 2; i++) {
            px[i] = plot_axis_pixel(&axes[0], pow(10, ends[i]));
            py[i] = plot_axis_pixel(&axes[1], pow(10, y[i]));
        }
        text_add(svg, "<path class=\"guide\" fill=\"none\" stroke=\"#595959\" "
                      "stroke-dasharray=\"3 3\" d=\"");
        plot_add_point(svg, 'M', px[0], py[0]);
        plot_add_point(svg, 'L', px[1], py[1]);
        text_add(svg, "\"/>\n<text font-size=\"13\" font-style=\"italic\" fill=\"#595959\" x=\"");
        plot_add_pixel(svg, (px[0] + px[1]) / 2 + (early ? -14 : 12));
        text_add(svg, "\" y=\"");
        plot_add_pixel(svg, (py[0] + py[1]) / 2 + (early ? -8 : 18));
        text_add(svg, "\">t%s</text>\n",
                 early ? "" : "<tspan dy=\"-5\" font-size=\"10\">1/2</tspan>");
        return true;
    }
    return false;
}

void plot_scalar_print(struct text *svg, const struct plot_point *point, const struct plot_axis *x,
                       double y)
{
    double at = plot_axis_pixel(x, point->value);
    if (!isnan(point->step_low)) {
        text_add(svg, "<path class=\"step\" stroke=\"#bdbdbd\" stroke-width=\"10\" d=\"");
        plot_add_point(svg, 'M', plot_axis_pixel(x, point->step_low), y);
        plot_add_point(svg, 'L', plot_axis_pixel(x, point->step_high), y);
        text_add(svg, "\"/>\n");
    }
    if (!isnan(point->low)) {
        double ends[2] = {plot_axis_pixel(x, point->low), plot_axis_pixel(x, point->high)};
        text_add(svg, "<path class=\"band\" fill=\"none\" stroke=\"" PLOT_BLUE
                      "\" stroke-width=\"2\" d=\"");
        plot_add_point(svg, 'M', ends[0], y);
        plot_add_point(svg, 'L', ends[1], y);
        for (size_t i = 0; i < 2; i++) {
            plot_add_point(svg, 'M', ends[i], y - 7);
            plot_add_point(svg, 'L', ends[i], y + 7);
        }
        text_add(svg, "\"/>\n");
    }
    text_add(svg, "<circle class=\"dot\" cx=\"");
    plot_add_pixel(svg, at);
    text_add(svg, "\" cy=\"");
    plot_add_pixel(svg, y);
    text_add(svg, "\" r=\"5\" fill=\"" PLOT_BLUE "\"/>\n");
    if (!isnan(point->theory)) {
        text_add(svg, "<path class=\"theory\" " PLOT_STYLE_THEORY " d=\"");
        plot_add_point(svg, 'M', plot_axis_pixel(x, point->theory), y - 24);
        plot_add_point(svg, 'L', plot_axis_pixel(x, point->theory), y + 24);
        text_add(svg, "\"/>\n");
    }
}
