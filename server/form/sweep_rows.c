/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_rows.h"
#include "table_json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void add_quoted(struct text *text, const char *string);

void sweep_rows_add_json(struct text *text, const struct sweep *sweep,
                         const struct sweep_point *point, const struct bcd_table *table)
{
    size_t at[SWEEP_AXES_MAX];
    text_add(text, "{\"job\":\"%s\",\"state\":\"%s\"", point->job, job_state_name(point->state));
    if (sweep_place_parse(sweep, point->place, at))
        for (size_t a = 0; sweep_axis(sweep, a); a++) {
            text_add(text, ",");
            text_add_json_string(text, sweep_axis(sweep, a));
            text_add(text, ":");
            sweep_add_value(text, sweep, a, at[sweep_axis_group(sweep, a)]);
        }
    if (table) {
        text_add(text, ",");
        table_json_add_members(text, table);
    }
    text_add(text, "}");
}

void sweep_rows_add_head(struct text *text, const struct sweep *sweep,
                         struct sweep_columns *columns, const struct bcd_table *table)
{
    text_add(text, "job");
    for (size_t a = 0; sweep_axis(sweep, a); a++) {
        text_add(text, ",");
        add_quoted(text, sweep_axis(sweep, a));
    }
    for (size_t i = 0; table && i < table->columns; i++) {
        snprintf(columns->name[i], sizeof(columns->name[i]), "%s", table->column[i].name);
        text_add(text, ",");
        add_quoted(text, columns->name[i]);
        columns->count = i + 1;
    }
    text_add(text, "\n");
}

void sweep_rows_add_csv(struct text *text, const struct sweep *sweep,
                        const struct sweep_columns *columns, const struct sweep_point *point,
                        const struct bcd_table *table)
{
    const struct bcd_column *from[BCD_COLUMNS_MAX];
    struct text begin = {0}; /* of each line */
    size_t at[SWEEP_AXES_MAX];
    bool sound = sweep_place_parse(sweep, point->place, at);
    text_add(&begin, "%s", point->job);
    for (size_t a = 0; sound && sweep_axis(sweep, a); a++) {
        struct text value = {0};
        text_add(&begin, ",");
        sweep_add_value(&value, sweep, a, at[sweep_axis_group(sweep, a)]);
        char *json = text_take(&value);
        if (json)
            add_quoted(&begin, json);
        free(json);
    }
    for (size_t i = 0; i < columns->count; i++)
        from[i] = sweep_rows_column(table, columns->name[i]);
    for (size_t row = 0; row < table->rows && begin.bytes; row++) {
        text_add_bytes(text, begin.bytes, begin.size);
        for (size_t i = 0; i < columns->count; i++) {
            text_add_bytes(text, ",", 1);
            if (from[i] && isfinite(from[i]->values[row]))
                text_add_number(text, from[i]->values[row]);
        }
        text_add_bytes(text, "\n", 1);
    }
    text->failed = text->failed || begin.failed;
    free(begin.bytes);
}

const struct bcd_column *sweep_rows_column(const struct bcd_table *table, const char *name)
{
    for (size_t i = 0; i < table->columns; i++)
        if (strcmp(table->column[i].name, name) == 0)
            return table->column[i].values ? &table->column[i] : NULL;
    return NULL;
}

/* Texts without the quotes of JSON, quoted only where RFC 4180 wants it. */
static void add_quoted(struct text *text, const char *string)
{
    size_t length = strlen(string);
    bool json = length >= 2 && string[0] == '"' && !memchr(string, '\\', length);
    if (json) {
        string++;
        length -= 2;
    }
    if (!memchr(string, ',', length) && !memchr(string, '"', length) &&
        !memchr(string, '\n', length)) {
        text_add_bytes(text, string, length);
        return;
    }
    text_add(text, "\"");
    for (size_t i = 0; i < length; i++) {
        text_add_bytes(text, "\"", string[i] == '"');
        text_add_bytes(text, string + i, 1);
    }
    text_add(text, "\"");
}
