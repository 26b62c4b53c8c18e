/* SPDX-License-Identifier: GPL-3.0-or-later
 * param.c - see param.h and bcd.h. */
#include "param.h"
#include "blob.h"
#include "status.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int64_t *integer_at(const struct bcd_group *group, const struct bcd_param *row)
{
    return (int64_t *)(void *)((char *)group->values + row->offset);
}

static double *number_at(const struct bcd_group *group, const struct bcd_param *row)
{
    return (double *)(void *)((char *)group->values + row->offset);
}

static struct bcd_numbers *numbers_at(const struct bcd_group *group, const struct bcd_param *row)
{
    return (struct bcd_numbers *)(void *)((char *)group->values + row->offset);
}

static char **text_at(const struct bcd_group *group, const struct bcd_param *row)
{
    return (char **)(void *)((char *)group->values + row->offset);
}

static bool holds_number(const struct bcd_param *row)
{
    return row->type == BCD_PARAM_NUMBER || row->type == BCD_PARAM_AUTO;
}

static bool holds_integer(const struct bcd_param *row)
{
    return row->type == BCD_PARAM_INTEGER || row->type == BCD_PARAM_CHOICE;
}

void group_init(struct bcd_group *group, const struct bcd_param *rows, void *values,
                const char *pointer, const char *type)
{
    *group = (struct bcd_group){.rows = rows, .values = values, .type = type};
    snprintf(group->pointer, sizeof group->pointer, "%s", pointer);
    for (const struct bcd_param *row = rows; row->name; row++) {
        assert(row - rows < 64); /* one bit each in `given` */
        if (holds_integer(row))
            *integer_at(group, row) = (int64_t)row->fallback;
        else if (holds_number(row))
            *number_at(group, row) = row->fallback;
    }
}

void group_free(struct bcd_group *group)
{
    for (const struct bcd_param *row = group->rows; row->name; row++) {
        if (row->type == BCD_PARAM_NUMBERS)
            free(numbers_at(group, row)->at);
        if (row->type == BCD_PARAM_TEXT)
            free(*text_at(group, row));
    }
    free(group->values);
}

/* The bytes of one row's value; "" and NULL are the same text. */
static const void *bytes_of(const struct bcd_group *group, const struct bcd_param *row,
                            size_t *size)
{
    if (row->type == BCD_PARAM_TEXT) {
        const char *text = *text_at(group, row) ? *text_at(group, row) : "";
        *size = strlen(text);
        return text;
    }
    if (row->type == BCD_PARAM_NUMBERS) {
        const struct bcd_numbers *numbers = numbers_at(group, row);
        *size = numbers->count * sizeof *numbers->at;
        return numbers->at;
    }
    *size = sizeof(int64_t);
    return (const char *)group->values + row->offset;
}

bool group_equal(const struct bcd_group *a, const struct bcd_group *b)
{
    static_assert(sizeof(int64_t) == sizeof(double), "a value of either kind has 8 bytes");
    if (a->rows != b->rows)
        return false;
    for (const struct bcd_param *row = a->rows; row->name; row++) {
        size_t size, other;
        const void *bytes = bytes_of(a, row, &size), *others = bytes_of(b, row, &other);
        if (size != other || (size > 0 && memcmp(bytes, others, size) != 0))
            return false;
    }
    return true;
}

uint64_t group_hash(const struct bcd_group *group)
{
    uint64_t hash = BLOB_HASH_START;
    for (const struct bcd_param *row = group->rows; row->name; row++) {
        size_t size;
        const void *bytes = bytes_of(group, row, &size);
        hash = blob_hash(&size, sizeof size, hash);
        hash = size > 0 ? blob_hash(bytes, size, hash) : hash;
    }
    return hash;
}

static void mark_given(struct bcd_group *group, const struct bcd_param *row)
{
    group->given |= (uint64_t)1 << (row - group->rows);
}

void group_check_required(const struct bcd_group *group, struct bcd_errors *errors)
{
    for (const struct bcd_param *row = group->rows; row->name; row++)
        if (row->required && !(group->given >> (row - group->rows) & 1))
            group_fault(group, row->name, errors, "is required: %s", row->doc);
}

