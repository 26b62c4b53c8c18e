/* SPDX-License-Identifier: GPL-3.0-or-later
 * bonds.c - see bonds.h. Gap i lies between the rods i and i + 1 (mod n); each has at most one
 * event ahead: the collision of its clusters when it is open, an attempt to break when bonded. */
#include "bonds.h"
#include "elementary.h"

#include <math.h>

static const double root_2pi = 2.5066282746310002;

enum { WORDS_AT_ONCE = 256 };

/* Uniform numbers of one step, one after another. */
struct uniforms {
    const struct noise_key *key;
    int64_t tick, next;
    uint32_t words[WORDS_AT_ONCE];
};

struct flight {
    const struct bond_ring *ring;
    const struct bond_noise *noise;
    const struct bond_space *space;
    struct uniforms uniforms;
    int64_t queue, budget; /* gaps in the heap; events left */
    double attempts;       /* rate at which every bond tries to break: the largest there is */
};

static double next_uniform(struct uniforms *u)
{
    int64_t at = u->next % WORDS_AT_ONCE;
    if (at == 0)
        philox_words(u->words, u->next / 4, WORDS_AT_ONCE / 4, u->key, u->tick);
    u->next++;
    return ((double)u->words[at] + 0.5) * 0x1p-32;
}

/* ------------------------------------------------------------------- events */

static bool earlier(const struct bond_space *s, int64_t a, int64_t b)
{
    return s->due[a] < s->due[b] || (!(s->due[b] < s->due[a]) && a < b);
}

static void settle(const struct bond_space *s, int64_t at, int64_t gap)
{
    s->heap[at] = gap;
    s->queued[gap] = at;
}

static void sift_up(const struct bond_space *s, int64_t at)
{
    int64_t gap = s->heap[at];
    for (; at > 1 && earlier(s, gap, s->heap[at / 2]); at /= 2)
        settle(s, at, s->heap[at / 2]);
    settle(s, at, gap);
}

static void sift_down(const struct bond_space *s, int64_t at, int64_t count)
{
    int64_t gap = s->heap[at];
    for (int64_t child = 2 * at; child <= count; child = 2 * at) {
        if (child < count && earlier(s, s->heap[child + 1], s->heap[child]))
            child++;
        if (!earlier(s, s->heap[child], gap))
            break;
        settle(s, at, s->heap[child]);
        at = child;
    }
    settle(s, at, gap);
}

/* The gap's next event is at `time`; none when that is beyond the step. */
static void schedule(struct flight *f, int64_t gap, double time)
{
    const struct bond_space *s = f->space;
    int64_t at = s->queued[gap];
    s->due[gap] = time;
    if (time <= 1) {
        if (at == 0)
            settle(s, at = ++f->queue, gap);
        sift_up(s, at);
        sift_down(s, s->queued[gap], f->queue);
        return;
    }
    if (at == 0)
        return;
    s->queued[gap] = 0;
    int64_t moved = s->heap[f->queue--];
    if (moved == gap)
        return;
    settle(s, at, moved);
    sift_up(s, at);
    sift_down(s, s->queued[moved], f->queue);
}

/* ----------------------------------------------------------------- clusters */

static int64_t after(const struct bond_ring *r, int64_t rod)
{
    return rod + 1 < r->n ? rod + 1 : 0;
}

static int64_t before(const struct bond_ring *r, int64_t rod)
{
    return rod > 0 ? rod - 1 : r->n - 1;
}

static int64_t size_of(const struct bond_ring *r, int64_t first, int64_t last)
{
    return last >= first ? last - first + 1 : last - first + 1 + r->n;
}

static double at_time(const struct bond_cluster *c, double time)
{
    double flown = time - c->since;
    return c->at + flown * (c->velocity + flown * c->drift);
}

static double velocity_at(const struct bond_cluster *c, double time)
{
    return c->velocity + 2 * (time - c->since) * c->drift;
}

static void put_cluster(struct flight *f, int64_t first, int64_t last, struct bond_cluster c)
{
    c.other = last;
    f->space->clusters[first] = c;
    f->space->clusters[last].other = first;
}

static double mean_of(const struct bond_ring *r, const double *values, int64_t first, int64_t count)
{
    double sum = 0;
    for (int64_t k = 0, i = first; k < count; k++, i = after(r, i))
        sum += values[i];
    return sum / (double)count;
}

