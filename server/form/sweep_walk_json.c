/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_walk_json.c - from one point of a sweep to the next: a copy of the base job in which only
 * the values that change are put in.
 */
#include "scene_json_tree.h"
#include "sweep_json_tree.h"

#include <jansson.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct sweep_walk {
    const struct sweep *sweep;
    json_t *job;
    struct sweep_slot slots[SWEEP_AXES_MAX];
    json_t *values[SWEEP_AXES_MAX]; /* of each axis, its own: threads share no reference counts */
    size_t at[SWEEP_AXES_MAX];      /* index into each group's values; SIZE_MAX = not yet there */
    size_t next, end;
    size_t seed;    /* the axis /seed if it goes fastest and alone; SIZE_MAX = none does */
    bool only_seed; /* moved from the point before */
    bool failed;    /* for want of memory a value is not where it should be */
};

static size_t find_seed(const struct sweep *sweep);
static void go(struct sweep_walk *walk, size_t point);
static json_t *at_axis(const struct sweep_walk *walk, size_t axis);
static bool put(const struct sweep_slot *slot, json_t *value);

struct sweep_walk *sweep_walk_create(const struct sweep *sweep, size_t first, size_t end)
{
    struct sweep_walk *walk = calloc(1, sizeof(*walk));
    bool sound = walk != NULL;
    if (!walk)
        return NULL;
    *walk =
        (struct sweep_walk){.sweep = sweep, .next = first, .end = end, .seed = find_seed(sweep)};
    walk->job = json_deep_copy(sweep->base);
    for (size_t a = 0; a < sweep->axis_count; a++) {
        walk->values[a] = json_deep_copy(sweep->axes[a].values);
        sound = sound && walk->values[a] &&
                !sweep_slot_find(walk->job, sweep->axes[a].pointer, &walk->slots[a]);
    }
    for (size_t g = 0; g < SWEEP_AXES_MAX; g++)
        walk->at[g] = SIZE_MAX;
    if (sound)
        return walk;
    sweep_walk_free(walk);
    return NULL;
}

void sweep_walk_free(struct sweep_walk *walk)
{
    if (!walk)
        return;
    for (size_t a = 0; a < SWEEP_AXES_MAX; a++)
        json_decref(walk->values[a]);
    json_decref(walk->job);
    free(walk);
}

void sweep_walk_move(struct sweep_walk *walk, size_t first, size_t end)
{
    walk->next = first;
    walk->end = end;
}

bool sweep_walk_next(struct sweep_walk *walk, size_t *point)
{
    const struct sweep *sweep = walk->sweep;
    while (walk->next < walk->end) {
        size_t rest = walk->next;
        bool fresh = false;
        for (size_t g = sweep->group_count; g-- > 0; rest /= sweep->groups[g].length)
            fresh = fresh || rest % sweep->groups[g].length >= sweep->groups[g].old;
        if (fresh) {
            *point = walk->next++;
            go(walk, *point);
            return true;
        }
        walk->next++;
    }
    return false;
}

enum bcd_status sweep_walk_scene(struct sweep_walk *walk, struct bcd_scene_cache *cache,
                                 struct bcd_scene **scene, struct bcd_errors *errors)
{
    return walk->failed ? BCD_NO_MEMORY : scene_json_read(walk->job, cache, scene, errors);
}

bool sweep_walk_seeds(const struct sweep_walk *walk)
{
    return walk->seed != SIZE_MAX;
}

bool sweep_walk_seed(const struct sweep_walk *walk, int64_t *seed)
{
    const json_t *value = walk->seed == SIZE_MAX ? NULL : at_axis(walk, walk->seed);
    if (!walk->only_seed || !json_is_integer(value))
        return false;
    *seed = json_integer_value(value);
    return true;
}

void sweep_walk_add_place(const struct sweep_walk *walk, struct text *text)
{
    enum { DIGITS_MAX = 24 };
    for (size_t g = 0; g < walk->sweep->group_count; g++) {
        char digits[DIGITS_MAX];
        size_t first = DIGITS_MAX, at = walk->at[g];
        do
            digits[--first] = (char)('0' + at % 10);
        while (at /= 10);
        digits[--first] = g ? ',' : '[';
        text_add_bytes(text, digits + first, DIGITS_MAX - first);
    }
    text_add_bytes(text, "]", 1);
}

void sweep_walk_add_values(const struct sweep_walk *walk, struct text *text)
{
    for (size_t a = 0; a < walk->sweep->axis_count; a++) {
        text_add(text, "%s%s = ", a ? ", " : "", walk->sweep->axes[a].pointer);
        sweep_add_value(text, walk->sweep, a, walk->at[walk->sweep->axes[a].group]);
    }
}

/* The last group is the fastest. */
static size_t find_seed(const struct sweep *sweep)
{
    size_t found = SIZE_MAX;
    for (size_t a = 0; a < sweep->axis_count; a++)
        if (sweep->axes[a].group + 1 == sweep->group_count)
            found = found == SIZE_MAX && strcmp(sweep->axes[a].pointer, "/seed") == 0
                        ? a
                        : sweep->axis_count;
    return found < sweep->axis_count ? found : SIZE_MAX;
}

static json_t *at_axis(const struct sweep_walk *walk, size_t axis)
{
    return json_array_get(walk->values[axis], walk->at[walk->sweep->axes[axis].group]);
}

/* Puts into the job what differs from the point before. */
static void go(struct sweep_walk *walk, size_t point)
{
    const struct sweep *sweep = walk->sweep;
    bool moved[SWEEP_AXES_MAX] = {false};
    for (size_t g = sweep->group_count; g-- > 0; point /= sweep->groups[g].length) {
        size_t at = point % sweep->groups[g].length;
        moved[g] = at != walk->at[g];
        walk->at[g] = at;
        walk->only_seed = g + 1 == sweep->group_count ? moved[g] : walk->only_seed && !moved[g];
    }
    for (size_t a = 0; a < sweep->axis_count; a++)
        if (moved[sweep->axes[a].group])
            walk->failed |= !put(&walk->slots[a], at_axis(walk, a));
}

static bool put(const struct sweep_slot *slot, json_t *value)
{
    if (json_is_array(slot->parent))
        return json_array_set(slot->parent, slot->index, value) == 0;
    return json_object_set(slot->parent, slot->key, value) == 0;
}
