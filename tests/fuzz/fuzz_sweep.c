/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz.h"

#include "sweep_json.h"

#include <math.h>
#include <string.h>

enum { POINTS = 40 }; /* looked at of each sweep */

/* The index that a place, as it is kept, has for each group. */
static void check_place(const struct sweep *sweep, const struct sweep_walk *walk)
{
    struct text text = {0};
    size_t at[SWEEP_AXES_MAX];
    sweep_walk_add_place(walk, &text);
    char *place = text_take(&text);
    FUZZ_CHECK(place && sweep_place_parse(sweep, place, at));
    for (size_t i = 0; sweep_axis(sweep, i); i++) {
        size_t group = sweep_axis_group(sweep, i);
        FUZZ_CHECK(group < SWEEP_AXES_MAX);
        FUZZ_CHECK(sweep_add_value(&text, sweep, i, at[group]));
        bool whole;
        sweep_number(sweep, i, at[group], &whole);
        sweep_number(sweep, i, at[group], NULL);
    }
    sweep_walk_add_values(walk, &text);
    char *values = text_take(&text);
    FUZZ_CHECK(values);
    free(values);
    free(place);
}

static void walk_through(const struct sweep *sweep)
{
    size_t points = sweep_points(sweep), seen = 0, point, before = 0;
    FUZZ_CHECK(points >= sweep_points_new(sweep));
    struct bcd_scene_cache *cache = NULL;
    FUZZ_CHECK(bcd_scene_cache_create(&cache) == BCD_OK);
    struct sweep_walk *walk = sweep_walk_create(sweep, 0, points);
    FUZZ_CHECK(walk);
    while (seen < POINTS && sweep_walk_next(walk, &point)) {
        struct bcd_scene *scene = NULL;
        struct bcd_errors errors = {0};
        FUZZ_CHECK(point < points && (seen == 0 || point > before));
        enum bcd_status status = sweep_walk_scene(walk, cache, &scene, &errors);
        FUZZ_CHECK((status == BCD_OK && scene) || (status == BCD_INVALID && errors.count > 0));
        check_place(sweep, walk);
        bcd_scene_free(scene);
        before = point;
        seen++;
    }
    FUZZ_CHECK(seen == POINTS || seen == sweep_points_new(sweep));
    sweep_walk_free(walk);
    bcd_scene_cache_free(cache);
}

/* What is kept of a sweep is that sweep. */
static void check_kept(const struct sweep *sweep)
{
    char *base = sweep_json_base(sweep), *axes = sweep_json_axes(sweep);
    char *zip = sweep_json_zip(sweep);
    FUZZ_CHECK(base && axes && zip);
    struct sweep *again = sweep_json_restore(base, axes, zip);
    FUZZ_CHECK(again && sweep_points(again) == sweep_points(sweep));
    char *axes_again = sweep_json_axes(again);
    FUZZ_CHECK(axes_again && strcmp(axes, axes_again) == 0);
    sweep_free(again);
    free(axes_again);
    free(base);
    free(axes);
    free(zip);
}

void fuzz_sweep(const uint8_t *data, size_t size)
{
    const uint8_t *end = memchr(data, 0, size);
    size_t first = end ? (size_t)(end - data) : size;
    struct sweep *sweep = NULL;
    struct ticket ticket = {.owner = "anna"};
    struct bcd_errors errors = {0};
    enum bcd_status status = sweep_json_parse((const char *)data, first, &sweep, &ticket, &errors);
    FUZZ_CHECK((status == BCD_OK && sweep) || (status == BCD_INVALID && errors.count > 0));
    if (!sweep)
        return;
    walk_through(sweep);
    check_kept(sweep);
    if (end) {
        size_t points = sweep_points(sweep);
        errors = (struct bcd_errors){0};
        status = sweep_json_extend(sweep, (const char *)end + 1, size - first - 1, &errors);
        FUZZ_CHECK(status == BCD_OK || (status == BCD_INVALID && errors.count > 0));
        if (status == BCD_OK) {
            FUZZ_CHECK(sweep_points(sweep) == points + sweep_points_new(sweep));
            walk_through(sweep);
            check_kept(sweep);
        }
    }
    ticket_fini(&ticket);
    sweep_free(sweep);
}
