/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "scene_json.h"
#include "faults.h"
#include "heap_json.h"
#include "limits.h"
#include "nearest.h"
#include "scan_json.h"
#include "scene_json_tree.h"
#include "text.h"
#include "ticket_json.h"

#include <jansson.h>

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Whole numbers up to here are exact, however they were written. */
#define WHOLE_MAX 9007199254740992.0

static enum bcd_status read_text(const char *text, size_t size, struct bcd_scene_cache *cache,
                                 struct bcd_scene **out, struct ticket *ticket,
                                 struct bcd_errors *errors);
static void explain(const char *text, const json_error_t *error, struct bcd_errors *errors);
static void read_job(json_t *object, struct bcd_scene *scene, struct bcd_errors *errors);
static void read_slot(json_t *value, struct bcd_scene *scene, enum bcd_slot slot,
                      struct bcd_errors *errors);
static void read_group(json_t *object, struct bcd_group *group, const char *skip,
                       struct bcd_errors *errors);
static void read_value(json_t *value, struct bcd_group *group, const struct bcd_param *row,
                       struct bcd_errors *errors);
static void fault_unknown(const struct bcd_group *group, const char *key,
                          struct bcd_errors *errors);
static void fault_no_part(enum bcd_slot slot, const char *pointer, const char *name,
                          struct bcd_errors *errors);
static const char *type_name(const json_t *value);
static void add_group(struct text *text, const struct bcd_group *group);

enum bcd_status scene_json_parse(const char *text, size_t size, struct bcd_scene **out,
                                 struct bcd_errors *errors)
{
    struct ticket ticket = {0};
    enum bcd_status status = scene_json_parse_ticket(text, size, out, &ticket, errors);
    ticket_fini(&ticket);
    return status;
}

enum bcd_status scene_json_parse_ticket(const char *text, size_t size, struct bcd_scene **out,
                                        struct ticket *ticket, struct bcd_errors *errors)
{
    struct bcd_scene *scene = NULL;
    struct ticket read = *ticket;
    enum bcd_status status = scene_json_complete_ticket(text, size, &scene, &read, errors);
    if (status != BCD_OK)
        return status;
    status = bcd_scene_prepare(scene, NULL, errors);
    if (status == BCD_OK) {
        *out = scene;
        *ticket = read;
    } else {
        bcd_scene_free(scene);
        ticket_fini(&read);
    }
    return status;
}

enum bcd_status scene_json_complete_ticket(const char *text, size_t size, struct bcd_scene **out,
                                           struct ticket *ticket, struct bcd_errors *errors)
{
    struct bcd_errors own = {0};
    struct ticket read = *ticket;
    enum bcd_status status = read_text(text, size, NULL, out, &read, errors ? errors : &own);
    if (status == BCD_OK)
        *ticket = read;
    else
        ticket_fini(&read);
    return status;
}

enum bcd_status scene_json_complete(const char *text, size_t size, struct bcd_scene_cache *cache,
                                    struct bcd_scene **out, struct bcd_errors *errors)
{
    struct bcd_errors own = {0};
    struct ticket ticket = {0};
    enum bcd_status status = read_text(text, size, cache, out, &ticket, errors ? errors : &own);
    ticket_fini(&ticket);
    return status;
}

enum bcd_status scene_json_read(json_t *object, struct bcd_scene_cache *cache,
                                struct bcd_scene **out, struct bcd_errors *errors)
{
    struct bcd_scene *scene = NULL;
    enum bcd_status status = bcd_scene_create(&scene);
    if (status != BCD_OK)
        return status;
    read_job(object, scene, errors);
    status = bcd_scene_complete(scene, cache, errors);
    if (status == BCD_OK)
        *out = scene;
    else
        bcd_scene_free(scene);
    return status;
}

/* The ticket may hold something of it also when the text is refused. */
static enum bcd_status read_text(const char *text, size_t size, struct bcd_scene_cache *cache,
                                 struct bcd_scene **out, struct ticket *ticket,
                                 struct bcd_errors *errors)
{
    json_t *job = scene_json_load(text, size, "job", errors);
    if (!job)
        return faults_status(errors);
    ticket_json_take(job, ticket, errors);
    enum bcd_status status = scene_json_read(job, cache, out, errors);
    json_decref(job);
    return status;
}

