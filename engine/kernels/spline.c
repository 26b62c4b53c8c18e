/* SPDX-License-Identifier: GPL-3.0-or-later
 * spline.c - see spline.h. C. de Boor, A Practical Guide to Splines (1978), chapter IV.
 *
 * With the step as unit of length the second derivatives m at the points obey
 *     m[i-1] + 4 m[i] + m[i+1] = 6 (v[i-1] - 2 v[i] + v[i+1]). */
#include "spline.h"
#include "simd.h"

#include <math.h>
#include <stdlib.h>

enum { TILE = 256, LANES = 8 };

static void write_pieces(struct spline *spline, const double *values, const double *m, size_t count)
{
    for (size_t k = 0; k < spline->pieces; k++) {
        size_t next = k + 1 < count ? k + 1 : 0;
        double *c = spline->c + 4 * k;
        c[0] = values[k];
        c[1] = (values[next] - values[k]) - (2 * m[k] + m[next]) / 6;
        c[2] = m[k] / 2;
        c[3] = (m[next] - m[k]) / 6;
    }
}

/* m[0..n-1] in and out: solves the equations above with m[-1] = m[n] = 0. work: [n]. */
static void solve_rows(double *m, size_t n, double first_diagonal, double last_diagonal,
                       double *work)
{
    double pivot = first_diagonal;
    m[0] /= pivot;
    for (size_t i = 1; i < n; i++) {
        work[i] = 1 / pivot;
        pivot = (i + 1 < n ? 4 : last_diagonal) - work[i];
        m[i] = (m[i] - m[i - 1]) / pivot;
    }
    for (size_t i = n - 1; i > 0; i--)
        m[i - 1] -= work[i] * m[i];
}

static bool spline_begin(struct spline *spline, double from, double step, size_t pieces)
{
    *spline = (struct spline){.from = from, .step = step, .pieces = pieces};
    spline->c = malloc(4 * pieces * sizeof *spline->c);
    return spline->c;
}

/* The corners of the cyclic matrix are a product of two vectors: Sherman and Morrison's formula
 * (Press et al., Numerical Recipes, "cyclic tridiagonal systems"), gamma = -4. */
bool spline_periodic(struct spline *spline, double from, double step, const double *values,
                     size_t count)
{
    double *m = count >= 3 ? malloc(3 * count * sizeof *m) : NULL;
    if (!m || !spline_begin(spline, from, step, count)) {
        free(m);
        return false;
    }
    double *corner = m + count, *work = corner + count;
    for (size_t i = 0; i < count; i++) {
        double before = values[i > 0 ? i - 1 : count - 1];
        double after = values[i + 1 < count ? i + 1 : 0];
        m[i] = 6 * ((before - values[i]) + (after - values[i]));
        corner[i] = i == 0 ? -4 : i + 1 < count ? 0 : 1;
    }
    const double first = 4 + 4, last = 4 + 0.25;
    solve_rows(m, count, first, last, work);
    solve_rows(corner, count, first, last, work);
    double share = (m[0] - m[count - 1] / 4) / (1 + corner[0] - corner[count - 1] / 4);
    for (size_t i = 0; i < count; i++)
        m[i] -= share * corner[i];
    write_pieces(spline, values, m, count);
    spline->periodic = true;
    free(m);
    return true;
}

/* Not-a-knot: m[0] = 2 m[1] - m[2]; its row then gives m[1] by itself. So at the other end. */
bool spline_open(struct spline *spline, double from, double step, const double *values,
                 size_t count)
{
    double *m = count >= 3 ? malloc(2 * count * sizeof *m) : NULL;
    if (!m || !spline_begin(spline, from, step, count - 1)) {
        free(m);
        return false;
    }
    size_t last = count - 1;
    for (size_t i = 1; i < last; i++)
        m[i] = 6 * ((values[i - 1] - values[i]) + (values[i + 1] - values[i]));
    m[1] /= 6;
    if (last > 2) {
        m[last - 1] /= 6;
        m[2] -= last > 3 ? m[1] : 0;
        m[last - 2] -= last > 3 ? m[last - 1] : 0;
        if (last > 3)
            solve_rows(m + 2, last - 3, 4, 4, m + count);
    }
    m[0] = last > 2 ? 2 * m[1] - m[2] : m[1]; /* three points: a parabola */
    m[last] = last > 2 ? 2 * m[last - 1] - m[last - 2] : m[1];
    write_pieces(spline, values, m, count);
    free(m);
    return true;
}

