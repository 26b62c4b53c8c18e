/* SPDX-License-Identifier: GPL-3.0-or-later
 * scene_cache.c - see scene_cache.h. */
#include "scene_cache.h"
#include "blob.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { SETS = 128, WAYS = 8, ENTRIES = SETS * WAYS, PLACES = 4096, TILE = 256 };

/* Values of a completed part, freed by the last that holds them. */
struct shared_part {
    atomic_size_t holders;
    const struct part_type *type;
    struct bcd_group group;
};

/* Everything that the completion of a part reads of the plan. */
struct geometry {
    double low, length, diameter, temperature, force, period;
    int64_t particles, walls;
};

struct entry {
    struct shared_part *part, *field; /* field: of an interaction, the potential beside it */
    struct geometry geometry;
    struct field_scan scan; /* width 0 = not yet */
    double stiffness;       /* NaN = not yet */
};

struct bcd_scene_cache {
    /* By hash into sets; in each the newest first, and the oldest makes way. An axis of a few
     * hundred values, walked through again and again, finds all of them. */
    struct entry potentials[ENTRIES], interactions[ENTRIES];
};

/* ------------------------------------------------------------------ sharing */

static void drop(struct shared_part *part)
{
    if (!part || atomic_fetch_sub(&part->holders, 1) > 1)
        return;
    if (part->type->release)
        part->type->release(part->group.values);
    group_free(&part->group);
    free(part);
}

static struct shared_part *hold(struct shared_part *part)
{
    if (part)
        atomic_fetch_add(&part->holders, 1);
    return part;
}

static const struct part_type *type_of(const struct scene_part *part)
{
    return part->slot == BCD_SLOT_POTENTIAL     ? &potential_types[part->index]->base
           : part->slot == BCD_SLOT_INTERACTION ? &pair_types[part->index]->base
                                                : &observable_types[part->index]->base;
}

void scene_part_end(struct scene_part *part)
{
    const struct part_type *type = type_of(part);
    if (part->shared) {
        drop(part->shared);
        return;
    }
    if (type->release)
        type->release(part->group.values);
    group_free(&part->group);
}

enum bcd_status bcd_scene_cache_create(struct bcd_scene_cache **cache)
{
    struct bcd_scene_cache *made = calloc(1, sizeof *made);
    if (!made)
        return BCD_NO_MEMORY;
    *cache = made;
    return BCD_OK;
}

void bcd_scene_cache_free(struct bcd_scene_cache *cache)
{
    for (int i = 0; cache && i < ENTRIES; i++) {
        drop(cache->potentials[i].part);
        drop(cache->interactions[i].part);
        drop(cache->interactions[i].field);
    }
    free(cache);
}

/* ------------------------------------------------------------------ finding */

static const struct scene_part *part_in(const struct bcd_scene *scene, enum bcd_slot slot)
{
    for (size_t i = 0; i < scene->part_count; i++)
        if (scene->parts[i].slot == slot)
            return &scene->parts[i];
    return NULL;
}

/* An interaction that reads nothing of what is beside it. */
static bool stands_alone(const struct scene_part *part)
{
    return part->slot == BCD_SLOT_INTERACTION && pair_types[part->index]->alone;
}

static struct geometry geometry_of(const struct bcd_scene *scene, const struct scene_part *part)
{
    const struct plan *plan = &scene->plan;
    if (stands_alone(part))
        return (struct geometry){.diameter = plan->diameter};
    struct geometry geometry = {.low = plan->low, .walls = plan->walls};
    /* On a ring a potential without a period, which looks at the length, is refused anyway. */
    if (plan->walls || part->slot == BCD_SLOT_INTERACTION)
        geometry.length = plan->length;
    if (part->slot == BCD_SLOT_INTERACTION) {
        geometry.diameter = plan->diameter;
        geometry.temperature = plan->temperature;
        geometry.force = plan->force;
        geometry.period = plan->period;
        geometry.particles = plan->particles;
    }
    return geometry;
}

/* The first of the WAYS entries that a part may be in. */
static struct entry *set_for(struct bcd_scene_cache *cache, const struct scene_part *part,
                             const struct geometry *geometry)
{
    uint64_t hash = blob_hash(geometry, sizeof *geometry, group_hash(&part->group));
    size_t at = (size_t)((hash ^ hash >> 32) % SETS) * WAYS;
    return part->slot == BCD_SLOT_POTENTIAL ? &cache->potentials[at] : &cache->interactions[at];
}

/* The potential that an interaction reads: NULL = there is none. */
static const struct scene_part *field_beside(const struct bcd_scene *scene,
                                             const struct scene_part *part)
{
    bool reads = part->slot == BCD_SLOT_INTERACTION && !stands_alone(part);
    return reads ? part_in(scene, BCD_SLOT_POTENTIAL) : NULL;
}

