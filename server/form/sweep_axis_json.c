/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_axis_json.c - one axis: where in a job its pointer leads, and its values, given in full or
 * as a range.
 */
#include "sweep_json_tree.h"
#include "faults.h"

#include <jansson.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static json_t *read_range(json_t *range, const char *pointer, struct bcd_errors *errors);
static json_t *read_integers(json_t *range, const char *pointer, struct bcd_errors *errors);
static bool check_members(json_t *object, const char *const *known, const char *pointer,
                          struct bcd_errors *errors);
static bool read_number(json_t *object, const char *key, double *value, const char *pointer,
                        struct bcd_errors *errors);
static bool read_count(json_t *object, const char *key, const char *pointer, size_t *count,
                       struct bcd_errors *errors);
static double spread(double from, double to, double share, bool logarithmic);
static void fault(struct bcd_errors *errors, const char *pointer, const char *key,
                  const char *detail);

const char *sweep_slot_find(json_t *job, const char *pointer, struct sweep_slot *slot)
{
    *slot = (struct sweep_slot){.parent = job};
    if (pointer[0] != '/' || pointer[1] == '\0')
        return "must be a JSON pointer such as /potential/amplitude";
    for (const char *c = pointer; *c;) {
        size_t length = 0;
        for (c++; *c && *c != '/'; c++) {
            bool escaped = c[0] == '~' && (c[1] == '0' || c[1] == '1');
            slot->key[length++] = escaped ? (c[1] == '0' ? '~' : '/') : *c;
            c += escaped;
        }
        slot->key[length] = '\0';
        if (json_is_array(slot->parent)) {
            slot->index = strtoul(slot->key, NULL, 10);
            if (length == 0 || length > 6 || strspn(slot->key, "0123456789") != length ||
                (length > 1 && slot->key[0] == '0') || /* a second name for the same */
                slot->index >= json_array_size(slot->parent))
                return "leads to no element of that list";
        } else if (!json_is_object(slot->parent)) {
            return "leads into what is no object of the base job";
        }
        if (*c)
            slot->parent = json_is_array(slot->parent) ? json_array_get(slot->parent, slot->index)
                                                       : json_object_get(slot->parent, slot->key);
    }
    return NULL;
}

json_t *sweep_axis_read(json_t *value, const char *pointer, struct bcd_errors *errors)
{
    if (json_is_object(value))
        return json_object_get(value, "first") ? read_integers(value, pointer, errors)
                                               : read_range(value, pointer, errors);
    if (!json_is_array(value) || json_array_size(value) == 0) {
        bcd_errors_add(errors, pointer,
                       "must be a list of values, {\"from\",\"to\",\"points\",\"scale\"}, or "
                       "{\"first\",\"count\"} for whole numbers");
        return NULL;
    }
    if (json_array_size(value) > LIMIT_SWEEP_POINTS_MAX) {
        bcd_errors_add(errors, pointer, "has %zu values; LIMIT_SWEEP_POINTS_MAX is %d",
                       json_array_size(value), LIMIT_SWEEP_POINTS_MAX);
        return NULL;
    }
    return json_incref(value);
}

static json_t *read_range(json_t *range, const char *pointer, struct bcd_errors *errors)
{
    static const char *const known[] = {"from", "to", "points", "scale", NULL};
    json_t *scale = json_object_get(range, "scale");
    const char *word = scale ? json_string_value(scale) : "linear";
    bool logarithmic = word && strcmp(word, "log") == 0;
    double from = 0, to = 0;
    size_t points = 0, before = errors->count + errors->dropped;
    check_members(range, known, pointer, errors);
    read_number(range, "from", &from, pointer, errors);
    read_number(range, "to", &to, pointer, errors);
    read_count(range, "points", pointer, &points, errors);
    if (!word || (!logarithmic && strcmp(word, "linear") != 0))
        fault(errors, pointer, "scale", "must be \"linear\" or \"log\"");
    if (errors->count + errors->dropped > before)
        return NULL;
    if (logarithmic && !(from > 0 && to > 0))
        fault(errors, pointer, from > 0 ? "to" : "from",
              "must be above 0 on a scale of logarithms");
    else if (points < 2 || from == to)
        fault(errors, pointer, points < 2 ? "points" : "to",
              points < 2 ? "must be at least 2" : "must differ from \"from\"");
    if (errors->count + errors->dropped > before)
        return NULL;
    json_t *list = json_array();
    for (size_t i = 0; i < points; i++) {
        double v = i == 0 ? from
                   : i == points - 1
                       ? to
                       : spread(from, to, (double)i / (double)(points - 1), logarithmic);
        /* Whole numbers as such: rows that want integers take them too. */
        bool whole = v == rint(v) && fabs(v) < 1e15;
        json_array_append_new(list, whole ? json_integer((json_int_t)v) : json_real(v));
    }
    if (json_array_size(list) == points)
        return list;
    json_decref(list);
    if (isfinite(to - from)) /* else what lies between is none that JSON could hold */
        faults_no_memory(errors, pointer);
    else
        fault(errors, pointer, "points", "has numbers beyond the largest double");
    return NULL;
}