/* Position of the last rod minus position of the first. */
static double turn_within(const struct bond_ring *r, int64_t first, int64_t last)
{
    return last < first ? -r->ell : 0;
}

/* What to add to y of the rod after `gap` to see it beside the rod before. */
static double turn_across(const struct bond_ring *r, int64_t gap)
{
    return gap == r->n - 1 ? r->ell : 0;
}

/* The first time > 0 at which closing * t + faster * t^2 has used up a gap `open` >= 0. */
static double time_to_meet(double open, double closing, double faster)
{
    double square = closing * closing + 4 * faster * open;
    if (closing > 0)
        return square >= 0 ? 2 * open / (closing + sqrt(square)) : INFINITY;
    return faster > 0 ? (sqrt(square) - closing) / (2 * faster) : INFINITY;
}

/* When the clusters on both sides of an open gap meet. */
static void foresee_collision(struct flight *f, int64_t gap, double now)
{
    const struct bond_ring *r = f->ring;
    int64_t left = f->space->clusters[gap].other, right = after(r, gap);
    const struct bond_cluster *a = &f->space->clusters[left], *b = &f->space->clusters[right];
    double when = INFINITY;
    if (left != right) {
        double open = (at_time(b, now) + turn_across(r, gap)) -
                      (at_time(a, now) + turn_within(r, left, gap));
        double closing = velocity_at(a, now) - velocity_at(b, now);
        when = now + time_to_meet(fmax(open, 0), closing, a->drift - b->drift);
    }
    schedule(f, gap, when);
}

/* Attempts to break come at a constant rate and are thinned to that of the masses of then. */
static void foresee_attempt(struct flight *f, int64_t gap, double now)
{
    schedule(f, gap, now - log_normal(next_uniform(&f->uniforms)) / f->attempts);
}

/* Deviation of the relative velocity of a and b rods. */
static double deviation_of(const struct bond_noise *noise, int64_t a, int64_t b)
{
    return noise->deviation * sqrt(1 / (double)a + 1 / (double)b);
}

/* ------------------------------------------------------------ what may happen */

static void collide(struct flight *f, int64_t gap, double now)
{
    const struct bond_ring *r = f->ring;
    struct bond_cluster *clusters = f->space->clusters;
    int64_t right = after(r, gap), left = clusters[gap].other, last = clusters[right].other;
    struct bond_cluster *a = &clusters[left], *b = &clusters[right];
    int64_t na = size_of(r, left, gap), nb = size_of(r, right, last);
    double share = (double)nb / (double)(na + nb);
    double va = velocity_at(a, now), vb = velocity_at(b, now), mean = va + share * (vb - va);
    /* b seen in the frame of a's first rod. */
    double shift = turn_across(r, gap) - turn_within(r, left, gap);
    double at = at_time(a, now);
    at += share * (at_time(b, now) + shift - at);

    double stick = f->noise->strength * root_2pi / deviation_of(f->noise, na, nb);
    if (f->budget < 0 || stick >= 1 || next_uniform(&f->uniforms) < stick) {
        r->bonded[gap] = 1;
        double drift = a->drift + share * (b->drift - a->drift);
        put_cluster(f, left, last, (struct bond_cluster){at, mean, drift, now, 0});
        if (f->budget >= 0)
            foresee_attempt(f, gap, now);
        else
            schedule(f, gap, INFINITY);
    } else { /* they may meet again, pressed together by their drift */
        put_cluster(f, left, gap, (struct bond_cluster){at, 2 * mean - va, a->drift, now, 0});
        put_cluster(f, right, last,
                    (struct bond_cluster){at - shift, 2 * mean - vb, b->drift, now, 0});
        foresee_collision(f, gap, now);
    }
    foresee_collision(f, before(r, left), now);
    foresee_collision(f, last, now);
}

