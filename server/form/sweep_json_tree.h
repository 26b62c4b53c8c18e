/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_json_tree.h - what a struct sweep holds, for the sweep_*_json.c files alone.
 */
#ifndef SWEEP_JSON_TREE_H
#define SWEEP_JSON_TREE_H

#include "limits.h"
#include "scan_json.h"
#include "sweep_json.h"

struct json_t;

struct sweep_axis {
    char pointer[LIMIT_SWEEP_POINTER_BYTES_MAX + 1];
    struct json_t *values; /* a list */
    size_t group;
};

/* Axes that go through their values side by side; most are alone. */
struct sweep_group {
    size_t length, old; /* values; how many of them the sweep had before it was extended */
};

struct sweep {
    struct json_t *base, *zip;
    struct sweep_axis axes[SWEEP_AXES_MAX]; /* in the order given */
    struct sweep_group groups[SWEEP_AXES_MAX];
    size_t axis_count, group_count;
};

/* What a pointer leads to within a job: the object or list that holds it, and the key or index
 * there. */
struct sweep_slot {
    struct json_t *parent;
    char key[LIMIT_SWEEP_POINTER_BYTES_MAX + 1];
    size_t index; /* when parent is a list */
};

/* NULL, or why the pointer leads nowhere. The last key of an object need not be there. */
const char *sweep_slot_find(struct json_t *job, const char *pointer, struct sweep_slot *slot);

/* The values that an axis is given as, as a new list; NULL with faults at `pointer`. */
struct json_t *sweep_axis_read(struct json_t *value, const char *pointer,
                               struct bcd_errors *errors);

#endif