static json_t *read_integers(json_t *range, const char *pointer, struct bcd_errors *errors)
{
    static const char *const known[] = {"first", "count", NULL};
    json_t *first = json_object_get(range, "first");
    size_t count = 0;
    bool sound = check_members(range, known, pointer, errors);
    if (!json_is_integer(first) || llabs(json_integer_value(first)) > 1LL << 53) {
        fault(errors, pointer, "first", "must be an integer, within 2^53");
        sound = false;
    }
    if (!read_count(range, "count", pointer, &count, errors) || !sound)
        return NULL;
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(list, json_integer(json_integer_value(first) + (json_int_t)i));
    if (json_array_size(list) == count)
        return list;
    json_decref(list);
    faults_no_memory(errors, pointer);
    return NULL;
}

static bool check_members(json_t *object, const char *const *known, const char *pointer,
                          struct bcd_errors *errors)
{
    bool sound = true;
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value)
    {
        size_t i = 0;
        while (known[i] && strcmp(known[i], key) != 0)
            i++;
        if (!known[i])
            fault(errors, pointer, key, "unknown key of a range");
        sound = sound && known[i];
    }
    return sound;
}

static bool read_number(json_t *object, const char *key, double *value, const char *pointer,
                        struct bcd_errors *errors)
{
    json_t *number = json_object_get(object, key);
    if (!json_is_number(number)) {
        fault(errors, pointer, key, "must be a number");
        return false;
    }
    *value = json_number_value(number);
    return true;
}

static bool read_count(json_t *object, const char *key, const char *pointer, size_t *count,
                       struct bcd_errors *errors)
{
    char detail[80];
    json_int_t value = json_integer_value(json_object_get(object, key)); /* 0 of what is none */
    if (value >= 1 && value <= LIMIT_SWEEP_POINTS_MAX) {
        *count = (size_t)value;
        return true;
    }
    snprintf(detail, sizeof(detail), "must be an integer from 1 to %d (LIMIT_SWEEP_POINTS_MAX)",
             LIMIT_SWEEP_POINTS_MAX);
    fault(errors, pointer, key, detail);
    return false;
}

/* A value between the ends. Where a number of 12 digits is as near as rounding lets us tell, that
 * was meant: 0.3, not 0.30000000000000004. */
static double spread(double from, double to, double share, bool logarithmic)
{
    double v =
        logarithmic ? exp(log(from) + (log(to) - log(from)) * share) : from + (to - from) * share;
    double size = logarithmic ? fabs(v) * (1 + fabs(log(v))) : fmax(fabs(from), fabs(to));
    double slack = 4 * DBL_EPSILON * size;
    char digits[32];
    snprintf(digits, sizeof(digits), "%.12g", v);
    double round = strtod(digits, NULL);
    if (fabs(v) <= slack)
        return 0;
    return fabs(round - v) <= slack ? round : v;
}

static void fault(struct bcd_errors *errors, const char *pointer, const char *key,
                  const char *detail)
{
    char place[SCAN_POINTER_SIZE];
    snprintf(place, sizeof(place), "%s", pointer);
    scan_json_append(place, key);
    bcd_errors_add(errors, place, "%s", detail);
}