static void attempt_break(struct flight *f, int64_t gap, double now)
{
    const struct bond_ring *r = f->ring;
    struct bond_cluster *clusters = f->space->clusters;
    int64_t first = gap, right = after(r, gap);
    while (r->bonded[before(r, first)])
        first = before(r, first);
    const struct bond_cluster whole = clusters[first];
    int64_t na = size_of(r, first, gap), nb = size_of(r, right, whole.other);
    double s = deviation_of(f->noise, na, nb);
    double rate = fmin(1, s / (f->noise->strength * root_2pi));
    if (!(next_uniform(&f->uniforms) * f->attempts < rate)) {
        foresee_attempt(f, gap, now);
        return;
    }
    double speed = s * sqrt(-2 * log_normal(next_uniform(&f->uniforms)));
    double share = (double)nb / (double)(na + nb), at = at_time(&whole, now);
    double mean = velocity_at(&whole, now);
    double shift = turn_across(r, gap) - turn_within(r, first, gap);
    struct bond_cluster a = {at, mean - share * speed, 0, now, 0},
                        b = {at - shift, mean + (1 - share) * speed, 0, now, 0};
    if (f->noise->drift) {
        a.drift = mean_of(r, f->noise->drift, first, na);
        b.drift = mean_of(r, f->noise->drift, right, nb);
    }
    r->bonded[gap] = 0;
    put_cluster(f, first, gap, a);
    put_cluster(f, right, whole.other, b);
    foresee_collision(f, gap, now);
    foresee_collision(f, before(r, first), now);
    foresee_collision(f, whole.other, now);
}

/* ----------------------------------------------------------------- the step */

/* A rod that begins a cluster; there is one, for not all gaps are bonded. */
static int64_t some_first(const struct bond_ring *r)
{
    int64_t i = 0;
    while (r->bonded[before(r, i)])
        i++;
    return i;
}

static int64_t last_from(const struct bond_ring *r, int64_t first)
{
    while (r->bonded[first])
        first = after(r, first);
    return first;
}

static void take_off(struct flight *f)
{
    const struct bond_ring *r = f->ring;
    const int64_t start = some_first(r);
    int64_t first = start;
    do {
        int64_t last = last_from(r, first), count = size_of(r, first, last);
        struct bond_cluster c = {.at = r->y[first]};
        c.velocity = mean_of(r, f->noise->velocity, first, count);
        if (f->noise->drift)
            c.drift = mean_of(r, f->noise->drift, first, count);
        put_cluster(f, first, last, c);
        first = after(r, last);
    } while (first != start);
    for (int64_t i = 0; i < r->n; i++) {
        if (r->bonded[i])
            foresee_attempt(f, i, 0);
        else
            foresee_collision(f, i, 0);
    }
}

/* Rods first .. last to `at`, the place of the first: made from the head's place across the seam.
 */
static void place(const struct bond_ring *r, int64_t first, int64_t last, double at)
{
    double head = last < first ? at - r->ell : at, tail = last < first ? head + r->ell : at;
    int64_t count = size_of(r, first, last);
    for (int64_t k = 0, i = first; k < count; k++, i = after(r, i))
        r->y[i] = last < first && i <= last ? head : tail;
}

static void land(const struct flight *f)
{
    const struct bond_ring *r = f->ring;
    const int64_t start = some_first(r);
    int64_t first = start;
    do {
        const struct bond_cluster *c = &f->space->clusters[first];
        place(r, first, c->other, at_time(c, 1));
        first = after(r, c->other);
    } while (first != start);
}

void bonds_move(const struct bond_ring *ring, const struct bond_noise *noise,
                const struct bond_space *space)
{
    double largest = deviation_of(noise, 1, 1) / (noise->strength * root_2pi);
    struct flight f = {.ring = ring,
                       .noise = noise,
                       .space = space,
                       .budget = 64 * ring->n + 1024,
                       .attempts = fmin(1, largest)};
    f.uniforms.key = &noise->key;
    f.uniforms.tick = noise->tick;
    take_off(&f);
    while (f.queue > 0) {
        int64_t gap = space->heap[1];
        double now = space->due[gap];
        f.budget--;
        if (!ring->bonded[gap])
            collide(&f, gap, now);
        else if (f.budget >= 0)
            attempt_break(&f, gap, now);
        else
            schedule(&f, gap, INFINITY);
    }
    land(&f);
}

void bonds_average(const struct bond_ring *r)
{
    const int64_t start = some_first(r);
    int64_t first = start;
    do {
        int64_t last = last_from(r, first), count = size_of(r, first, last);
        double sum = 0;
        for (int64_t k = 0, i = first; k < count; k++, i = after(r, i))
            sum += r->y[i] + (i < first ? r->ell : 0) - r->y[first];
        if (count > 1)
            place(r, first, last, r->y[first] + sum / (double)count);
        first = after(r, last);
    } while (first != start);
}
