/* SPDX-License-Identifier: GPL-3.0-or-later
 * isotonic.c - see isotonic.h. Only blocks of two rods and more are kept on the stack; a rod
 * outside them is a block of its own, read from y. In a sparse ring the whole call is one scan. */
#include "isotonic.h"
#include "order.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Blocks found so far, in order; the open interval of single rods between them is implicit. */
struct stack {
    struct isotonic_block *blocks;
    int64_t count;
};

static double count_of(const struct isotonic_block *b)
{
    return (double)(b->last - b->first + 1);
}

static void set_mean(struct isotonic_block *b)
{
    b->mean = b->base + b->sum / count_of(b);
}

static struct isotonic_block single(const double *y, int64_t i)
{
    return (struct isotonic_block){.first = i, .last = i, .base = y[i], .sum = 0, .mean = y[i]};
}

/* Right neighbour b joins a. Sums are relative to a rod of the block: no cancellation. */
static void absorb_right(struct isotonic_block *a, const struct isotonic_block *b)
{
    a->sum += b->sum + count_of(b) * (b->base - a->base);
    a->last = b->last;
    set_mean(a);
}

static void absorb_left(struct isotonic_block *b, const struct isotonic_block *a)
{
    struct isotonic_block joined = *a;
    absorb_right(&joined, b);
    *b = joined;
}

/* The finished block that ends at rod i: from the stack's top or the rod alone. */
static bool top_ends_at(const struct stack *s, int64_t i)
{
    return s->count > 0 && s->blocks[s->count - 1].last == i;
}

/* The left neighbour joins b: rod b->first - 1 alone, or the stack's top that ends there. The
 * number of rods that it brings. */
static inline double take_left(struct isotonic_block *b, const double *y, struct stack *s)
{
    if (!top_ends_at(s, b->first - 1)) {
        b->first--;
        b->sum += y[b->first] - b->base;
        return 1;
    }
    const struct isotonic_block *a = &s->blocks[--s->count];
    const double count = count_of(a);
    b->sum += a->sum + count * (a->base - b->base);
    b->first = a->first;
    return count;
}

/* The same on the right, where rods are still alone. */
static inline double take_right(struct isotonic_block *b, const double *y)
{
    b->sum += y[++b->last] - b->base;
    return 1;
}

/* Rods i and i+1 are out of order: pool them and whatever follows from it. A mean is compared
 * without dividing, as sum against count times the other's distance from base; what these
 * comparisons leave apart is judged again by the rounded means, whose order is what counts.
 * y at a block's first and last rod holds its mean, so that whatever lies beside a rod is found
 * there. Both sides are looked at before one branch: that neither joins is likeliest. */
static void pool_from(double *y, int64_t n, int64_t i, struct stack *s)
{
    struct isotonic_block b = {.first = i + 1, .last = i + 1, .base = y[i + 1]};
    double count = 1 + take_left(&b, y, s);
    for (;;) {
        const int64_t r = b.last + (b.last + 1 < n), l = b.first - (b.first > 0);
        int right = (r > b.last) & (b.sum >= count * (y[r] - b.base));
        int left = (l < b.first) & (b.sum <= count * (y[l] - b.base));
        if (!(right | left)) {
            b.mean = b.base + b.sum / count;
            right = (r > b.last) & (b.mean >= y[r]);
            left = (l < b.first) & (y[l] >= b.mean);
            if (!(right | left))
                break;
            if (right)
                count += take_right(&b, y);
            if (left)
                count += take_left(&b, y, s);
        } else if (right) {
            count += take_right(&b, y);
        } else {
            do
                count += take_left(&b, y, s);
            while (b.first > 0 && b.sum <= count * (y[b.first - 1] - b.base));
        }
    }
    y[b.first] = y[b.last] = b.mean;
    s->blocks[s->count++] = b;
}

/* The first rod from i on that is not behind its right neighbour; n - 1 when there is none. Eight
 * at a time: which of them it is, is computed and not guessed. */
static inline int64_t next_violation(const double *y, int64_t n, int64_t i)
{
    for (; i + 8 < n; i += 8) {
        const unsigned eight = order_met(y + i);
        if (eight)
            return i + __builtin_ctz(eight);
    }
    const int left = (int)(n - 1 - i);
    unsigned bad = 0;
    for (int j = 0; j < left; j++)
        bad |= (unsigned)(y[i + j] >= y[i + j + 1]) << j;
    return i + (bad ? __builtin_ctz(bad) : left);
}

static void pool_line(double *y, int64_t n, struct stack *s)
{
    int64_t i = next_violation(y, n, 0);
    while (i + 1 < n) {
        pool_from(y, n, i, s);
        /* The rod after a block lies beyond its mean: pool_from saw to that. */
        i = next_violation(y, n, s->blocks[s->count - 1].last + 1);
    }
}

/* Most blocks are of four rods at most: written without a loop, whose length is hard to foresee. */
static void write_blocks(double *y, const struct isotonic_block *blocks, int64_t count)
{
    for (int64_t k = 0; k < count; k++) {
        const int64_t first = blocks[k].first, last = blocks[k].last;
        const double mean = blocks[k].mean;
        y[first + 1] = y[last - 1] = mean;
        for (int64_t i = first + 2; i < last - 1; i++)
            y[i] = mean;
    }
}

/* The block across the seam: rods first .. n-1 and 0 .. head (seen at y + ell). Still outside it
 * are the blocks from `low` on of the piece that it ends in, and those below `high` of the piece
 * that it begins in. */
struct seam {
    struct isotonic_block block; /* in the tail's frame; last counts on: n + head */
    const struct isotonic_piece *head, *tail;
    int64_t low, high;
};

