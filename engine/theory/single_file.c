/* SPDX-License-Identifier: GPL-3.0-or-later
 * single_file.c - mean square displacement of a tagged hard rod among others (closed_forms.h). */
#include <math.h>

#include "closed_forms.h"
#include "tools.h"

enum { RULE = 16, PANELS = 32, REACH_MAX = 64 };

static double right_tail(double x, double four_t)
{
    return erfc(x / sqrt(four_t)) / 2;
}

/* h(x) = int_x^inf Q. */
static double mean_excess(double x, double four_t)
{
    return sqrt(four_t / (4 * PI)) * exp(-x * x / four_t) - x * right_tail(x, four_t);
}

/* P(A - B >= 1) and P(A = B) for Poisson variables of means a <= b: sums over A within ten standard
 * deviations (and down to 0 for small means). */
static void skellam(double a, double b, double *at_least_1, double *equal)
{
    double from = fmax(0, floor(a - 10 * sqrt(a) - 40)), to = ceil(a + 12 * sqrt(a) + 60);
    /* P(B <= from - 1), from its own lower end. */
    double below = 0, start = fmax(0, floor(b - 10 * sqrt(b) - 40));
    double term_b = exp(start * log(b) - b - lgamma(start + 1));
    double next_b = start;
    for (; next_b < from; next_b++) {
        below += term_b;
        term_b *= b / (next_b + 1);
    }
    double term_a = exp((from > 0 ? from * log(a) : 0) - a - lgamma(from + 1));
    *at_least_1 = *equal = 0;
    for (double n = from; n <= to; n++) {
        bool reached = n >= next_b;
        *at_least_1 += term_a * below;
        *equal += reached ? term_a * term_b : 0;
        if (reached) {
            below += term_b;
            term_b *= b / (n + 1);
            next_b = n + 1;
        }
        term_a *= a / (n + 1);
    }
}

struct file {
    double density;        /* of points; infinite line */
    double particles, ell; /* ring; particles = 0: infinite line */
    double four_t;         /* 4 D t */
    struct bcd_watch *watch;
};

static double tail_line(const struct file *file, double x)
{
    double q = right_tail(x, file->four_t), h = mean_excess(x, file->four_t);
    double at_least_1, equal;
    if (!(file->density * h > 1e-300)) {
        /* Nothing comes from the left of x: the tagged one must, before any leaves the right. */
        return q * exp(-file->density * (h + x));
    }
    skellam(file->density * h, file->density * (h + x), &at_least_1, &equal);
    return at_least_1 + q * equal;
}

/* P(c >= k) of one other point. */
static double other_tail(const struct file *file, double x, double k)
{
    double ell = file->ell;
    return (mean_excess(x + (k - 1) * ell, file->four_t) - mean_excess(x + k * ell, file->four_t)) /
           ell;
}

/* P(c = k) for k = -reach .. reach, of another point and of the tagged one's own windings. */
struct windings {
    int reach;
    double other[2 * REACH_MAX + 1], own[2 * REACH_MAX + 1];
};

static void count_windings(struct windings *w, const struct file *file, double x)
{
    w->reach = (int)fmin(ceil((x + 7 * sqrt(file->four_t)) / file->ell) + 1, REACH_MAX);
    double other_before = 1, own_before = 1; /* P(c >= k) */
    for (int k = -w->reach; k <= w->reach; k++) {
        bool top = k == w->reach;
        double other = top ? 0 : other_tail(file, x, k + 1);
        double own = top ? 0 : right_tail(x + k * file->ell, file->four_t);
        w->other[k + w->reach] = other_before - other;
        w->own[k + w->reach] = own_before - own;
        other_before = other;
        own_before = own;
    }
}

/* P(sum >= 1) from the characteristic function on 2 m + 1 angles: right for a sum that stays within
 * -m .. m, but for the weight outside. */
static double tail_ring(const struct file *file, double x)
{
    struct windings w;
    count_windings(&w, file, x);
    double mean_square = 0;
    for (int k = -w.reach; k <= w.reach; k++) {
        mean_square += k * k * w.other[k + w.reach];
    }
    double m = ceil(10 * sqrt(file->particles * mean_square) + 2 * w.reach + 24);
    m += ceil(file->particles * x / file->ell);
    if (!watch_spend(file->watch, m * (180 + 12 * (double)w.reach))) {
        return NAN;
    }
    double sum = m / (2 * m + 1); /* angle 0 */
    for (double a = 1; a <= m; a++) {
        double phi = 2 * PI * a / (2 * m + 1);
        double complex turn = cexp(I * phi), z = cexp(-I * phi * w.reach), other = 0, own = 0;
        for (int k = 0; k <= 2 * w.reach; k++) {
            other += w.other[k] * z;
            own += w.own[k] * z;
            z *= turn;
        }
        double complex all = own * cpow(other, file->particles - 1);
        sum += 2 * creal(all * (1 - cexp(-I * phi * m)) / (turn - 1)) / (2 * m + 1);
    }
    return sum;
}

