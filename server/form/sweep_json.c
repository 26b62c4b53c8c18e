/* SPDX-License-Identifier: GPL-3.0-or-later
 * sweep_json.c - sweeps read, extended and printed; see sweep_json.h. */
#include "scene_json_tree.h"
#include "faults.h"
#include "heap_json.h"
#include "sweep_json_tree.h"
#include "ticket_json.h"

#include <jansson.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct sweep *create(void);
static void read_ticket(json_t *root, struct ticket *ticket, struct bcd_errors *errors);
static void read_members(json_t *root, struct sweep *sweep, struct bcd_errors *errors);
static void read_axes(json_t *axes, struct sweep *sweep, struct bcd_errors *errors);
static void add_axis(struct sweep *sweep, const char *pointer, json_t *value,
                     struct bcd_errors *errors);
enum seen { SEEN_FIRST, SEEN_BEFORE, SEEN_NO_MEMORY };

static void read_zip(json_t *zip, struct sweep *sweep, struct bcd_errors *errors);
static void form_groups(struct sweep *sweep, struct bcd_errors *errors);
static void check_points(const struct sweep *sweep, struct bcd_errors *errors);
static void check_twice(const struct sweep *sweep, size_t group, struct bcd_errors *errors);
static struct sweep_axis *find_axis(struct sweep *sweep, const char *pointer);
static enum seen remember(json_t *seen, const struct sweep *sweep, size_t group, size_t at);
static void extend_group(struct sweep *sweep, size_t group, json_t *const *more,
                         struct bcd_errors *errors);
static bool append_fresh(struct sweep *sweep, size_t group, json_t *seen, json_t *const *more,
                         size_t i);
static void axis_place(char place[SCAN_POINTER_SIZE], const char *pointer);
static void add_json(struct text *text, const json_t *value);

enum bcd_status sweep_json_parse(const char *text, size_t size, struct sweep **out,
                                 struct ticket *ticket, struct bcd_errors *errors)
{
    struct ticket read = *ticket;
    struct sweep *sweep = NULL;
    json_t *root = scene_json_load(text, size, "sweep", errors);
    if (!root)
        return faults_status(errors);
    enum bcd_status status = BCD_NO_MEMORY;
    sweep = create();
    if (!sweep)
        goto cleanup;
    read_ticket(root, &read, errors);
    read_members(root, sweep, errors);
    if (errors->count == 0)
        form_groups(sweep, errors);
    if (errors->count == 0)
        check_points(sweep, errors); /* before what takes time for each value */
    for (size_t g = 0; g < sweep->group_count && errors->count == 0; g++)
        check_twice(sweep, g, errors);
    status = faults_status(errors);
cleanup:
    json_decref(root);
    if (status == BCD_OK) {
        *out = sweep;
        *ticket = read;
    } else {
        sweep_free(sweep);
        ticket_fini(&read);
    }
    return status;
}

void sweep_free(struct sweep *sweep)
{
    if (!sweep)
        return;
    for (size_t i = 0; i < sweep->axis_count; i++)
        json_decref(sweep->axes[i].values);
    json_decref(sweep->base);
    json_decref(sweep->zip);
    free(sweep);
}

struct sweep *sweep_json_restore(const char *base, const char *axes, const char *zip)
{
    struct bcd_errors errors = {0};
    struct sweep *sweep = create();
    unsigned long failures = heap_json_failures();
    json_t *lists = json_loads(axes, 0, NULL), *pairs = json_loads(zip, 0, NULL);
    if (!sweep)
        goto cleanup;
    sweep->base = json_loads(base, 0, NULL);
    if (!sweep->base || !lists || !pairs || heap_json_failures() != failures)
        bcd_errors_add(&errors, "", "no sweep");
    read_axes(lists, sweep, &errors);
    read_zip(pairs, sweep, &errors);
    if (errors.count == 0)
        form_groups(sweep, &errors);
cleanup:
    json_decref(lists);
    json_decref(pairs);
    if (sweep && errors.count > 0) {
        sweep_free(sweep);
        sweep = NULL;
    }
    return sweep;
}

