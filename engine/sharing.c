/* SPDX-License-Identifier: GPL-3.0-or-later
 * sharing.c - see sharing.h. */
#include "sharing.h"
#include "scene.h"
#include "kernels/ring_sort.h"
#include "kernels/rods.h"

#include <math.h>

bool bcd_scene_takes_hands(const struct bcd_scene *scene)
{
    return sharing_pays(&scene->plan);
}

void sharing_layout(struct sim *sim, struct arena *scratch)
{
    const size_t parts = (size_t)sharing_parts(sim->plan->particles);
    sim->parts = arena_take(scratch, parts * sizeof *sim->parts);
    sim->pieces = arena_take(scratch, (parts + 1) * sizeof *sim->pieces);
}

/* ----------------------------------------------------------------------- noise */

void sharing_add_noise_within(const struct sim *sim, const struct noise_key *key, double scale,
                              const struct stretch *rods, double *z)
{
    const struct normals_stretch normals = {rods->first, rods->end - rods->first};
    const int64_t tick = sim->clock->tick;
    if (!key->doubled) {
        normals_add_stretch(z + rods->first, &normals, scale, key, tick);
        return;
    }
    normals_add_stretch(z + rods->first, &normals, scale * sqrt(0.5), key, 2 * tick);
    normals_add_stretch(z + rods->first, &normals, scale * sqrt(0.5), key, 2 * tick + 1);
}

struct noise_work {
    const struct sim *sim;
    const struct noise_key *key;
    double scale, *z;
};

static void noise_part(void *of, int64_t part)
{
    const struct noise_work *w = of;
    const struct stretch rods = sharing_stretch(w->sim, part);
    sharing_add_noise_within(w->sim, w->key, w->scale, &rods, w->z);
}

void sharing_add_noise(const struct sim *sim, const struct noise_key *key, double scale, double *z)
{
    struct noise_work work = {sim, key, scale, z};
    sharing_each(sim, noise_part, &work);
}

/* -------------------------------------------------------------------- sticking */

struct sticking {
    const struct sim *sim;
    double *y;
};

/* Where a stretch may be cut, if what lies beyond it allows that. */
static void look(void *of, int64_t index)
{
    const struct sticking *s = of;
    const struct stretch rods = sharing_stretch(s->sim, index);
    struct sharing_part *part = &s->sim->parts[index];
    const int64_t count = rods.end - rods.first, from = (count - ISOTONIC_WINDOW) / 2;
    const double *y = s->y + rods.first;
    struct rods_range within = {INFINITY, -INFINITY}, before = within, after = within;
    part->cut.at = 0;
    if (from >= 0) {
        const int64_t to = from + ISOTONIC_WINDOW;
        before = rods_range(y, from);
        within = rods_range(y + from, ISOTONIC_WINDOW);
        after = rods_range(y + to, count - to);
        part->cut = isotonic_cut(y + from);
        part->cut.at += rods.first + from;
    } else {
        within = rods_range(y, count);
    }
    part->high_before = before.high;
    part->low_after = after.low;
    part->low = fmin(fmin(before.low, within.low), after.low);
    part->high = fmax(fmax(before.high, within.high), after.high);
}

/* Cuts the ring; the number of pieces. */
static int64_t cut(const struct sim *sim, struct isotonic_block *blocks)
{
    const int64_t n = sim->plan->particles, parts = sharing_parts(n);
    struct sharing_part *part = sim->parts;
    struct isotonic_piece *pieces = sim->pieces;
    double low = INFINITY, high = -INFINITY, before = -INFINITY;
    for (int64_t i = parts - 1; i >= 0; i--) {
        part[i].beyond = low;
        low = fmin(low, part[i].low);
        high = fmax(high, part[i].high);
    }
    const double clear = isotonic_clearance(n, low, high);
    int64_t count = 1;
    pieces[0] = (struct isotonic_piece){.first = 0, .blocks = blocks};
    for (int64_t i = 0; i < parts; before = fmax(before, part[i++].high)) {
        const struct isotonic_cut *c = &part[i].cut;
        const double below = fmax(before, part[i].high_before);
        const double above = fmin(part[i].beyond, part[i].low_after);
        if (!(c->at > 0 && c->clear > clear && below < c->level - clear &&
              above > c->level + clear))
            continue;
        pieces[count - 1].end = c->at;
        pieces[count++] = (struct isotonic_piece){.first = c->at, .blocks = blocks + c->at / 2};
    }
    pieces[count - 1].end = n;
    return count;
}

static void pool(void *of, int64_t index)
{
    const struct sticking *s = of;
    isotonic_piece(s->y, &s->sim->pieces[index]);
}

void sharing_stick(const struct sim *sim, double *y, struct isotonic_block *blocks)
{
    const struct plan *plan = sim->plan;
    struct sticking s = {sim, y};
    sharing_each(sim, look, &s);
    const int64_t pieces = cut(sim, blocks);
    sim->hands->share(sim->hands->context, pool, &s, pieces);
    if (plan->walls)
        isotonic_close_walls(y, plan->particles, plan->low, plan->low + plan->free_length);
    else
        isotonic_close_ring(y, plan->free_length, sim->pieces, pieces);
}

/* ------------------------------------------------------------------ reflecting */

struct reflecting {
    const struct sim *sim;
    struct marked_rods rods;
};

static void sort_part(void *of, int64_t index)
{
    const struct reflecting *r = of;
    const struct plan *plan = r->sim->plan;
    const struct stretch rods = sharing_stretch(r->sim, index);
    double *y = r->rods.y + rods.first;
    const int64_t count = rods.end - rods.first;
    if (plan->walls)
        reflect_part(y, count, plan->low, plan->low + plan->free_length);
    ring_sort_part(y, count, r->rods.scratch + rods.first);
}

void sharing_reflect(const struct sim *sim, double *y, double *scratch)
{
    const struct plan *plan = sim->plan;
    const int64_t n = plan->particles, parts = sharing_parts(n);
    struct reflecting r = {sim, {.y = y, .scratch = scratch}};
    bool few = true;
    sharing_each(sim, sort_part, &r);
    for (int64_t i = 1; i < parts && few; i++) {
        const struct stretch rods = sharing_stretch(sim, i);
        few = ring_sort_join(y, rods.first, rods.end);
    }
    if (!few)
        ring_sort_part(y, n, scratch);
    if (!plan->walls)
        ring_sort_close(y, n, plan->free_length, scratch);
}

static void sort_marked_part(void *of, int64_t index)
{
    const struct reflecting *r = of;
    const struct plan *plan = r->sim->plan;
    const struct stretch rods = sharing_stretch(r->sim, index);
    const struct marked_rods part = {r->rods.y + rods.first, r->rods.mark + rods.first,
                                     rods.end - rods.first, r->rods.scratch + 2 * rods.first};
    if (plan->walls)
        reflect_marked_part(&part, plan->low, plan->low + plan->free_length);
    ring_sort_marked_part(&part);
}

void sharing_reflect_marked(const struct sim *sim, const struct marked_rods *rods)
{
    const struct plan *plan = sim->plan;
    const int64_t parts = sharing_parts(plan->particles);
    struct reflecting r = {sim, *rods};
    bool few = true;
    sharing_each(sim, sort_marked_part, &r);
    for (int64_t i = 1; i < parts && few; i++) {
        const struct stretch part = sharing_stretch(sim, i);
        few = ring_sort_marked_join(rods, part.first, part.end);
    }
    if (!few)
        ring_sort_marked_part(rods);
    if (!plan->walls)
        ring_sort_marked_close(rods, plan->free_length);
}
