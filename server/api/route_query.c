/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "route_query.h"
#include "limits.h"
#include "ticket.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct query_row *find(const struct route *route, const char *name);
static bool given_before(const struct request *request, size_t index);
static void fault_unknown(const struct route *route, const char *name, struct bcd_errors *errors);
static void check_value(const struct query_row *row, const char *value, struct bcd_errors *errors);
static bool integer_within(const struct query_row *row, const char *value);
static bool number_within(const struct query_row *row, const char *value);

void route_query_check(const struct route *route, const struct request *request,
                       struct bcd_errors *errors)
{
    for (size_t i = 0; i < request->query_count; i++) {
        const char *name = request->query[i].name;
        const struct query_row *row = find(route, name);
        if (!row && !route->filters)
            fault_unknown(route, name, errors);
        else if (row && !row->many && given_before(request, i))
            bcd_errors_add(errors, name, "is given twice");
        else if (row)
            check_value(row, request->query[i].value, errors);
    }
}

const char *call_query(const struct call *call, const char *name)
{
    for (size_t i = 0; i < call->request->query_count; i++)
        if (strcmp(call->request->query[i].name, name) == 0)
            return call->request->query[i].value;
    return NULL;
}

static const struct query_row *find(const struct route *route, const char *name)
{
    for (const struct query_row *row = route->query; row && row->name; row++)
        if (strcmp(row->name, name) == 0)
            return row;
    return NULL;
}

static bool given_before(const struct request *request, size_t index)
{
    for (size_t i = 0; i < index; i++)
        if (strcmp(request->query[i].name, request->query[index].name) == 0)
            return true;
    return false;
}

static void fault_unknown(const struct route *route, const char *name, struct bcd_errors *errors)
{
    char known[200] = "";
    size_t used = 0;
    for (const struct query_row *row = route->query; row && row->name && used < sizeof(known);
         row++)
        used += (size_t)snprintf(known + used, sizeof(known) - used, "%s%s", used ? ", " : "",
                                 row->name);
    if (known[0])
        bcd_errors_add(errors, name, "is not known here; known are %s", known);
    else
        bcd_errors_add(errors, name, "this path takes no query parameters");
}

static void check_value(const struct query_row *row, const char *value, struct bcd_errors *errors)
{
    switch (row->type) {
    case QUERY_TEXT:
    case QUERY_TIME:
        break;
    case QUERY_LABEL:
        if (!ticket_label_sound(value))
            bcd_errors_add(errors, row->name, "must be a text of 1 to %d characters",
                           LIMIT_LABEL_CHARACTERS_MAX);
        break;
    case QUERY_OWNER:
        if (!owner_sound(value))
            bcd_errors_add(errors, row->name, "must be 1 to %d of a-z 0-9 _ -, not \"%.40s\"",
                           OWNER_SIZE - 1, value);
        break;
    case QUERY_TAG:
        if (!ticket_tag_sound(value))
            bcd_errors_add(errors, row->name, "must be 1 to %d of A-Z a-z 0-9 . _ -, not \"%.40s\"",
                           LIMIT_TAG_BYTES_MAX, value);
        break;
    case QUERY_ID:
        if (!*value || value[strspn(value, "abcdefghijklmnopqrstuvwxyz0123456789-")] ||
            strlen(value) >= CALL_ARG_SIZE)
            bcd_errors_add(errors, row->name, "must be an id: a-z 0-9 -, not \"%.40s\"", value);
        break;
    case QUERY_WORD:
        if (!route_query_word(row->words, value))
            bcd_errors_add(errors, row->name, "must be one of %s, not \"%.40s\"", row->words,
                           value);
        break;
    case QUERY_BOOLEAN:
        if (!route_query_word("true false", value))
            bcd_errors_add(errors, row->name, "must be true or false, not \"%.40s\"", value);
        break;
    case QUERY_INTEGER:
        if (!integer_within(row, value))
            bcd_errors_add(errors, row->name,
                           "must be a whole number from %.0f to %.0f, not \"%.40s\"", row->min,
                           row->max, value);
        break;
    case QUERY_NUMBER:
        if (!number_within(row, value))
            bcd_errors_add(errors, row->name, "must be a number from %g to %g, not \"%.40s\"",
                           row->min, row->max, value);
        break;
    }
}

bool route_query_word(const char *words, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = words; length > 0 && strcspn(word, " ") == length && *at;) {
        size_t here = strcspn(at, " ");
        if (here == length && strncmp(at, word, length) == 0)
            return true;
        at += here + strspn(at + here, " ");
    }
    return false;
}

/* Digits alone, with a minus where one is possible. */
static bool integer_within(const struct query_row *row, const char *value)
{
    const char *digits = value + (*value == '-' && row->min < 0);
    if (!*digits || digits[strspn(digits, "0123456789")])
        return false;
    errno = 0;
    intmax_t n = strtoimax(value, NULL, 10);
    return errno == 0 && (double)n >= row->min && (double)n <= row->max;
}

static bool number_within(const struct query_row *row, const char *value)
{
    char *end;
    if (!*value || value[strspn(value, "0123456789.eE+-")])
        return false; /* no blanks, names or hexadecimal digits */
    double x = strtod(value, &end);
    return end != value && !*end && x >= row->min && x <= row->max;
}