void group_fault(const struct bcd_group *group, const char *row, struct bcd_errors *errors,
                 const char *format, ...)
{
    char field[sizeof((struct bcd_error *)0)->field], text[sizeof((struct bcd_error *)0)->text];
    snprintf(field, sizeof field, "%s/%s", group->pointer, row);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    bcd_errors_add(errors, field, "%s", text);
}

void group_no_memory(const struct bcd_group *group, const char *row, struct bcd_errors *errors)
{
    char field[sizeof((struct bcd_error *)0)->field];
    snprintf(field, sizeof field, "%s/%s", group->pointer, row);
    errors_no_memory(errors, field);
}

const struct bcd_param *bcd_group_find(const struct bcd_group *group, const char *name)
{
    for (const struct bcd_param *row = group->rows; row->name; row++)
        if (strcmp(row->name, name) == 0)
            return row;
    return NULL;
}

/* "must be above 0 and at most 1e+09, not -3" */
static void fault_range(const struct bcd_group *group, const struct bcd_param *row,
                        struct bcd_errors *errors, double value)
{
    const char *kind = row->type == BCD_PARAM_INTEGER ? "an integer" : "a number";
    const char *relation = row->above_min ? "above" : "at least";
    if (isinf(row->max) && isinf(row->min))
        group_fault(group, row->name, errors, "must be a finite number");
    else
        group_fault(group, row->name, errors, "must be %s %s %.12g and at most %.12g, not %.17g",
                    kind, relation, row->min, row->max, value);
}

static bool in_range(const struct bcd_param *row, double value)
{
    return isfinite(value) && (row->above_min ? value > row->min : value >= row->min) &&
           value <= row->max;
}

/* "must be a number or \"auto\"" - what a row takes, for faults about something else. */
static const char *wanted(const struct bcd_param *row)
{
    static const char *const words[] = {
        [BCD_PARAM_INTEGER] = "an integer",        [BCD_PARAM_NUMBER] = "a number",
        [BCD_PARAM_AUTO] = "a number or \"auto\"", [BCD_PARAM_CHOICE] = "a word",
        [BCD_PARAM_NUMBERS] = "a list of numbers", [BCD_PARAM_TEXT] = "a text"};
    return words[row->type];
}

bool bcd_group_set_integer(struct bcd_group *group, const struct bcd_param *row, int64_t value,
                           struct bcd_errors *errors)
{
    if (row->type != BCD_PARAM_INTEGER)
        return bcd_group_set_number(group, row, (double)value, errors);
    mark_given(group, row);
    /* As integers: 2^53 + 1 is 2^53 in doubles. */
    if (value < (int64_t)row->min || value > (int64_t)row->max) {
        fault_range(group, row, errors, (double)value);
        return false;
    }
    *integer_at(group, row) = value;
    return true;
}

bool bcd_group_set_number(struct bcd_group *group, const struct bcd_param *row, double value,
                          struct bcd_errors *errors)
{
    mark_given(group, row);
    if (!holds_number(row) && row->type != BCD_PARAM_INTEGER) {
        group_fault(group, row->name, errors, "must be %s, not a number", wanted(row));
        return false;
    }
    if (row->type == BCD_PARAM_INTEGER) {
        group_fault(group, row->name, errors, "must be an integer, not %.17g", value);
        return false;
    }
    if (!in_range(row, value)) {
        fault_range(group, row, errors, value);
        return false;
    }
    *number_at(group, row) = value == 0 ? 0 : value; /* -0 and 0 are the same job */
    return true;
}

