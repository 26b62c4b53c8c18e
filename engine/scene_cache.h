/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * scene_cache.h - potentials and interactions that were completed before, and what was found by
 * looking at them in many places: what most of a scene's completion costs. See bcd.h for its use.
 *
 * A part that the cache has seen with the same parameters, in a geometry that its completion cannot
 * tell from this one, is shared instead of being made again. Equal means bit for bit, so that a
 * scene is the same with and without a cache.
 */
#ifndef SCENE_CACHE_H
#define SCENE_CACHE_H

#include "scene.h"

/* Ends a scene's part: its values, unless others share them. */
void scene_part_end(struct scene_part *part);

/* Completes a part: checks what rows alone cannot, makes its tables; from the cache (may be NULL)
 * if that knows it. The plan's geometry, and for an interaction its field, are there. */
void scene_cache_complete(struct bcd_scene_cache *cache, struct bcd_scene *scene,
                          struct scene_part *part, struct bcd_errors *errors);

/* Steepest slope and highest minus lowest energy of the plan's field, from energies at many places
 * of [from, from + width]. */
struct field_scan {
    double from, width, steepest, barrier;
};
void scene_cache_scan(struct bcd_scene_cache *cache, const struct bcd_scene *scene,
                      struct field_scan *scan);

/* The stiffness of the plan's interaction. */
double scene_cache_stiffness(struct bcd_scene_cache *cache, const struct bcd_scene *scene);

#endif
