/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "table_json.h"
#include "text.h"

#include <stdio.h>

static void add_table(struct text *text, const struct bcd_table *table);
static void add_column(struct text *text, const struct bcd_table *table,
                       const struct bcd_column *column);
static void add_name(struct text *text, const char *name, const char *suffix, bool first);

char *table_json_print(const struct bcd_table *table)
{
    struct text text = {0};
    add_table(&text, table);
    text_add(&text, "\n");
    return text_take(&text);
}

char *table_json_print_all(struct bcd_table *const *tables, size_t count)
{
    struct text text = {0};
    text_add(&text, "{");
    for (size_t i = 0; i < count; i++) {
        add_name(&text, tables[i]->name, "", i == 0);
        add_table(&text, tables[i]);
    }
    text_add(&text, "}\n");
    return text_take(&text);
}

static void add_table(struct text *text, const struct bcd_table *table)
{
    text_add(text, "{");
    table_json_add_members(text, table);
    text_add(text, "}");
}

void table_json_add_members(struct text *text, const struct bcd_table *table)
{
    for (size_t i = 0; i < table->columns; i++) {
        const struct bcd_column *column = &table->column[i];
        add_name(text, column->name, "", i == 0);
        add_column(text, table, column);
        if (!column->values && column->reason[0]) {
            add_name(text, column->name, "_reason", false);
            text_add_json_string(text, column->reason);
        }
    }
    for (size_t i = 0; i < table->notes; i++) {
        const struct bcd_note *note = &table->note[i];
        add_name(text, note->name, "", table->columns + i == 0);
        if (note->text[0])
            text_add_json_string(text, note->text);
        else
            text_add_number(text, note->number);
    }
}

/* A list; the number itself in a table of scalars; null when there is nothing. */
static void add_column(struct text *text, const struct bcd_table *table,
                       const struct bcd_column *column)
{
    if (!column->values || (table->scalar && table->rows == 0)) {
        text_add(text, "null");
        return;
    }
    if (table->scalar) {
        text_add_number(text, column->values[0]);
        return;
    }
    for (size_t row = 0; row < table->rows; row++) {
        text_add_bytes(text, row ? "," : "[", 1);
        text_add_number(text, column->values[row]);
    }
    text_add(text, table->rows ? "]" : "[]");
}

static void add_name(struct text *text, const char *name, const char *suffix, bool first)
{
    char key[sizeof(((struct bcd_column *)0)->name) + 16];
    snprintf(key, sizeof(key), "%s%s", name, suffix);
    text_add(text, first ? "" : ",");
    text_add_json_string(text, key);
    text_add(text, ":");
}
