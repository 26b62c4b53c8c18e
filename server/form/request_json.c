/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "request_json.h"
#include "dump_json.h"
#include "scan_json.h"
#include "text.h"

#include <jansson.h>

#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void set_ticket(json_t *object, const struct request_ticket *ticket);
static json_t *read_axis(const char *text, bool logarithmic, char *reason, size_t size);
static json_t *read_list(const char *text);
static json_t *read_pointers(const char *text);
static char *print(json_t *object);

char *request_json_submit(const char *text, size_t size, const struct request_ticket *ticket)
{
    bool nothing = !ticket->label && !ticket->tags_count && !ticket->priority;
    json_t *object = nothing ? NULL : json_loadb(text, size, JSON_REJECT_DUPLICATES, NULL);
    /* Numbers that a double cannot hold must reach the server as they are. */
    if (json_is_object(object) && scan_json_numbers(text, size, NULL) == 0) {
        set_ticket(object, ticket);
        return print(object);
    }
    json_decref(object);
    struct text copy = {0};
    text_add_bytes(&copy, text, size);
    return text_take(&copy);
}

/* The job goes in as text, so that every number keeps its digits. */
char *request_json_sweep(const struct request_sweep *sweep, char *reason, size_t size)
{
    json_t *rest = json_object(), *axes = json_object(), *zips = json_array();
    json_error_t error;
    struct text text = {0};
    bool good = true;
    snprintf(reason, size, "out of memory");
    if (sweep->job) {
        json_t *job = json_loads(sweep->job, JSON_REJECT_DUPLICATES, &error);
        good = json_is_object(job);
        if (!good)
            snprintf(reason, size, "the job is not JSON: line %d, column %d: %s", error.line,
                     error.column, error.text);
        json_decref(job);
    }
    for (size_t i = 0; good && i < sweep->axes_count; i++) {
        const char *axis = sweep->axes[i], *equals = strchr(axis, '=');
        json_t *values = NULL;
        if (*axis != '/' || !equals)
            snprintf(reason, size, "an axis is like /diameter=0.1,0.5; not \"%s\"", axis);
        else if (json_object_getn(axes, axis, (size_t)(equals - axis)))
            snprintf(reason, size, "there are two axes %.*s", (int)(equals - axis), axis);
        else
            values = read_axis(equals + 1, sweep->logarithmic, reason, size);
        good = values && json_object_setn_new(axes, axis, (size_t)(equals - axis), values) == 0;
    }
    for (size_t i = 0; good && i < sweep->zips_count; i++)
        good = json_array_append_new(zips, read_pointers(sweep->zips[i])) == 0;
    good = good && json_object_set(rest, "axes", axes) == 0;
    if (good && sweep->zips_count > 0)
        json_object_set(rest, "zip", zips);
    if (good && sweep->ticket)
        set_ticket(rest, sweep->ticket);
    char *members = good ? print(json_incref(rest)) : NULL;
    if (members && sweep->job)
        text_add(&text, "{\"base\":%s,%s", sweep->job, members + 1);
    else if (members)
        text_add(&text, "%s", members);
    free(members);
    json_decref(rest);
    json_decref(axes);
    json_decref(zips);
    return text.bytes ? text_take(&text) : NULL;
}

char *request_json_members(const struct request_member *members, size_t count)
{
    json_t *object = json_object();
    for (size_t i = 0; i < count; i++) {
        if (members[i].text)
            json_object_set_new(object, members[i].name, json_string(members[i].text));
        if (members[i].number)
            json_object_set_new(object, members[i].name, json_integer(*members[i].number));
    }
    return print(object);
}

static void set_ticket(json_t *object, const struct request_ticket *ticket)
{
    if (ticket->label)
        json_object_set_new(object, "label", json_string(ticket->label));
    if (ticket->priority)
        json_object_set_new(object, "priority", json_integer(*ticket->priority));
    if (ticket->tags_count == 0)
        return;
    json_t *tags = json_array();
    for (size_t i = 0; i < ticket->tags_count; i++)
        json_array_append_new(tags, json_string(ticket->tags[i]));
    json_object_set_new(object, "tags", tags);
}