enum bcd_status sweep_json_extend(struct sweep *sweep, const char *text, size_t size,
                                  struct bcd_errors *errors)
{
    json_t *root = scene_json_load(text, size, "extension", errors);
    json_t *axes = json_object_get(root, "axes"), *more[SWEEP_AXES_MAX] = {NULL}, *value;
    const char *pointer;
    if (!root)
        return faults_status(errors);
    if (!json_is_object(axes) || json_object_size(axes) == 0 || json_object_size(root) > 1)
        bcd_errors_add(errors, "/axes",
                       "must be an object of more values for axes, and all there "
                       "is");
    json_object_foreach(axes, pointer, value)
    {
        char place[SCAN_POINTER_SIZE];
        struct sweep_axis *axis = find_axis(sweep, pointer);
        axis_place(place, pointer);
        if (!axis)
            bcd_errors_add(errors, place, "is no axis of this sweep");
        else
            more[axis - sweep->axes] = sweep_axis_read(value, place, errors);
    }
    for (size_t g = 0; g < sweep->group_count; g++)
        sweep->groups[g].old = sweep->groups[g].length;
    for (size_t g = 0; g < sweep->group_count && errors->count == 0; g++)
        extend_group(sweep, g, more, errors);
    if (errors->count == 0)
        check_points(sweep, errors);
    for (size_t a = 0; a < SWEEP_AXES_MAX; a++)
        json_decref(more[a]);
    json_decref(root);
    return faults_status(errors);
}

size_t sweep_points(const struct sweep *sweep)
{
    size_t points = 1;
    for (size_t g = 0; g < sweep->group_count; g++)
        points *= sweep->groups[g].length;
    return points;
}

size_t sweep_points_new(const struct sweep *sweep)
{
    size_t old = 1;
    for (size_t g = 0; g < sweep->group_count; g++)
        old *= sweep->groups[g].old;
    return sweep_points(sweep) - old;
}

const char *sweep_axis(const struct sweep *sweep, size_t index)
{
    return index < sweep->axis_count ? sweep->axes[index].pointer : NULL;
}

size_t sweep_axis_group(const struct sweep *sweep, size_t index)
{
    return sweep->axes[index].group;
}

bool sweep_measures(const struct sweep *sweep, const char *observable)
{
    const char *slot = bcd_slot_key(BCD_SLOT_OBSERVABLE);
    for (size_t a = 0; a < sweep->axis_count; a++)
        if (strncmp(sweep->axes[a].pointer + 1, slot, strlen(slot)) == 0)
            return true; /* it may */
    return json_object_get(json_object_get(sweep->base, slot), observable) != NULL;
}

bool sweep_add_value(struct text *text, const struct sweep *sweep, size_t axis, size_t at)
{
    const json_t *value = json_array_get(sweep->axes[axis].values, at);
    if (value)
        add_json(text, value);
    return value != NULL;
}

double sweep_number(const struct sweep *sweep, size_t axis, size_t at, bool *whole)
{
    const json_t *value = json_array_get(sweep->axes[axis].values, at);
    if (whole)
        *whole = json_is_integer(value);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

bool sweep_place_parse(const struct sweep *sweep, const char *place, size_t at[SWEEP_AXES_MAX])
{
    const char *c = place;
    for (size_t g = 0; g < sweep->group_count; g++) {
        char *end;
        if (*c != (g ? ',' : '[') || c[1] < '0' || c[1] > '9')
            return false;
        at[g] = strtoul(c + 1, &end, 10);
        if (at[g] >= sweep->groups[g].length)
            return false;
        c = end;
    }
    return strcmp(c, "]") == 0;
}

/* ----------------------------------------------------------------- printing */

char *sweep_json_base(const struct sweep *sweep)
{
    struct text text = {0};
    add_json(&text, sweep->base);
    return text_take(&text);
}

char *sweep_json_axes(const struct sweep *sweep)
{
    struct text text = {0};
    text_add(&text, "{");
    for (size_t a = 0; a < sweep->axis_count; a++) {
        text_add(&text, a ? "," : "");
        text_add_json_string(&text, sweep->axes[a].pointer);
        text_add(&text, ":[");
        for (size_t i = 0; i < json_array_size(sweep->axes[a].values); i++) {
            text_add(&text, i ? "," : "");
            sweep_add_value(&text, sweep, a, i);
        }
        text_add(&text, "]");
    }
    text_add(&text, "}");
    return text_take(&text);
}

char *sweep_json_zip(const struct sweep *sweep)
{
    struct text text = {0};
    add_json(&text, sweep->zip);
    return text_take(&text);
}

/* Numbers in their shortest form; within lists and objects with all digits. */
static void add_json(struct text *text, const json_t *value)
{
    if (json_is_real(value)) {
        text_add_number(text, json_real_value(value));
        return;
    }
    char *dump = json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY);
    if (dump)
        text_add(text, "%s", dump);
    text->failed = text->failed || !dump;
    free(dump);
}