static struct isotonic_block block_of(const struct isotonic_piece *piece, int64_t index)
{
    struct isotonic_block block = piece->blocks[index];
    block.first += piece->first;
    block.last += piece->first;
    return block;
}

/* The neighbour that begins at rod `right`, or ends at rod `left`. */
static struct isotonic_block next_right(struct seam *seam, const double *y, int64_t right)
{
    while (right >= seam->head->end) {
        seam->head++;
        seam->low = 0;
    }
    const int64_t first = right - seam->head->first;
    if (seam->low < seam->head->count && seam->head->blocks[seam->low].first == first)
        return block_of(seam->head, seam->low++);
    return single(y, right);
}

static struct isotonic_block next_left(struct seam *seam, const double *y, int64_t left)
{
    while (left < seam->tail->first) {
        seam->tail--;
        seam->high = seam->tail->count;
    }
    const int64_t last = left - seam->tail->first;
    if (seam->high > 0 && seam->tail->blocks[seam->high - 1].last == last)
        return block_of(seam->tail, --seam->high);
    return single(y, left);
}

/* Takes one neighbour into the seam's block if it violates the order; false when none does. */
static bool seam_widen(struct seam *seam, const double *y, int64_t n, double ell)
{
    struct isotonic_block *b = &seam->block;
    int64_t left = b->first - 1, right = b->last + 1 - n; /* the rods just outside */
    if (left < right)
        return false; /* all rods are in */
    const bool over = b->mean >= y[right] + ell, under = y[left] >= b->mean;
    if (!(over | under))
        return false;
    if (under) {
        const struct isotonic_block next = next_left(seam, y, left);
        absorb_left(b, &next);
        return true;
    }
    struct isotonic_block next = next_right(seam, y, right);
    next.base += ell;
    next.first += n;
    next.last += n;
    absorb_right(b, &next);
    return true;
}

void isotonic_ring(double *y, int64_t n, double ell, struct isotonic_block *blocks)
{
    struct isotonic_piece whole = {.first = 0, .end = n, .blocks = blocks};
    isotonic_piece(y, &whole);
    isotonic_close_ring(y, ell, &whole, 1);
}

void isotonic_close_ring(double *y, double ell, const struct isotonic_piece *pieces, int64_t count)
{
    const struct isotonic_piece *last = pieces + count - 1;
    const int64_t n = last->end;
    const bool apart = y[n - 1] < y[0] + ell;
    /* One rod, or one block of all, spans nothing but itself: its ends are ell apart at least. */
    if (apart || n == 1 || (pieces->count == 1 && count_of(pieces->blocks) == (double)n))
        return;

    struct seam seam = {.head = pieces, .low = 0, .tail = last, .high = last->count};
    seam.block = next_left(&seam, y, n - 1);
    while (seam_widen(&seam, y, n, ell))
        ;
    /* The head's position is rounded first and the tail made from it: contact is bitwise. */
    double at_head = seam.block.mean - ell, at_tail = at_head + ell;
    for (int64_t i = seam.block.first; i < n; i++)
        y[i] = at_tail;
    /* That rounding can put the tail an ulp of the head below its mean, and a rod there ahead of
     * it. */
    for (int64_t i = seam.block.first - 1; i > seam.block.last - n && y[i] > at_tail; i--)
        y[i] = at_tail;
    for (int64_t i = 0; i <= seam.block.last - n; i++)
        y[i] = at_head;
}

/* Projection onto a line in order, then onto the walls: the bounds keep the order, so that the two
 * together are the projection onto both. */
void isotonic_walls(double *y, int64_t n, double low, double high, struct isotonic_block *blocks)
{
    struct isotonic_piece whole = {.first = 0, .end = n, .blocks = blocks};
    isotonic_piece(y, &whole);
    isotonic_close_walls(y, n, low, high);
}

void isotonic_close_walls(double *y, int64_t n, double low, double high)
{
    for (int64_t i = 0; i < n && y[i] < low; i++)
        y[i] = low;
    for (int64_t i = n - 1; i >= 0 && y[i] > high; i--)
        y[i] = high;
}

void isotonic_piece(double *y, struct isotonic_piece *piece)
{
    struct stack s = {piece->blocks, 0};
    double *first = y + piece->first;
    pool_line(first, piece->end - piece->first, &s);
    write_blocks(first, piece->blocks, s.count);
    piece->count = s.count;
}

/* Where the regression of these rods alone jumps most; its values there are the largest mean that
 * ends there and the smallest that begins there. Not near an end, where rods beyond have their
 * say. */
struct isotonic_cut isotonic_cut(const double *y)
{
    enum { N = ISOTONIC_WINDOW };
    double in_order[N];
    struct isotonic_block blocks[N / 2 + 1];
    struct isotonic_piece all = {.first = 0, .end = N, .blocks = blocks};
    memcpy(in_order, y, sizeof in_order);
    isotonic_piece(in_order, &all);
    int64_t at = N / 4;
    for (int64_t i = N / 4; i <= N - N / 4; i++)
        if (in_order[i] - in_order[i - 1] > in_order[at] - in_order[at - 1])
            at = i;
    const double below = in_order[at - 1], above = in_order[at];
    return (struct isotonic_cut){
        .at = at, .level = below + (above - below) / 2, .clear = (above - below) / 2};
}

/* A mean of c rods is a sum of c differences from one of them, each within high - low, rounded c
 * times and more where blocks join (factor 4), put on top of that rod. */
double isotonic_clearance(int64_t n, double low, double high)
{
    return (double)n * (high - low) * 0x1p-51 + fmax(fabs(low), fabs(high)) * 0x1p-49;
}