bool bcd_group_set_numbers(struct bcd_group *group, const struct bcd_param *row,
                           const double *values, size_t count, struct bcd_errors *errors)
{
    mark_given(group, row);
    if (row->type != BCD_PARAM_NUMBERS) {
        group_fault(group, row->name, errors, "must be %s, not a list", wanted(row));
        return false;
    }
    if (count < row->least || count > row->most) {
        group_fault(group, row->name, errors, "must hold %zu to %zu numbers, not %zu", row->least,
                    row->most, count);
        return false;
    }
    for (size_t i = 0; i < count; i++) {
        if (!in_range(row, values[i])) {
            char name[sizeof((struct bcd_error *)0)->field];
            snprintf(name, sizeof name, "%s/%zu", row->name, i);
            group_fault(group, name, errors, "must be %s %.12g and at most %.12g, not %.17g",
                        row->above_min ? "above" : "at least", row->min, row->max, values[i]);
            return false;
        }
    }
    double *copy = malloc((count + 1) * sizeof *copy);
    if (!copy) {
        group_no_memory(group, row->name, errors);
        return false;
    }
    for (size_t i = 0; i < count; i++)
        copy[i] = values[i] == 0 ? 0 : values[i];
    free(numbers_at(group, row)->at);
    *numbers_at(group, row) = (struct bcd_numbers){count, copy};
    return true;
}

static bool set_free_text(struct bcd_group *group, const struct bcd_param *row, const char *value,
                          struct bcd_errors *errors)
{
    size_t length = strlen(value);
    if (length < row->least || length > row->most) {
        group_fault(group, row->name, errors, "must be %zu to %zu characters long, not %zu",
                    row->least, row->most, length);
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        if (value[i] < ' ' || value[i] > '~') {
            group_fault(group, row->name, errors, "must be printable ASCII; character %zu is not",
                        i + 1);
            return false;
        }
    }
    char *copy = malloc(length + 1);
    if (!copy) {
        group_no_memory(group, row->name, errors);
        return false;
    }
    memcpy(copy, value, length + 1);
    free(*text_at(group, row));
    *text_at(group, row) = copy;
    return true;
}

/* Lists the words of a choice: "auto", "bcd", "strang". */
static void join_choices(const struct bcd_param *row, char *text, size_t size)
{
    size_t used = 0;
    for (size_t i = 0; row->choice(i) && used < size; i++)
        used +=
            (size_t)snprintf(text + used, size - used, "%s\"%s\"", i ? ", " : "", row->choice(i));
}

bool bcd_group_set_text(struct bcd_group *group, const struct bcd_param *row, const char *value,
                        struct bcd_errors *errors)
{
    mark_given(group, row);
    if (row->type == BCD_PARAM_AUTO && strcmp(value, "auto") == 0) {
        *number_at(group, row) = NAN;
        return true;
    }
    if (row->type == BCD_PARAM_TEXT)
        return set_free_text(group, row, value, errors);
    if (row->type != BCD_PARAM_CHOICE) {
        group_fault(group, row->name, errors, "must be %s, not the text \"%.40s\"", wanted(row),
                    value);
        return false;
    }
    for (size_t i = 0; row->choice(i); i++) {
        if (strcmp(row->choice(i), value) == 0) {
            *integer_at(group, row) = (int64_t)i;
            return true;
        }
    }
    char words[200];
    join_choices(row, words, sizeof words);
    group_fault(group, row->name, errors, "must be one of %s, not \"%.40s\"", words, value);
    return false;
}

int64_t bcd_group_integer(const struct bcd_group *group, const struct bcd_param *row)
{
    return *integer_at(group, row);
}

double bcd_group_number(const struct bcd_group *group, const struct bcd_param *row)
{
    return holds_integer(row)  ? (double)*integer_at(group, row)
           : holds_number(row) ? *number_at(group, row)
                               : NAN;
}

struct bcd_numbers bcd_group_numbers(const struct bcd_group *group, const struct bcd_param *row)
{
    return row->type == BCD_PARAM_NUMBERS ? *numbers_at(group, row) : (struct bcd_numbers){0, NULL};
}

const char *bcd_group_text(const struct bcd_group *group, const struct bcd_param *row)
{
    if (row->type == BCD_PARAM_CHOICE)
        return row->choice((size_t)*integer_at(group, row));
    if (row->type == BCD_PARAM_TEXT)
        return *text_at(group, row) ? *text_at(group, row) : "";
    return row->type == BCD_PARAM_AUTO && isnan(*number_at(group, row)) ? "auto" : NULL;
}