/* ------------------------------------------------------------------ reading */

static struct sweep *create(void)
{
    return calloc(1, sizeof(struct sweep));
}

/* What hangs on the base job hangs on all of them, unless the sweep says something else. */
static void read_ticket(json_t *root, struct ticket *ticket, struct bcd_errors *errors)
{
    struct ticket base = {0};
    json_t *priority = json_incref(json_object_get(root, "priority"));
    ticket_json_take(root, ticket, errors);
    if (json_is_object(json_object_get(root, "base")))
        ticket_json_take(json_object_get(root, "base"), &base, errors);
    if (!ticket->label) {
        ticket->label = base.label;
        base.label = NULL;
    }
    if (!ticket->tags) {
        ticket->tags = base.tags;
        base.tags = NULL;
    }
    if (!priority || json_is_null(priority))
        ticket->priority = base.priority;
    json_decref(priority);
    ticket_fini(&base);
}

static void read_members(json_t *root, struct sweep *sweep, struct bcd_errors *errors)
{
    const char *key;
    json_t *value, *zip = json_object_get(root, "zip");
    json_object_foreach(root, key, value)
    {
        char place[SCAN_POINTER_SIZE] = "";
        scan_json_append(place, key);
        if (strcmp(key, "base") != 0 && strcmp(key, "axes") != 0 && strcmp(key, "zip") != 0)
            bcd_errors_add(errors, place,
                           "unknown key; known are base, axes, zip, label, tags, priority");
    }
    sweep->base = json_incref(json_object_get(root, "base"));
    if (!json_is_object(sweep->base)) {
        bcd_errors_add(errors, "/base", "is required: the job that the axes vary");
        return;
    }
    read_axes(json_object_get(root, "axes"), sweep, errors);
    read_zip(zip && !json_is_null(zip) ? zip : NULL, sweep, errors);
}

static void read_axes(json_t *axes, struct sweep *sweep, struct bcd_errors *errors)
{
    const char *pointer;
    json_t *value;
    size_t count = json_object_size(axes);
    if (count == 0 || count > SWEEP_AXES_MAX) {
        bcd_errors_add(errors, "/axes", "must be an object of 1 to %d axes: {\"/diameter\": [..]}",
                       SWEEP_AXES_MAX);
        return;
    }
    json_object_foreach(axes, pointer, value) add_axis(sweep, pointer, value, errors);
    for (size_t a = 0; a < sweep->axis_count; a++)
        for (size_t b = 0; b < sweep->axis_count; b++) {
            size_t length = strlen(sweep->axes[a].pointer);
            char place[SCAN_POINTER_SIZE];
            axis_place(place, sweep->axes[b].pointer);
            if (strncmp(sweep->axes[a].pointer, sweep->axes[b].pointer, length) == 0 &&
                sweep->axes[b].pointer[length] == '/')
                bcd_errors_add(errors, place, "lies within what the axis %s sets",
                               sweep->axes[a].pointer);
        }
}

