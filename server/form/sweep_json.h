/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_json.h - sweeps as JSON: a base job and axes, each a JSON pointer into the job and the
 * values that stand there in turn.
 *
 *   {"base": JOB, "axes": {"/diameter": [0.1, 0.2], "/seed": {"first": 1, "count": 10}}, "zip":
 * [..]}
 *
 * Values are any JSON; a list in full, {"from","to","points","scale": "linear" or "log"}, or
 * {"first","count"} for whole numbers. Axes named together in `zip` go through their values side by
 * side, as one. The points are all combinations, the last axis fastest. What a point is at (its
 * place) is one index for each axis or group of them, in the axes' order.
 */
#ifndef SWEEP_JSON_H
#define SWEEP_JSON_H

#include "bcd.h"
#include "text.h"
#include "ticket.h"

enum { SWEEP_AXES_MAX = 8 };

struct sweep; /* read-only once made, but for sweep_json_extend */

/* Reads a sweep; owner and all faults as in scene_json_parse_ticket. The points are not looked at:
 * that is sweep_walk_scene. */
enum bcd_status sweep_json_parse(const char *text, size_t size, struct sweep **sweep,
                                 struct ticket *ticket, struct bcd_errors *errors);
void sweep_free(struct sweep *sweep);

/* A sweep from what the functions below printed; NULL = no memory, or not what they print. */
struct sweep *sweep_json_restore(const char *base, const char *axes, const char *zip);
char *sweep_json_base(const struct sweep *sweep);
char *sweep_json_axes(const struct sweep *sweep);
char *sweep_json_zip(const struct sweep *sweep);

/* Appends the values of {"axes": {POINTER: values, ..}} to axes that the sweep has. Values that an
 * axis holds already are passed over. Afterwards the new points are those with a new value. */
enum bcd_status sweep_json_extend(struct sweep *sweep, const char *text, size_t size,
                                  struct bcd_errors *errors);

/* Points in all, and those that are new: all of them, or those of the extension. */
size_t sweep_points(const struct sweep *sweep);
size_t sweep_points_new(const struct sweep *sweep);

/* The axes: pointer of the index-th, NULL past the last; to which index of a place it belongs. */
const char *sweep_axis(const struct sweep *sweep, size_t index);
size_t sweep_axis_group(const struct sweep *sweep, size_t index);

/* Does any job of it measure this observable? */
bool sweep_measures(const struct sweep *sweep, const char *observable);

/* The value of an axis at a place, as JSON; false when there is no such value. As a number, NaN
 * when it is none; *whole (may be NULL) tells whether it is an integer. */
bool sweep_add_value(struct text *text, const struct sweep *sweep, size_t axis, size_t at);
double sweep_number(const struct sweep *sweep, size_t axis, size_t at, bool *whole);

/* Reads a place as it was printed: one index for each group, at[SWEEP_AXES_MAX]; false when it is
 * none of this sweep's. */
bool sweep_place_parse(const struct sweep *sweep, const char *place, size_t at[SWEEP_AXES_MAX]);

/* A walk over the new ones among the points first .. end-1. Borrows the sweep; walks of one sweep
 * may go on in several threads. NULL = no memory. */
struct sweep_walk *sweep_walk_create(const struct sweep *sweep, size_t first, size_t end);
void sweep_walk_free(struct sweep_walk *walk);

/* To other points of the same sweep, whose first is the next. */
void sweep_walk_move(struct sweep_walk *walk, size_t first, size_t end);

/* To the next point; false after the last. *point: its number among all. */
bool sweep_walk_next(struct sweep_walk *walk, size_t *point);

/* The scene there, completed; faults as for a job. */
enum bcd_status sweep_walk_scene(struct sweep_walk *walk, struct bcd_scene_cache *cache,
                                 struct bcd_scene **scene, struct bcd_errors *errors);

/* Do points differ in the seed alone from the ones before them, again and again? Does this one, and
 * what is its seed: false also where it is no integer. */
bool sweep_walk_seeds(const struct sweep_walk *walk);
bool sweep_walk_seed(const struct sweep_walk *walk, int64_t *seed);

/* Its place as JSON, "[0,3]"; its values for people, "/diameter = 0.2, /seed = 3". */
void sweep_walk_add_place(const struct sweep_walk *walk, struct text *text);
void sweep_walk_add_values(const struct sweep_walk *walk, struct text *text);

#endif