static struct shared_part *field_of(const struct bcd_scene *scene, const struct scene_part *part)
{
    const struct scene_part *field = field_beside(scene, part);
    return field ? field->shared : NULL;
}

static bool holds(const struct entry *entry, const struct bcd_scene *scene,
                  const struct scene_part *part, const struct geometry *geometry)
{
    return entry->part && memcmp(&entry->geometry, geometry, sizeof *geometry) == 0 &&
           entry->field == field_of(scene, part) && group_equal(&entry->part->group, &part->group);
}

/* The entry whose part this scene shares. */
static struct entry *entry_of(struct bcd_scene_cache *cache, const struct bcd_scene *scene,
                              enum bcd_slot slot)
{
    const struct scene_part *part = part_in(scene, slot);
    if (!cache || !part || !part->shared)
        return NULL;
    struct geometry geometry = geometry_of(scene, part);
    struct entry *set = set_for(cache, part, &geometry);
    for (int i = 0; i < WAYS; i++)
        if (set[i].part == part->shared)
            return &set[i];
    return NULL;
}

/* --------------------------------------------------------------- completion */

/* The scene's part becomes one to be shared, known to the cache; left alone without memory. */
static void keep(struct entry *set, const struct bcd_scene *scene, struct scene_part *part,
                 const struct geometry *geometry)
{
    struct shared_part *shared = malloc(sizeof *shared);
    if (!shared)
        return;
    *shared = (struct shared_part){.type = type_of(part), .group = part->group};
    atomic_init(&shared->holders, 2);
    part->shared = shared;
    drop(set[WAYS - 1].part);
    drop(set[WAYS - 1].field);
    memmove(set + 1, set, (WAYS - 1) * sizeof *set);
    set[0] = (struct entry){.part = shared,
                            .field = hold(field_of(scene, part)),
                            .geometry = *geometry,
                            .stiffness = NAN};
}

void scene_cache_complete(struct bcd_scene_cache *cache, struct bcd_scene *scene,
                          struct scene_part *part, struct bcd_errors *errors)
{
    const struct part_type *type = type_of(part);
    struct geometry geometry = geometry_of(scene, part);
    const struct scene_part *field = field_beside(scene, part);
    /* Beside a field that is not known itself, an interaction is no one's to find again. */
    bool known = cache && !(field && !field->shared);
    struct entry *set = known ? set_for(cache, part, &geometry) : NULL;
    for (int i = 0; set && i < WAYS; i++) {
        if (!holds(&set[i], scene, part, &geometry))
            continue;
        group_free(&part->group);
        part->shared = hold(set[i].part);
        part->group.values = set[i].part->group.values;
        return;
    }
    size_t before = errors->count + errors->dropped;
    if (type->complete)
        type->complete(&part->group, &scene->plan, errors);
    if (set && errors->count + errors->dropped == before)
        keep(set, scene, part, &geometry);
}

/* -------------------------------------------------------------------- looks */

static void energies_at(const struct plan *plan, const double *x, int n, double *energy)
{
    if (plan->potential->energies) {
        plan->potential->energies(plan->potential_par, x, n, energy);
        return;
    }
    for (int i = 0; i < n; i++)
        energy[i] = plan_energy(plan, x[i]);
}

static void look(const struct plan *plan, struct field_scan *scan)
{
    double x[TILE], energy[TILE], from = scan->from, width = scan->width;
    double before = plan_energy(plan, from), lowest = before, highest = before, rise = 0;
    for (int start = 1; start <= PLACES; start += TILE) {
        for (int i = 0; i < TILE; i++)
            x[i] = from + width * (start + i) / PLACES;
        energies_at(plan, x, TILE, energy);
        for (int i = 0; i < TILE; i++) {
            double now = energy[i], step = fabs(now - before);
            rise = step > rise ? step : rise;
            lowest = now < lowest ? now : lowest;
            highest = now > highest ? now : highest;
            before = now;
        }
    }
    scan->steepest = rise * PLACES / width;
    scan->barrier = highest - lowest;
}

void scene_cache_scan(struct bcd_scene_cache *cache, const struct bcd_scene *scene,
                      struct field_scan *scan)
{
    struct entry *entry = entry_of(cache, scene, BCD_SLOT_POTENTIAL);
    if (entry && entry->scan.from == scan->from && entry->scan.width == scan->width) {
        *scan = entry->scan;
        return;
    }
    look(&scene->plan, scan);
    if (entry)
        entry->scan = *scan;
}

double scene_cache_stiffness(struct bcd_scene_cache *cache, const struct bcd_scene *scene)
{
    struct entry *entry = entry_of(cache, scene, BCD_SLOT_INTERACTION);
    if (entry && !isnan(entry->stiffness))
        return entry->stiffness;
    double stiffness = scene->plan.pair->stiffness(scene->plan.pair_par, &scene->plan);
    if (entry)
        entry->stiffness = stiffness;
    return stiffness;
}