static double integrate(const struct file *file, double deviation)
{
    double node[RULE], weight[RULE], last = 14 * deviation, half = last / (2 * PANELS), sum = 0;
    gauss_legendre(RULE, node, weight);
    for (int i = 0; i < RULE * PANELS; i++) {
        double x = half * (2 * (double)(i / RULE) + 1 + node[i % RULE]);
        double tail = file->particles > 0 ? tail_ring(file, x) : tail_line(file, x);
        sum += half * weight[i % RULE] * 4 * x * tail;
    }
    return sum;
}

double single_file_msd_long(double density, double diameter, double D, double t)
{
    if (!(density > 0 && diameter >= 0 && density * diameter < 1 && D * t >= 0)) {
        return NAN;
    }
    return sqrt(4 * D * t / PI) * (1 - density * diameter) / density;
}

double single_file_msd(double density, double diameter, double D, double t)
{
    double late = single_file_msd_long(density, diameter, D, t);
    if (isnan(late) || t == 0 || D == 0) {
        return late;
    }
    double n = density / (1 - density * diameter), most = 1e5;
    /* MSD = late + constant + O(n^-3 (D t)^-1/2): at very late times with the constant from an
     * earlier one. */
    double time = fmin(D * t, most * most / (n * n));
    double then = single_file_msd_long(density, diameter, 1, time);
    struct file file = {.density = n, .four_t = 4 * time};
    return late - then + integrate(&file, sqrt(fmin(2 * time, then)));
}

double single_file_msd_ring_late(int64_t particles, double length, double diameter, double D,
                                 double t)
{
    double n = (double)particles, ell = length - n * diameter;
    if (particles < 1 || !(ell > 0) || !(diameter >= 0) || !(D * t >= 0)) {
        return NAN;
    }
    return 2 * D * t / n + ell * ell * (n - 1) / (6 * n * n);
}

double single_file_msd_ring(int64_t particles, double length, double diameter, double D, double t)
{
    const struct single_file ring = {particles, length, diameter, D, NULL};
    return single_file_msd_watched(&ring, t);
}

double single_file_msd_watched(const struct single_file *ring, double t)
{
    double length = ring->length, diameter = ring->diameter, D = ring->D;
    double late = single_file_msd_ring_late(ring->particles, length, diameter, D, t);
    if (isnan(late) || t == 0 || D == 0) {
        return isnan(late) ? NAN : 0;
    }
    double n = (double)ring->particles, density = n / length, ell = length - n * diameter;
    if (D * t > ell * ell) {
        return late; /* up to exp(-4 pi^2 D t/ell^2) */
    }
    struct file file = {.particles = n, .ell = ell, .four_t = 4 * D * t, .watch = ring->watch};
    double middle = single_file_msd_long(density, diameter, D, t) + 2 * D * t / n;
    return integrate(&file, sqrt(fmin(fmin(2 * D * t, middle), late)));
}

/* Of tail_ring at half the range of x. */
double single_file_msd_ns(const struct single_file *ring, double t)
{
    double n = (double)ring->particles, ell = ring->length - n * ring->diameter;
    double spread = ring->D * t / (ell * ell);
    if (!(spread > 0) || spread > 1) {
        return 100;
    }
    double length = ring->length, diameter = ring->diameter, D = ring->D;
    double late = single_file_msd_ring_late(ring->particles, length, diameter, D, t);
    double middle = single_file_msd_long(n / length, diameter, D, t);
    double x = 7 * sqrt(fmin(fmin(2 * ring->D * t, middle + 2 * ring->D * t / n), late)) / ell;
    double reach = fmin(ceil(x + 14 * sqrt(spread)) + 1, REACH_MAX);
    double square = sqrt(4 * spread / PI) + x; /* of one's windings, where they are few */
    double angles = 10 * sqrt(n * fmin(square, 2 * spread + x * x)) + 2 * reach + 24 + n * x;
    return RULE * PANELS * (angles * (180 + 12 * reach) + 300 * reach);
}

double single_file_msd_short(double density, double contact, double D, double t)
{
    if (!(density > 0 && contact >= 0 && D * t >= 0)) {
        return NAN;
    }
    return 2 * D * t - 8. / 3 * sqrt(2 / PI) * contact / density * pow(D * t, 1.5);
}
