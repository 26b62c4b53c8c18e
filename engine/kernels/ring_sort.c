/* SPDX-License-Identifier: GPL-3.0-or-later
 * ring_sort.c - see ring_sort.h. */
#include "ring_sort.h"
#include "order.h"
#include "simd.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>
#ifdef __x86_64__
#include <emmintrin.h>
#endif

enum {
    MOVES_PER_ROD = 16,   /* more: merging is cheaper than insertion */
    WINDOW = 5,           /* places that a rod moves without a branch to be guessed */
    FEW = 32,             /* so many need no counting ahead */
    CROSSINGS = 5,        /* one pair in so many out of order: the window pays */
    JOIN_MOVES = 1 << 16, /* more between two parts: they are not parts at all */
};

/* Rod i to its place among those before it, which are sorted; by how many places. */
static inline int64_t insert(double *y, int64_t i)
{
    const double value = y[i];
    int64_t j = i;
    for (; j > 0 && y[j - 1] > value; j--)
        y[j] = y[j - 1];
    y[j] = value;
    return i - j;
}

/* Insertion sort: few rods cross in a step. False, with y a permutation, when it gives up. */
static bool sort_by_insertion(double *y, int64_t n)
{
    int64_t allowed = MOVES_PER_ROD * n;
    for (int64_t i = 1; i < n; i++) {
        if (y[i - 1] <= y[i])
            continue;
        allowed -= insert(y, i);
        if (allowed < 0)
            return false;
    }
    return true;
}

/* Pairs of neighbours out of order. */
KERNEL_CLONES
static int64_t count_crossed(const double *y, int64_t n)
{
    int64_t crossed = 0;
    for (int64_t i = 0; i + 1 < n; i++)
        crossed += y[i] > y[i + 1];
    return crossed;
}

/* One instruction each; compilers make branches of the plain form, which cost several times more.
 * Where neither is larger, NaN included, larger(a, b) is b and smaller(b, a) is a. */
static inline double larger(double a, double b)
{
#ifdef __x86_64__
    return _mm_cvtsd_f64(_mm_max_sd(_mm_set_sd(a), _mm_set_sd(b)));
#else
    return a > b ? a : b;
#endif
}

static inline double smaller(double a, double b)
{
#ifdef __x86_64__
    return _mm_cvtsd_f64(_mm_min_sd(_mm_set_sd(a), _mm_set_sd(b)));
#else
    return a < b ? a : b;
#endif
}

/* The value goes to its place among the first `filled` of a window in order; what falls out at the
 * lower end, or the value where nothing is there yet. */
static inline __attribute__((always_inline)) double window_take(double *window, int filled,
                                                                double value)
{
    for (int k = WINDOW - 1; k >= WINDOW - filled; k--) {
        double at = window[k];
        window[k] = larger(at, value);
        value = smaller(value, at);
    }
    return value;
}

/* Almost sorts n > WINDOW rods: a window of rods in order moves along the line, takes in the next
 * one and leaves its smallest behind. Only those that must go further than the window is long are
 * left over. Always a permutation, whatever y holds. */
static void sort_by_window(double *y, int64_t n)
{
    double window[WINDOW] = {0};
    for (int i = 0; i < WINDOW; i++)
        window[WINDOW - 1 - i] = window_take(window, i, y[i]);
    for (int64_t i = WINDOW; i < n; i++)
        y[i - WINDOW] = window_take(window, WINDOW, y[i]);
    for (int i = 0; i < WINDOW; i++)
        y[n - WINDOW + i] = window[i];
}

static void merge_runs(const double *from, double *to, int64_t middle, int64_t end)
{
    int64_t a = 0, b = middle;
    for (int64_t i = 0; i < end; i++)
        to[i] = b >= end || (a < middle && from[a] <= from[b]) ? from[a++] : from[b++];
}

static void sort_by_merging(double *y, int64_t n, double *scratch)
{
    double *from = y, *to = scratch;
    for (int64_t width = 1; width < n; width *= 2) {
        for (int64_t start = 0; start < n; start += 2 * width) {
            int64_t left = n - start, end = left < 2 * width ? left : 2 * width;
            merge_runs(from + start, to + start, width < end ? width : end, end);
        }
        double *swap = from;
        from = to;
        to = swap;
    }
    if (from != y)
        memcpy(y, from, (size_t)n * sizeof *y);
}