void spline_free(struct spline *spline)
{
    free(spline->c);
    spline->c = NULL;
}

/* Which piece, and how far into it. */
struct place {
    int32_t piece;
    double t;
};

/* u counts pieces from the start of the spline: first and last piece reach beyond the ends. */
static inline struct place place_open(double u, double most)
{
    double inside = u < most ? u : most;
    inside = inside > 0 ? inside : 0; /* NaN as well */
    struct place place = {.piece = (int32_t)inside};
    place.t = u - (double)place.piece;
    return place;
}

static inline struct place place_of(const struct spline *s, double x)
{
    double pieces = (double)s->pieces, u = (x - s->from) / s->step;
    if (s->periodic) {
        double turns = (x - s->from) / (s->step * pieces);
        u = (turns - floor(turns)) * pieces;
    }
    return place_open(u, pieces - 1);
}

double spline_at(const struct spline *spline, double x, int derivative)
{
    struct place at = place_of(spline, x);
    const double *c = spline->c + 4 * at.piece, t = at.t, per_step = 1 / spline->step;
    if (derivative == 0)
        return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
    if (derivative == 1)
        return (c[1] + t * (2 * c[2] + t * (3 * c[3]))) * per_step;
    return (2 * c[2] + t * (6 * c[3])) * per_step * per_step;
}

/* The position as a spline counts it: turns of a periodic one, pieces of an open one. */
struct scale_of {
    double from, inverse, pieces, folds; /* folds: 1 = whole turns are left out, 0 = not */
};

static struct scale_of scale_of(const struct spline *s)
{
    double pieces = (double)s->pieces, unit = s->periodic ? s->step * pieces : s->step;
    return (struct scale_of){s->from, 1 / unit, pieces, s->periodic ? 1 : 0};
}

static inline struct place place_scaled(const struct scale_of *s, double x)
{
    double u = (x - s->from) * s->inverse;
    u = s->folds > 0 ? (u - floor(u)) * s->pieces : u;
    return place_open(u, s->pieces - 1);
}

KERNEL_CLONES
void spline_add_slope(const struct spline *spline, const struct spline_points *points, double scale,
                      double *out)
{
    const struct scale_of unit = scale_of(spline);
    const double *c = spline->c, factor = scale / spline->step, diameter = points->diameter;
    for (int64_t start = 0; start < points->count; start += TILE) {
        int64_t left = points->count - start;
        int count = left < TILE ? (int)left : TILE;
        double base = (double)(points->first + start), x[TILE];
        const double *from = points->y + start;
        const double *offset = points->offset ? points->offset + start : NULL;
        double *to = out + start;
        for (int j = 0; j < count && offset; j++)
            x[j] = from[j] + offset[j];
        for (int j = 0; j < count && !offset; j++)
            x[j] = from[j] + (base + (double)j) * diameter;
        TURNS_APART
        for (int j = 0; j < count; j++) {
            struct place at = place_scaled(&unit, x[j]);
            const double *p = c + 4 * at.piece;
            to[j] += factor * (p[1] + at.t * (2 * p[2] + at.t * (3 * p[3])));
        }
    }
}

static inline double value_at(const struct spline *spline, const struct scale_of *unit, double x)
{
    struct place at = place_scaled(unit, x);
    const double *p = spline->c + 4 * at.piece;
    return p[0] + at.t * (p[1] + at.t * (p[2] + at.t * p[3]));
}

KERNEL_CLONES
double spline_sum(const struct spline *spline, const struct spline_points *points)
{
    const struct scale_of unit = scale_of(spline);
    const double *y = points->y, diameter = points->diameter;
    double sum[LANES] = {0};
    int64_t n = points->count, whole = n - n % LANES;
    for (int64_t i = 0; i < whole; i += LANES)
        for (int j = 0; j < LANES; j++)
            sum[j] += value_at(spline, &unit, y[i + j] + ((double)i + (double)j) * diameter);
    for (int64_t i = whole; i < n; i++)
        sum[i - whole] += value_at(spline, &unit, y[i] + (double)i * diameter);
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

double spline_curvature_max(const struct spline *spline)
{
    double most = 0, per_step = 1 / spline->step;
    for (size_t k = 0; k < spline->pieces; k++) {
        const double *c = spline->c + 4 * k;
        most = fmax(most, fmax(fabs(2 * c[2]), fabs(2 * c[2] + 6 * c[3])));
    }
    return most * per_step * per_step;
}