static void add_axis(struct sweep *sweep, const char *pointer, json_t *value,
                     struct bcd_errors *errors)
{
    char place[SCAN_POINTER_SIZE];
    struct sweep_slot slot;
    axis_place(place, pointer);
    if (strlen(pointer) > LIMIT_SWEEP_POINTER_BYTES_MAX) {
        bcd_errors_add(errors, place, "is longer than %d bytes", LIMIT_SWEEP_POINTER_BYTES_MAX);
        return;
    }
    const char *nowhere = sweep_slot_find(sweep->base, pointer, &slot);
    if (nowhere)
        bcd_errors_add(errors, place, "%s", nowhere);
    json_t *values = sweep_axis_read(value, place, errors);
    if (!values || nowhere) {
        json_decref(values);
        return;
    }
    struct sweep_axis *axis = &sweep->axes[sweep->axis_count++];
    snprintf(axis->pointer, sizeof(axis->pointer), "%s", pointer);
    axis->values = values;
    axis->group = SIZE_MAX;
}

/* Lists of lists of pointers; each axis in one of them at most. */
static void read_zip(json_t *zip, struct sweep *sweep, struct bcd_errors *errors)
{
    sweep->zip = zip ? json_incref(zip) : json_array();
    bool lists = json_is_array(sweep->zip);
    for (size_t i = 0; lists && i < json_array_size(sweep->zip); i++) {
        json_t *list = json_array_get(sweep->zip, i);
        lists = json_array_size(list) >= 2;
        for (size_t j = 0; j < json_array_size(list); j++) {
            const char *pointer = json_string_value(json_array_get(list, j));
            struct sweep_axis *axis = pointer ? find_axis(sweep, pointer) : NULL;
            char place[SCAN_POINTER_SIZE];
            snprintf(place, sizeof(place), "/zip/%zu/%zu", i, j);
            if (!axis)
                bcd_errors_add(errors, place, "must be the pointer of an axis");
            else if (axis->group != SIZE_MAX)
                bcd_errors_add(errors, place, "%s is named twice", pointer);
            else
                axis->group = i; /* for the time being: of which list */
        }
    }
    if (!sweep->zip)
        faults_no_memory(errors, "/zip");
    else if (!lists)
        bcd_errors_add(errors, "/zip",
                       "must be a list of lists of two or more axes: "
                       "[[\"/diameter\",\"/length\"]]");
}

/* Groups in the order of their first axes. */
static void form_groups(struct sweep *sweep, struct bcd_errors *errors)
{
    size_t list[SWEEP_AXES_MAX];
    for (size_t a = 0; a < sweep->axis_count; a++)
        list[a] = sweep->axes[a].group;
    for (size_t a = 0; a < sweep->axis_count; a++) {
        struct sweep_axis *axis = &sweep->axes[a];
        size_t length = json_array_size(axis->values), first = a;
        for (size_t b = 0; b < a && list[a] != SIZE_MAX; b++)
            if (list[b] == list[a] && first == a)
                first = b;
        axis->group = first < a ? sweep->axes[first].group : sweep->group_count++;
        if (first == a)
            sweep->groups[axis->group].length = length;
        else if (sweep->groups[axis->group].length != length)
            bcd_errors_add(errors, "/zip", "%s has %zu values and %s %zu: they cannot go together",
                           sweep->axes[first].pointer, sweep->groups[axis->group].length,
                           axis->pointer, length);
    }
}

static void check_points(const struct sweep *sweep, struct bcd_errors *errors)
{
    double points = 1;
    for (size_t g = 0; g < sweep->group_count; g++)
        points *= (double)sweep->groups[g].length;
    if (points > LIMIT_SWEEP_POINTS_MAX)
        bcd_errors_add(errors, "/axes", "make %.0f points; LIMIT_SWEEP_POINTS_MAX is %d", points,
                       LIMIT_SWEEP_POINTS_MAX);
}