static void sort_line(double *y, int64_t n, double *scratch)
{
    if (n <= FEW) {
        const uint64_t crossed = order_crossed(y, n);
        if (!crossed)
            return;
        /* More than one pair: the window is quicker than the guesses that insertion takes. */
        if (crossed & (crossed - 1) && n > WINDOW)
            sort_by_window(y, n);
    } else {
        const int64_t crossed = count_crossed(y, n);
        if (crossed == 0)
            return;
        if (crossed > n / CROSSINGS)
            sort_by_window(y, n);
    }
    if (!sort_by_insertion(y, n))
        sort_by_merging(y, n, scratch);
}

/* Folds sorted y into [base, base + ell), base = y[0]; the number of whole turns taken out. */
static int64_t fold(double *y, int64_t n, double ell)
{
    const double base = y[0];
    int64_t turns = 0;
    for (int64_t i = n - 1; i > 0 && y[i] - base >= ell; i--) {
        double whole = floor((y[i] - base) / ell);
        double folded = y[i] - whole * ell;
        if (folded < base) { /* rounding: it belongs at the upper end */
            folded += ell;
            whole -= 1;
        }
        y[i] = folded;
        turns += (int64_t)whole;
    }
    return turns;
}

/* The common case of folding, sorting and handing back, in sorted y: the last rod alone is beyond
 * the first by ell, and not by much more. It takes its place among the first ones, which move down
 * by one, and the first one goes round instead of it. */
static bool fold_last(double *y, int64_t n, double ell)
{
    const double base = y[0], beyond = y[n - 1] - base, folded = y[n - 1] - ell;
    if (!(n > 1 && y[n - 2] - base < ell && beyond >= ell && beyond < 1.5 * ell && folded >= base))
        return false;
    int64_t i = 1;
    for (; i < n - 1 && y[i] <= folded; i++)
        y[i - 1] = y[i];
    y[i - 1] = folded;
    y[n - 1] = base + ell;
    return true;
}

/* y[i] = w[(i + turns) mod n] + floor((i + turns) / n) ell. */
static void hand_back(double *y, int64_t n, double ell, int64_t turns, double *w)
{
    memcpy(w, y, (size_t)n * sizeof *w);
    int64_t shift = turns % n;
    double whole = (double)(turns / n) * ell;
    for (int64_t i = 0; i < n; i++) {
        bool beyond = i + shift >= n;
        y[i] = w[beyond ? i + shift - n : i + shift] + (whole + (beyond ? ell : 0));
    }
}

static void move_rigidly(double *y, int64_t n)
{
    double sum = 0;
    for (int64_t i = 1; i < n; i++)
        sum += y[i] - y[0];
    double mean = y[0] + sum / (double)n;
    for (int64_t i = 0; i < n; i++)
        y[i] = mean;
}

void ring_sort(double *y, int64_t n, double ell, double *scratch)
{
    if (!(ell > 0)) {
        move_rigidly(y, n);
        return;
    }
    sort_line(y, n, scratch);
    ring_sort_close(y, n, ell, scratch);
}

void ring_sort_close(double *y, int64_t n, double ell, double *scratch)
{
    if (y[n - 1] <= y[0] + ell || fold_last(y, n, ell))
        return;
    int64_t turns = fold(y, n, ell);
    sort_line(y, n, scratch);
    hand_back(y, n, ell, turns, scratch);
}

void ring_sort_part(double *y, int64_t n, double *scratch)
{
    sort_line(y, n, scratch);
}

bool ring_sort_join(double *y, int64_t at, int64_t end)
{
    int64_t allowed = JOIN_MOVES;
    for (int64_t i = at; i < end && y[i - 1] > y[i] && allowed >= 0; i++)
        allowed -= insert(y, i);
    return allowed >= 0;
}

/* Mirrored at both walls as often as it takes. */
static double fold_once(double y, double low, double high)
{
    double width = high - low, turn = (y - low) / (2 * width);
    double within = (y - low) - floor(turn) * (2 * width);
    double folded = low + (within <= width ? within : 2 * width - within);
    return fmin(fmax(folded, low), high); /* rounding */
}

void reflect_part(double *y, int64_t n, double low, double high)
{
    for (int64_t i = 0; i < n; i++)
        if (y[i] < low || y[i] > high)
            y[i] = fold_once(y[i], low, high);
}

void reflect_walls(double *y, int64_t n, double low, double high, double *scratch)
{
    if (!(low < high)) {
        for (int64_t i = 0; i < n; i++)
            y[i] = low;
        return;
    }
    reflect_part(y, n, low, high);
    sort_line(y, n, scratch);
}
