/* SPDX-License-Identifier: GPL-3.0-or-later
 * chronological.c - see chronological.h. */
#include "chronological.h"

#include <math.h>

/* The rods during a step. */
struct course {
    const struct lane *lane;
    struct chronological *work;
    int64_t start; /* the first rod of some cluster */
};

/* ----------------------------------------------------------- fragmentation */

static void put(struct chronological *work, const struct cluster *c)
{
    work->clusters[c->first] = *c;
    work->first_of[c->last] = c->first;
}

/* Rods first .. last, in contact at the beginning of the step. */
static struct cluster gather(const struct lane *lane, const double *y, const double *z,
                             int64_t first, int64_t last)
{
    struct cluster c = cluster_of_one(y, z, first);
    c.last = last;
    for (int64_t i = first; i != last;) {
        i = lane_next(lane, i);
        c.sum += z[i] - y[i];
    }
    c.velocity = c.sum / cluster_count(lane, &c);
    return c;
}

/* The last rod of the left part when c breaks in two, or its last rod when it holds. */
static int64_t weakest_contact(const struct lane *lane, const double *y, const double *z,
                               const struct cluster *c)
{
    double count = cluster_count(lane, c), left = 0, right = c->sum, largest = 0;
    int64_t weakest = c->last, i = c->first;
    for (double k = 1; k < count; k++, i = lane_next(lane, i)) {
        double moved = z[i] - y[i];
        left += moved;
        right -= moved;
        double difference = right / (count - k) - left / k;
        if (difference > largest) {
            largest = difference;
            weakest = i;
        }
    }
    return weakest;
}

/* Breaks the cluster first .. last until its parts hold. Parts to the right wait as they are. */
static void fragment(const struct lane *lane, const double *y, const double *z,
                     struct chronological *work, struct cluster whole)
{
    int64_t first = whole.first;
    work->clusters[first] = whole;
    for (;;) {
        struct cluster c = work->clusters[first];
        int64_t cut = weakest_contact(lane, y, z, &c);
        if (cut == c.last) {
            put(work, &c);
            if (c.last == whole.last)
                return;
            first = lane_next(lane, c.last);
            continue;
        }
        int64_t behind = lane_next(lane, cut);
        work->clusters[behind] = gather(lane, y, z, behind, c.last);
        work->clusters[first] = gather(lane, y, z, first, cut);
    }
}

static void fragment_all(const struct course *course, const double *y, const double *z)
{
    const struct lane *lane = course->lane;
    int64_t first = course->start;
    do {
        int64_t last = first;
        while (lane_contact(lane, y, last))
            last = lane_next(lane, last);
        fragment(lane, y, z, course->work, gather(lane, y, z, first, last));
        first = lane_next(lane, last);
    } while (first != course->start);
}

/* -------------------------------------------------------------- tournament */

static int64_t winner_of(const struct course *course, int64_t node)
{
    int64_t n = course->lane->n;
    return node >= n ? node - n : course->work->winner[node];
}

static void play(const struct course *course, int64_t node)
{
    const double *time = course->work->time;
    int64_t a = winner_of(course, 2 * node), b = winner_of(course, 2 * node + 1);
    course->work->winner[node] = time[b] < time[a] ? b : a;
}

static void set_time(const struct course *course, int64_t contact, double time)
{
    course->work->time[contact] = time;
    for (int64_t node = (course->lane->n + contact) / 2; node >= 1; node /= 2)
        play(course, node);
}

/* -------------------------------------------------------------- collisions */

static struct cluster *left_of(const struct course *course, int64_t contact)
{
    return &course->work->clusters[course->work->first_of[contact]];
}

static struct cluster *right_of(const struct course *course, int64_t contact)
{
    return &course->work->clusters[lane_next(course->lane, contact)];
}

/* When the open contact after a cluster's last rod closes, seen from a time `now`. */
static double collision(const struct course *course, int64_t contact, double now)
{
    const struct lane *lane = course->lane;
    if (lane->walls && contact == lane->n - 1)
        return INFINITY;
    const struct cluster *a = left_of(course, contact), *b = right_of(course, contact);
    double approach = a->velocity - b->velocity;
    if (!(approach > 0)) /* also of a cluster of all rods with itself */
        return INFINITY;
    double gap = cluster_at(b, now) + cluster_offset(lane, a, b) - cluster_at(a, now);
    return now + fmax(gap, 0) / approach; /* < 0: rounding, they touch */
}

static void open_tournament(const struct course *course)
{
    struct chronological *work = course->work;
    for (int64_t i = 0; i < course->lane->n; i++)
        work->time[i] = INFINITY;
    int64_t first = course->start;
    do {
        int64_t last = work->clusters[first].last;
        work->time[last] = collision(course, last, 0);
        first = lane_next(course->lane, last);
    } while (first != course->start);
    for (int64_t node = course->lane->n - 1; node >= 1; node--)
        play(course, node);
}

/* The clusters on both sides of a contact become one; their neighbours meet it at other times. */
static void merge(struct course *course, int64_t contact, double now)
{
    const struct lane *lane = course->lane;
    struct cluster *a = left_of(course, contact), *b = right_of(course, contact);
    a->at = cluster_at(a, now);
    b->at = cluster_at(b, now);
    a->when = now;
    cluster_join(lane, a, b);
    course->work->first_of[a->last] = a->first;
    if (course->start == b->first)
        course->start = a->first;
    set_time(course, contact, INFINITY);
    int64_t before = lane_previous(lane, a->first);
    set_time(course, before, collision(course, before, now));
    set_time(course, a->last, collision(course, a->last, now));
}

static void collide_all(struct course *course)
{
    open_tournament(course);
    for (;;) {
        int64_t contact = winner_of(course, 1);
        double now = course->work->time[contact];
        if (!(now <= 1))
            return;
        merge(course, contact, now);
    }
}

void chronological_step(const struct lane *lane, const double *y, double *z,
                        struct chronological *work)
{
    struct course course = {lane, work, lane_start(lane, y)};
    if (course.start < 0) {
        lane_move_rigid(lane, y, z);
        return;
    }
    fragment_all(&course, y, z);
    collide_all(&course);
    int64_t first = course.start;
    do {
        const struct cluster *c = &work->clusters[first];
        cluster_write(lane, c, z);
        first = lane_next(lane, c->last);
    } while (first != course.start);
    lane_settle(lane, z);
}