/* The same values twice would be the same jobs twice: a slip. */
static void check_twice(const struct sweep *sweep, size_t group, struct bcd_errors *errors)
{
    json_t *seen = json_object();
    size_t axis = 0;
    while (sweep->axes[axis].group != group)
        axis++;
    for (size_t i = 0; i < sweep->groups[group].length; i++) {
        char place[SCAN_POINTER_SIZE], index[24];
        enum seen before = remember(seen, sweep, group, i);
        if (before == SEEN_FIRST)
            continue;
        if (before == SEEN_NO_MEMORY) {
            faults_no_memory(errors, "/axes");
            break;
        }
        axis_place(place, sweep->axes[axis].pointer);
        snprintf(index, sizeof(index), "%zu", i);
        scan_json_append(place, index);
        bcd_errors_add(errors, place, "is there before");
    }
    json_decref(seen);
}

static struct sweep_axis *find_axis(struct sweep *sweep, const char *pointer)
{
    for (size_t a = 0; a < sweep->axis_count; a++)
        if (strcmp(sweep->axes[a].pointer, pointer) == 0)
            return &sweep->axes[a];
    return NULL;
}

/* Adds the values that a group has at an index to a set. */
static enum seen remember(json_t *seen, const struct sweep *sweep, size_t group, size_t at)
{
    struct text text = {0};
    for (size_t a = 0; a < sweep->axis_count; a++)
        if (sweep->axes[a].group == group) {
            sweep_add_value(&text, sweep, a, at);
            text_add(&text, "\n");
        }
    char *key = text_take(&text);
    enum seen before = SEEN_NO_MEMORY;
    if (key && json_object_get(seen, key))
        before = SEEN_BEFORE;
    else if (key && json_object_set_new(seen, key, json_true()) == 0)
        before = SEEN_FIRST;
    free(key);
    return before;
}

/* All axes of a group get as many values, or none does; those that it has already go again. */
static void extend_group(struct sweep *sweep, size_t group, json_t *const *more,
                         struct bcd_errors *errors)
{
    size_t length = 0, given = 0, members = 0;
    for (size_t a = 0; a < sweep->axis_count; a++) {
        if (sweep->axes[a].group != group)
            continue;
        members++;
        given += more[a] != NULL;
        length = more[a] ? json_array_size(more[a]) : length;
    }
    if (given == 0)
        return;
    bool fits = given == members;
    for (size_t a = 0; a < sweep->axis_count; a++)
        fits = fits && (sweep->axes[a].group != group || json_array_size(more[a]) == length);
    if (!fits) {
        bcd_errors_add(errors, "/axes", "axes that go together (zip) must get as many values each");
        return;
    }
    json_t *seen = json_object();
    bool sound = seen != NULL;
    for (size_t i = 0; sound && i < sweep->groups[group].length; i++)
        sound = remember(seen, sweep, group, i) != SEEN_NO_MEMORY;
    for (size_t i = 0; sound && i < length; i++)
        sound = append_fresh(sweep, group, seen, more, i);
    if (!sound)
        faults_no_memory(errors, "/axes");
    json_decref(seen);
}

/* The i-th of more values for the axes of a group, unless it has them; false = no memory, and the
 * sweep is good for nothing any more. */
static bool append_fresh(struct sweep *sweep, size_t group, json_t *seen, json_t *const *more,
                         size_t i)
{
    bool sound = true;
    for (size_t a = 0; a < sweep->axis_count; a++)
        if (sweep->axes[a].group == group)
            sound &= json_array_append(sweep->axes[a].values, json_array_get(more[a], i)) == 0;
    enum seen before =
        sound ? remember(seen, sweep, group, sweep->groups[group].length) : SEEN_NO_MEMORY;
    if (before == SEEN_FIRST)
        sweep->groups[group].length++;
    for (size_t a = 0; a < sweep->axis_count && before == SEEN_BEFORE; a++)
        if (sweep->axes[a].group == group)
            json_array_remove(sweep->axes[a].values, sweep->groups[group].length);
    return before != SEEN_NO_MEMORY;
}

static void axis_place(char place[SCAN_POINTER_SIZE], const char *pointer)
{
    snprintf(place, SCAN_POINTER_SIZE, "/axes");
    scan_json_append(place, pointer);
}
