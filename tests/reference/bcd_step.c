/* SPDX-License-Identifier: GPL-3.0-or-later
 * bcd_step.c - see bcd_step.h. Written from the paper's description, for clarity, not for speed. */
#include "bcd_step.h"

#include <assert.h>
#include <stdbool.h>

/* Any rod length will do; one of the order of the positions makes mistakes in the ring visible. */
static const long double diameter = 0.75L;

/* A ring of rods labelled 0 .. n-1 in real coordinates. joined[i]: rods i and i+1 (mod n) belong to
 * the same cluster. */
struct ring {
    int n;
    long double length; /* of the whole ring, rods included */
    long double x[REFERENCE_RODS_MAX], velocity[REFERENCE_RODS_MAX];
    bool joined[REFERENCE_RODS_MAX];
};

static int next_rod(const struct ring *r, int i)
{
    return (i + 1) % r->n;
}

static int previous_rod(const struct ring *r, int i)
{
    return (i + r->n - 1) % r->n;
}

/* A cluster is told by its first rod and its size. */
static bool starts_cluster(const struct ring *r, int i)
{
    return !r->joined[previous_rod(r, i)];
}

static int cluster_size(const struct ring *r, int first)
{
    int size = 1;
    for (int i = first; r->joined[i] && size < r->n; i = next_rod(r, i))
        size++;
    return size;
}

static long double mean_velocity(const struct ring *r, int first, int size)
{
    long double sum = 0;
    for (int k = 0; k < size; k++)
        sum += r->velocity[(first + k) % r->n];
    return sum / size;
}

/* All rods in contact all the way round: there is no room to move but as one. */
static bool jammed(const struct ring *r)
{
    for (int i = 0; i < r->n; i++)
        if (!r->joined[i])
            return false;
    return true;
}

/* Opens the contact where the right part is pulled away from the left part hardest. */
static bool fragment_cluster(struct ring *r, int first)
{
    int size = cluster_size(r, first), best = -1;
    long double largest = 0;
    for (int left = 1; left < size; left++) {
        long double difference =
            mean_velocity(r, (first + left) % r->n, size - left) - mean_velocity(r, first, left);
        if (difference > largest) {
            largest = difference;
            best = (first + left - 1) % r->n;
        }
    }
    if (best < 0)
        return false;
    r->joined[best] = false;
    return true;
}

static void fragment_all(struct ring *r)
{
    bool opened = true;
    while (opened) {
        opened = false;
        for (int i = 0; i < r->n; i++)
            if (starts_cluster(r, i))
                opened = fragment_cluster(r, i) || opened;
    }
}

/* Free space between rod i, the last of its cluster, and the next rod. */
static long double gap_after(const struct ring *r, int i)
{
    int j = next_rod(r, i);
    long double ahead = r->x[j] + (j == 0 ? r->length : 0);
    return ahead - r->x[i] - diameter;
}

static long double velocity_of_cluster_with(const struct ring *r, int i)
{
    while (!starts_cluster(r, i))
        i = previous_rod(r, i);
    return mean_velocity(r, i, cluster_size(r, i));
}

/* The contact that closes first within `left`, or -1; *when = how soon. */
static int next_collision(const struct ring *r, long double left, long double *when)
{
    int closing = -1;
    *when = left;
    for (int i = 0; i < r->n; i++) {
        if (r->joined[i])
            continue;
        long double approach =
            velocity_of_cluster_with(r, i) - velocity_of_cluster_with(r, next_rod(r, i));
        if (approach <= 0)
            continue;
        long double time = gap_after(r, i) / approach;
        if (time < 0)
            time = 0; /* rounding: they touch already */
        if (time <= *when) {
            *when = time;
            closing = i;
        }
    }
    return closing;
}

static void move_all(struct ring *r, long double time)
{
    long double velocity[REFERENCE_RODS_MAX];
    for (int i = 0; i < r->n; i++)
        velocity[i] = velocity_of_cluster_with(r, i);
    for (int i = 0; i < r->n; i++)
        r->x[i] += velocity[i] * time;
}

static void collide_and_move(struct ring *r)
{
    long double left = 1; /* the step is the unit of time */
    /* The last collision leaves one open contact: more than n - 1 of them there cannot be. */
    for (int events = 0; events < r->n; events++) {
        long double when;
        int closing = next_collision(r, left, &when);
        move_all(r, when);
        left -= when;
        if (closing < 0)
            return;
        r->joined[closing] = true;
    }
    assert(!"more collisions than contacts");
}

void reference_bcd_step(double *y, const double *displacement, int n, double ell)
{
    assert(n >= 1 && n <= REFERENCE_RODS_MAX);
    struct ring r = {.n = n, .length = ell + n * diameter};
    for (int i = 0; i < n; i++) {
        r.x[i] = y[i] + i * diameter;
        r.velocity[i] = displacement[i];
        r.joined[i] = n > 1 && (i + 1 < n ? y[i] == y[i + 1] : y[i] == y[0] + ell);
    }
    if (jammed(&r)) {
        long double v = mean_velocity(&r, 0, n);
        for (int i = 0; i < n; i++)
            r.x[i] += v;
    } else {
        fragment_all(&r);
        collide_and_move(&r);
    }
    for (int i = 0; i < n; i++)
        y[i] = (double)(r.x[i] - i * diameter);
}

/* Places the rods for one set of closed contacts (bit i: contact of i and i+1): every block at the
 * mean of its rods' free positions. */
static void place_blocks(long double *out, const long double *free_position, int n, long double ell,
                         unsigned closed)
{
    int start = 0; /* some rod that starts a block; rod 0 if all contacts are closed */
    for (int i = 0; i < n; i++)
        if (!(closed >> i & 1))
            start = (i + 1) % n;
    for (int k = 0; k < n;) {
        int size = 1;
        while (k + size < n && (closed >> ((start + k + size - 1) % n) & 1))
            size++;
        long double sum = 0;
        for (int m = k; m < k + size; m++) /* past the seam positions count on by ell */
            sum += free_position[(start + m) % n] + (start + m >= n ? ell : 0);
        for (int m = k; m < k + size; m++)
            out[(start + m) % n] = sum / size - (start + m >= n ? ell : 0);
        k += size;
    }
}

static bool in_order(const long double *y, int n, long double ell, long double slack)
{
    for (int i = 0; i + 1 < n; i++)
        if (y[i] > y[i + 1] + slack)
            return false;
    return y[n - 1] <= y[0] + ell + slack;
}

void reference_projection(double *y, const double *displacement, int n, double ell)
{
    assert(n >= 1 && n <= REFERENCE_PROJECTION_MAX);
    long double z[REFERENCE_PROJECTION_MAX], trial[REFERENCE_PROJECTION_MAX];
    long double best[REFERENCE_PROJECTION_MAX] = {0}, least = -1, scale = 1;
    for (int i = 0; i < n; i++) {
        z[i] = (long double)y[i] + displacement[i];
        long double size = z[i] < 0 ? -z[i] : z[i];
        scale = size > scale ? size : scale;
    }
    for (unsigned closed = 0; closed < 1u << n; closed++) {
        place_blocks(trial, z, n, ell, closed);
        if (!in_order(trial, n, ell, 1e-17L * scale))
            continue;
        long double distance = 0;
        for (int i = 0; i < n; i++)
            distance += (trial[i] - z[i]) * (trial[i] - z[i]);
        if (least < 0 || distance < least) {
            least = distance;
            for (int i = 0; i < n; i++)
                best[i] = trial[i];
        }
    }
    assert(least >= 0);
    for (int i = 0; i < n; i++)
        y[i] = (double)best[i];
}
