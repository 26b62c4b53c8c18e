/* SPDX-License-Identifier: GPL-3.0-or-later
 * ring_sort_marked.c - see ring_sort_marked.h. Mirrors ring_sort.c step by step: the same points in
 * the same arithmetic. */
#include "ring_sort_marked.h"
#include "order.h"
#include "ring_sort.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum {
    MOVES_PER_ROD = 16,   /* more: merging is cheaper than insertion */
    JOIN_MOVES = 1 << 16, /* more between two parts: they are not parts at all */
};

struct run {
    double *y, *mark;
};

/* Rod i to its place among those before it, which are sorted; by how many places. */
static inline int64_t insert(struct run r, int64_t i)
{
    const double value = r.y[i], mark = r.mark[i];
    int64_t j = i;
    for (; j > 0 && r.y[j - 1] > value; j--) {
        r.y[j] = r.y[j - 1];
        r.mark[j] = r.mark[j - 1];
    }
    r.y[j] = value;
    r.mark[j] = mark;
    return i - j;
}

/* False, with both still in step, when it gives up. */
static bool sort_by_insertion(struct run r, int64_t n)
{
    int64_t allowed = MOVES_PER_ROD * n;
    for (int64_t i = 1; i < n; i++) {
        if (r.y[i - 1] <= r.y[i])
            continue;
        allowed -= insert(r, i);
        if (allowed < 0)
            return false;
    }
    return true;
}

static void merge_runs(struct run from, struct run to, int64_t middle, int64_t end)
{
    int64_t a = 0, b = middle;
    for (int64_t i = 0; i < end; i++) {
        bool first = b >= end || (a < middle && from.y[a] <= from.y[b]);
        int64_t taken = first ? a++ : b++;
        to.y[i] = from.y[taken];
        to.mark[i] = from.mark[taken];
    }
}

static void sort_by_merging(const struct marked_rods *rods)
{
    const int64_t n = rods->count;
    struct run from = {rods->y, rods->mark}, to = {rods->scratch, rods->scratch + n};
    for (int64_t width = 1; width < n; width *= 2) {
        for (int64_t start = 0; start < n; start += 2 * width) {
            int64_t left = n - start, end = left < 2 * width ? left : 2 * width;
            merge_runs((struct run){from.y + start, from.mark + start},
                       (struct run){to.y + start, to.mark + start}, width < end ? width : end, end);
        }
        struct run swap = from;
        from = to;
        to = swap;
    }
    if (from.y == rods->y)
        return;
    memcpy(rods->y, from.y, (size_t)n * sizeof(double));
    memcpy(rods->mark, from.mark, (size_t)n * sizeof(double));
}

static void sort_line(const struct marked_rods *rods)
{
    if (order_kept(rods->y, rods->count))
        return;
    if (!sort_by_insertion((struct run){rods->y, rods->mark}, rods->count))
        sort_by_merging(rods);
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

/* The path that is `turns` places on gets label i, one ell further wherever it went round. */
static void hand_back(const struct marked_rods *rods, double ell, int64_t turns)
{
    const int64_t n = rods->count, shift = turns % n;
    const double whole = (double)(turns / n) * ell;
    double *w = rods->scratch, *marks = rods->scratch + n;
    memcpy(w, rods->y, (size_t)n * sizeof *w);
    memcpy(marks, rods->mark, (size_t)n * sizeof *marks);
    for (int64_t i = 0; i < n; i++) {
        bool beyond = i + shift >= n;
        int64_t from = beyond ? i + shift - n : i + shift;
        rods->y[i] = w[from] + (whole + (beyond ? ell : 0));
        rods->mark[i] = marks[from];
    }
}

void ring_sort_marked(const struct marked_rods *rods, double ell)
{
    double *y = rods->y;
    const int64_t n = rods->count;
    if (!(ell > 0)) {
        ring_sort(y, n, ell, rods->scratch);
        return;
    }
    sort_line(rods);
    ring_sort_marked_close(rods, ell);
}

void ring_sort_marked_close(const struct marked_rods *rods, double ell)
{
    double *y = rods->y;
    const int64_t n = rods->count;
    if (y[n - 1] <= y[0] + ell)
        return;
    int64_t turns = fold(y, n, ell);
    sort_line(rods);
    hand_back(rods, ell, turns);
}

void ring_sort_marked_part(const struct marked_rods *part)
{
    sort_line(part);
}

bool ring_sort_marked_join(const struct marked_rods *rods, int64_t at, int64_t end)
{
    const struct run r = {rods->y, rods->mark};
    int64_t allowed = JOIN_MOVES;
    for (int64_t i = at; i < end && r.y[i - 1] > r.y[i] && allowed >= 0; i++)
        allowed -= insert(r, i);
    return allowed >= 0;
}

/* Mirrored at both walls as often as it takes; *mark changes sign when that is odd. */
static double mirror(double y, double low, double high, double *mark)
{
    double width = high - low, turn = (y - low) / (2 * width);
    double within = (y - low) - floor(turn) * (2 * width);
    bool odd = within > width;
    *mark = odd ? -*mark : *mark;
    double mirrored = low + (odd ? 2 * width - within : within);
    return fmin(fmax(mirrored, low), high); /* rounding */
}

void reflect_marked_part(const struct marked_rods *part, double low, double high)
{
    double *y = part->y;
    for (int64_t i = 0; i < part->count; i++)
        if (y[i] < low || y[i] > high)
            y[i] = mirror(y[i], low, high, &part->mark[i]);
}

void reflect_walls_marked(const struct marked_rods *rods, double low, double high)
{
    double *y = rods->y;
    const int64_t n = rods->count;
    if (!(low < high)) {
        reflect_walls(y, n, low, high, rods->scratch);
        return;
    }
    reflect_marked_part(rods, low, high);
    sort_line(rods);
}
