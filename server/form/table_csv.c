/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "table_csv.h"
#include "text.h"

#include <math.h>
#include <string.h>

static void add_field(struct text *text, const char *string);

char *table_csv_print(const struct bcd_table *table)
{
    const struct bcd_column *present[BCD_COLUMNS_MAX];
    size_t count = 0;
    for (size_t i = 0; i < table->columns; i++)
        if (table->column[i].values)
            present[count++] = &table->column[i];
    struct text text = {0};
    for (size_t i = 0; i < count; i++) {
        text_add(&text, i ? "," : "");
        add_field(&text, present[i]->name);
    }
    text_add(&text, "\n");
    for (size_t row = 0; row < table->rows; row++) {
        for (size_t i = 0; i < count; i++) {
            text_add_bytes(&text, ",", i > 0);
            double value = present[i]->values[row];
            if (isfinite(value))
                text_add_number(&text, value);
        }
        text_add_bytes(&text, "\n", 1);
    }
    return text_take(&text);
}

/* Quoted only where RFC 4180 wants it. */
static void add_field(struct text *text, const char *string)
{
    if (!strpbrk(string, ",\"\r\n")) {
        text_add_bytes(text, string, strlen(string));
        return;
    }
    text_add(text, "\"");
    for (const char *c = string; *c; c++) {
        text_add_bytes(text, "\"", *c == '"');
        text_add_bytes(text, c, 1);
    }
    text_add(text, "\"");
}