char *scene_json_job(const struct bcd_scene *scene)
{
    struct text text = {0};
    text_add(&text, "{");
    add_group(&text, bcd_scene_job_view(scene));
    for (int s = 0; s < BCD_SLOT_COUNT; s++) {
        const struct bcd_group *part = bcd_scene_part(scene, s, 0);
        bool many = bcd_slot_many(s);
        text_add(&text, ",");
        text_add_json_string(&text, bcd_slot_key(s));
        text_add(&text, many || part ? ":{" : ":null");
        if (!many && part) {
            if (bcd_slot_typed(s))
                text_add(&text, "\"type\":\"%s\"%s", part->type, part->rows->name ? "," : "");
            add_group(&text, part);
        }
        for (size_t i = 0; many && (part = bcd_scene_part(scene, s, i)) != NULL; i++) {
            text_add(&text, i ? "," : "");
            text_add_json_string(&text, part->type);
            text_add(&text, ":{");
            add_group(&text, part);
            text_add(&text, "}");
        }
        text_add(&text, many || part ? "}" : "");
    }
    text_add(&text, "}");
    return text_take(&text);
}

char *scene_json_derived(const struct bcd_scene *scene)
{
    struct text text = {0};
    const struct bcd_fact *fact;
    text_add(&text, "{");
    for (size_t i = 0; (fact = bcd_scene_fact(scene, i)) != NULL; i++) {
        text_add(&text, i ? "," : "");
        text_add_json_string(&text, fact->name);
        text_add(&text, ":");
        if (fact->kind == BCD_FACT_NUMBER)
            text_add_number(&text, fact->number);
        else if (fact->kind == BCD_FACT_INTEGER)
            text_add(&text, "%" PRId64, fact->integer);
        else
            text_add_json_string(&text, fact->text);
    }
    text_add(&text, "}");
    return text_take(&text);
}

/* ----------------------------------------------------------------- reading */

/* The text as a JSON object, or NULL with at least one fault. */
json_t *scene_json_load(const char *text, size_t size, const char *what, struct bcd_errors *errors)
{
    json_error_t error;
    json_t *job = NULL;
    if (size > LIMIT_BODY_BYTES_MAX) {
        bcd_errors_add(errors, "", "is larger than %d bytes", LIMIT_BODY_BYTES_MAX);
        return NULL;
    }
    char *copy = malloc(size + 1); /* with a NUL at its end, and none before */
    if (!copy) {
        faults_no_memory(errors, "");
        return NULL;
    }
    memcpy(copy, text, size);
    copy[size] = '\0';
    if (scan_json_depth(copy) > LIMIT_JSON_DEPTH_MAX) {
        bcd_errors_add(errors, "", "is nested deeper than %d levels", LIMIT_JSON_DEPTH_MAX);
        goto cleanup;
    }
    unsigned long failures = heap_json_failures();
    job = json_loadb(copy, size, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error);
    if (heap_json_failures() != failures) { /* whatever it says, and whatever it has read */
        json_decref(job);
        job = NULL;
        faults_no_memory(errors, "");
        goto cleanup;
    }
    if (!job) {
        explain(copy, &error, errors);
        goto cleanup;
    }
    if (!json_is_object(job)) {
        bcd_errors_add(errors, "", "a %s is a JSON object, not %s", what, type_name(job));
        json_decref(job);
        job = NULL;
        goto cleanup;
    }
    scan_json_numbers(copy, size, errors);
cleanup:
    free(copy);
    return job;
}

/* Why the text could not be read. The parser stops at its first fault; where that is a matter of
 * one value, the pointer to it is found again in the text. */
static void explain(const char *text, const json_error_t *error, struct bcd_errors *errors)
{
    char pointer[SCAN_POINTER_SIZE] = "";
    size_t position = error->position > 0 ? (size_t)error->position : 0;
    if (json_error_code(error) == json_error_duplicate_key) {
        scan_json_key(text, position, pointer);
        bcd_errors_add(errors, pointer, "is given more than once (line %d, column %d)", error->line,
                       error->column);
    } else if (json_error_code(error) == json_error_null_character ||
               json_error_code(error) == json_error_null_byte_in_key) {
        bcd_errors_add(errors, "", "holds \\u0000 (line %d, column %d), which nothing here may",
                       error->line, error->column);
    } else if (scan_json_numbers(text, position, errors) == 0) {
        bcd_errors_add(errors, "", "is not JSON: line %d, column %d: %s", error->line,
                       error->column, error->text);
        errors->items[errors->count - 1].code = BCD_CORRUPT;
        if (errors->count == 1) /* no faulty job, but no JSON at all */
            errors->items[0].code = BCD_CORRUPT;
    }
}

static void read_job(json_t *object, struct bcd_scene *scene, struct bcd_errors *errors)
{
    struct bcd_group *group = bcd_scene_job(scene);
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value)
    {
        const struct bcd_param *row = bcd_group_find(group, key);
        int slot = 0;
        while (slot < BCD_SLOT_COUNT && strcmp(bcd_slot_key(slot), key) != 0)
            slot++;
        if (row)
            read_value(value, group, row, errors);
        else if (slot < BCD_SLOT_COUNT)
            read_slot(value, scene, slot, errors);
        else
            fault_unknown(group, key, errors);
    }
}