/* ---------------------------------------------------------------------- axes */

/* A number of JSON at the beginning of text: it, and what follows; NULL = none. */
static json_t *read_number(const char *text, const char **rest)
{
    size_t size = strspn(text, "+-0123456789.eE");
    const char *dots = strstr(text, "..");
    if (dots && dots < text + size)
        size = (size_t)(dots - text);
    json_t *number = size ? json_loadb(text, size, JSON_DECODE_ANY, NULL) : NULL;
    *rest = text + size;
    if (json_is_number(number))
        return number;
    json_decref(number);
    return NULL;
}

/* "1..10", "0..6:7", "0.1..10:7:log"; NULL with words when it begins like one and is none. */
static json_t *read_range(const char *text, bool logarithmic, char *reason, size_t size)
{
    const char *rest = text;
    json_t *from = read_number(text, &rest), *range = NULL;
    json_t *to = from && strncmp(rest, "..", 2) == 0 ? read_number(rest + 2, &rest) : NULL;
    bool whole = json_is_integer(from) && json_is_integer(to);
    char *end = NULL;
    long long points = to && *rest == ':' ? strtoll(rest + 1, &end, 10) : 0;
    bool log_scale = logarithmic || (end && strcmp(end, ":log") == 0);
    if (to && whole && !*rest && json_integer_value(to) >= json_integer_value(from))
        range = json_pack("{sIsI}", "first", json_integer_value(from), "count",
                          json_integer_value(to) - json_integer_value(from) + 1);
    else if (end && end > rest + 1 && (!*end || strcmp(end, ":log") == 0) && points >= 1)
        range = json_pack("{sOsOsIss}", "from", from, "to", to, "points", (json_int_t)points,
                          "scale", log_scale ? "log" : "linear");
    else
        snprintf(reason, size,
                 "\"%s\" is no range: 1..10 of whole numbers, 0..6:7 with a number of points, "
                 "0.1..10:7:log",
                 text);
    json_decref(from);
    json_decref(to);
    return range;
}

static json_t *read_axis(const char *text, bool logarithmic, char *reason, size_t size)
{
    const char *rest = text;
    json_t *first = read_number(text, &rest);
    bool range = first && strncmp(rest, "..", 2) == 0;
    json_decref(first);
    if (range)
        return read_range(text, logarithmic, reason, size);
    json_t *list = read_list(text);
    if (!list)
        snprintf(reason, size, "an axis needs values between its commas: \"%s\"", text);
    return list;
}

/* The values as JSON if all of it is, else one by one, and words for strings. */
static json_t *read_list(const char *text)
{
    struct text brackets = {0};
    text_add(&brackets, "[%s]", text);
    char *whole = text_take(&brackets);
    json_t *list = whole ? json_loads(whole, 0, NULL) : NULL;
    free(whole);
    if (json_array_size(list) > 0)
        return list;
    json_decref(list);
    list = json_array();
    for (size_t length; list; text += length + 1) {
        length = strcspn(text, ",");
        json_t *value = json_loadb(text, length, JSON_DECODE_ANY, NULL);
        if (!value && length > 0)
            value = json_stringn(text, length);
        if (json_array_append_new(list, value) != 0) {
            json_decref(list);
            list = NULL;
        } else if (!text[length]) {
            break;
        }
    }
    return list;
}

static json_t *read_pointers(const char *text)
{
    json_t *list = json_array();
    for (size_t length; *text; text += length + (text[length] == ',')) {
        length = strcspn(text, ",");
        json_array_append_new(list, json_stringn(text, length));
    }
    return list;
}

static char *print(json_t *object)
{
    struct text text = {0};
    dump_json_add(&text, object);
    json_decref(object);
    return text_take(&text);
}