static bool has_part(enum bcd_slot slot, const char *name)
{
    size_t i = 0;
    while (bcd_catalogue(slot, i) && strcmp(bcd_catalogue(slot, i)->name, name) != 0)
        i++;
    return bcd_catalogue(slot, i) != NULL;
}

/* Adds a part of the given type, or the only one, with what the object says of it. */
static void read_part(json_t *object, struct bcd_scene *scene, enum bcd_slot slot,
                      struct bcd_errors *errors)
{
    char pointer[SCAN_POINTER_SIZE] = "";
    json_t *type = json_object_get(object, "type");
    if (!bcd_slot_typed(slot)) {
        struct bcd_group *only = bcd_scene_add(scene, slot, bcd_catalogue(slot, 0)->name, errors);
        if (only)
            read_group(object, only, "", errors);
        return;
    }
    scan_json_append(pointer, bcd_slot_key(slot));
    scan_json_append(pointer, "type");
    if (!json_is_string(type) || !has_part(slot, json_string_value(type))) {
        fault_no_part(slot, pointer, json_is_string(type) ? json_string_value(type) : NULL, errors);
        return;
    }
    struct bcd_group *group = bcd_scene_add(scene, slot, json_string_value(type), errors);
    if (group)
        read_group(object, group, "type", errors);
}

static void read_slot(json_t *value, struct bcd_scene *scene, enum bcd_slot slot,
                      struct bcd_errors *errors)
{
    char pointer[SCAN_POINTER_SIZE] = "";
    const char *key;
    json_t *part;
    scan_json_append(pointer, bcd_slot_key(slot));
    if (json_is_null(value)) /* the same as leaving it out */
        return;
    if (!json_is_object(value)) {
        bcd_errors_add(errors, pointer, "must be an object, not %s", type_name(value));
        return;
    }
    if (!bcd_slot_many(slot)) {
        read_part(value, scene, slot, errors);
        return;
    }
    json_object_foreach(value, key, part)
    {
        char place[SCAN_POINTER_SIZE];
        memcpy(place, pointer, sizeof place);
        scan_json_append(place, key);
        struct bcd_group *group = NULL;
        if (!has_part(slot, key))
            fault_no_part(slot, place, key, errors);
        else
            group = bcd_scene_add(scene, slot, key, errors);
        if (group && json_is_object(part))
            read_group(part, group, "", errors);
        else if (group)
            bcd_errors_add(errors, place, "must be an object such as {}, not %s", type_name(part));
    }
}

/* Sets what the object says; the key `skip` has been read already. */
static void read_group(json_t *object, struct bcd_group *group, const char *skip,
                       struct bcd_errors *errors)
{
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value)
    {
        const struct bcd_param *row = bcd_group_find(group, key);
        if (row)
            read_value(value, group, row, errors);
        else if (strcmp(key, skip) != 0)
            fault_unknown(group, key, errors);
    }
}

/* A list of numbers; the first element that is none is told by its own pointer. */
static void read_numbers(json_t *list, struct bcd_group *group, const struct bcd_param *row,
                         struct bcd_errors *errors)
{
    size_t count = json_array_size(list), kept = count <= row->most ? count : 0;
    double *values = calloc(kept + 1, sizeof *values);
    if (!values) {
        faults_no_memory(errors, group->pointer);
        return;
    }
    for (size_t i = 0; i < kept; i++) {
        json_t *element = json_array_get(list, i);
        values[i] = json_number_value(element);
        if (json_is_number(element))
            continue;
        char pointer[SCAN_POINTER_SIZE], index[24];
        snprintf(pointer, sizeof pointer, "%s", group->pointer);
        snprintf(index, sizeof index, "%zu", i);
        scan_json_append(pointer, row->name);
        scan_json_append(pointer, index);
        bcd_errors_add(errors, pointer, "must be a number, not %s", type_name(element));
        group->given |= (uint64_t)1 << (row - group->rows);
        goto cleanup;
    }
    bcd_group_set_numbers(group, row, values, count, errors);
cleanup:
    free(values);
}

static void read_value(json_t *value, struct bcd_group *group, const struct bcd_param *row,
                       struct bcd_errors *errors)
{
    if (json_is_integer(value)) {
        bcd_group_set_integer(group, row, json_integer_value(value), errors);
    } else if (json_is_real(value)) {
        double v = json_real_value(value);
        if (row->type == BCD_PARAM_INTEGER && v == floor(v) && fabs(v) <= WHOLE_MAX)
            bcd_group_set_integer(group, row, (int64_t)v, errors);
        else
            bcd_group_set_number(group, row, v, errors);
    } else if (json_is_string(value)) {
        bcd_group_set_text(group, row, json_string_value(value), errors);
    } else if (json_is_array(value) && row->type == BCD_PARAM_NUMBERS) {
        read_numbers(value, group, row, errors);
    } else {
        static const char *const wanted[] = {
            [BCD_PARAM_INTEGER] = "an integer",        [BCD_PARAM_NUMBER] = "a number",
            [BCD_PARAM_AUTO] = "a number or \"auto\"", [BCD_PARAM_CHOICE] = "a word",
            [BCD_PARAM_NUMBERS] = "a list of numbers", [BCD_PARAM_TEXT] = "a text"};
        char pointer[SCAN_POINTER_SIZE];
        snprintf(pointer, sizeof pointer, "%s", group->pointer);
        scan_json_append(pointer, row->name);
        bcd_errors_add(errors, pointer, "must be %s, not %s", wanted[row->type], type_name(value));
        /* One fault is enough: it was not left out. */
        group->given |= (uint64_t)1 << (row - group->rows);
    }
}

/* ----------------------------------------------------------- unknown names */

/* The index-th key that a group knows: its rows, then "type" or the job's parts. */
static const char *known_key(const struct bcd_group *group, size_t index)
{
    size_t rows = 0;
    while (group->rows[rows].name)
        rows++;
    if (index < rows)
        return group->rows[index].name;
    if (!group->type) /* the job itself */
        return index - rows < BCD_SLOT_COUNT ? bcd_slot_key((enum bcd_slot)(index - rows)) : NULL;
    return NULL;
}

static void fault_unknown(const struct bcd_group *group, const char *key, struct bcd_errors *errors)
{
    char pointer[SCAN_POINTER_SIZE];
    struct nearest known = {0};
    const char *name;
    bool told = errors->count < BCD_ERRORS_MAX; /* else only counted: spare the search */
    for (size_t i = 0; told && (name = known_key(group, i)) != NULL; i++)
        nearest_know(&known, name, key);
    snprintf(pointer, sizeof pointer, "%s", group->pointer);
    scan_json_append(pointer, key);
    if (known.name)
        bcd_errors_add(errors, pointer, "unknown key; did you mean \"%s\"?", known.name);
    else if (known.used > 0)
        bcd_errors_add(errors, pointer, "unknown key; known are %s", known.list);
    else
        bcd_errors_add(errors, pointer, "unknown key; there are no parameters here");
}

/* The slot takes no part of this name, or (NULL) was given none. */
static void fault_no_part(enum bcd_slot slot, const char *pointer, const char *name,
                          struct bcd_errors *errors)
{
    struct nearest known = {0};
    bool told = errors->count < BCD_ERRORS_MAX;
    for (size_t i = 0; told && bcd_catalogue(slot, i); i++)
        nearest_know(&known, bcd_catalogue(slot, i)->name, name);
    if (known.name)
        bcd_errors_add(errors, pointer, "unknown; did you mean \"%s\"?", known.name);
    else if (name)
        bcd_errors_add(errors, pointer, "unknown; known are %s", known.list);
    else
        bcd_errors_add(errors, pointer, "must be one of %s", known.list);
}

static const char *type_name(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "a list";
    case JSON_STRING:
        return "a text";
    case JSON_TRUE:
        return "true";
    case JSON_FALSE:
        return "false";
    case JSON_NULL:
        return "null";
    default:
        return "a number";
    }
}

/* ----------------------------------------------------------------- writing */

static void add_numbers(struct text *text, struct bcd_numbers numbers)
{
    text_add(text, "[");
    for (size_t i = 0; i < numbers.count; i++) {
        text_add(text, i ? "," : "");
        text_add_number(text, numbers.at[i]);
    }
    text_add(text, "]");
}

/* "name":value,... in row order, without the braces. */
static void add_group(struct text *text, const struct bcd_group *group)
{
    for (const struct bcd_param *row = group->rows; row->name; row++) {
        const char *word = bcd_group_text(group, row);
        text_add(text, row == group->rows ? "" : ",");
        text_add_json_string(text, row->name);
        text_add(text, ":");
        if (word)
            text_add_json_string(text, word);
        else if (row->type == BCD_PARAM_INTEGER)
            text_add(text, "%" PRId64, bcd_group_integer(group, row));
        else if (row->type == BCD_PARAM_NUMBERS)
            add_numbers(text, bcd_group_numbers(group, row));
        else
            text_add_number(text, bcd_group_number(group, row));
    }
}
