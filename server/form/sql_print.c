/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sql_print.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void flush_table(struct sql_print *print);

void sql_print_init(struct sql_print *print, enum sql_form form)
{
    *print = (struct sql_print){.form = form};
}

static size_t characters(const char *text)
{
    size_t count = 0;
    for (; *text; text++)
        count += (*text & 0xC0) != 0x80;
    return count;
}

static void put(struct sql_print *print, struct text *text)
{
    char *bytes = text_take(text);
    print->failed = print->failed || !bytes || fputs(bytes, stdout) < 0;
    free(bytes);
}

/* A text with a comma, a quote or a line end is quoted. */
static void add_csv(struct text *text, const char *string)
{
    if (!strpbrk(string, ",\"\r\n")) {
        text_add(text, "%s", string);
        return;
    }
    text_add(text, "\"");
    for (; *string; string++)
        text_add(text, "%s%c", *string == '"' ? "\"" : "", *string);
    text_add(text, "\"");
}

void sql_print_names(void *context, size_t columns, const char *const *name)
{
    struct sql_print *print = context;
    struct text text = {0};
    print->columns = columns;
    print->name = calloc(columns + 1, sizeof *print->name);
    print->width = calloc(columns + 1, sizeof *print->width);
    print->cell = calloc(columns * SQL_PRINT_ROWS + 1, sizeof *print->cell);
    print->number = calloc(columns * SQL_PRINT_ROWS + 1, sizeof *print->number);
    print->failed = !print->name || !print->width || !print->cell || !print->number;
    for (size_t i = 0; i < columns && !print->failed; i++) {
        print->name[i] = strdup(name[i] ? name[i] : "");
        print->failed = !print->name[i];
        print->width[i] = print->failed ? 0 : characters(print->name[i]);
    }
    for (size_t i = 0; i < columns && print->form == SQL_PRINT_CSV && !print->failed; i++) {
        text_add(&text, i ? "," : "");
        add_csv(&text, print->name[i]);
    }
    if (print->form == SQL_PRINT_CSV)
        text_add(&text, "\n");
    if (print->form == SQL_PRINT_JSON)
        text_add(&text, "[");
    put(print, &text);
}

static void add_blob(struct text *text, const struct sql_value *value)
{
    for (size_t i = 0; i < value->size; i++)
        text_add(text, "%02x", (unsigned char)value->text[i]);
}

static void add_json(struct text *text, const struct sql_value *value)
{
    struct text blob = {0};
    char *hex;
    switch (value->type) {
    case SQL_NULL:
        text_add(text, "null");
        break;
    case SQL_INTEGER:
        text_add(text, "%" PRId64, value->integer);
        break;
    case SQL_REAL:
        text_add_number(text, value->real);
        break;
    case SQL_TEXT:
        text_add_json_string(text, value->text);
        break;
    case SQL_BLOB:
        add_blob(&blob, value);
        hex = text_take(&blob);
        text_add_json_string(text, hex ? hex : "");
        free(hex);
        break;
    }
}

/* For people eight digits are enough. */
static char *print_cell(const struct sql_value *value, bool short_numbers)
{
    struct text text = {0};
    char number[32];
    if (value->type == SQL_INTEGER || (value->type == SQL_REAL && !short_numbers)) {
        add_json(&text, value);
    } else if (value->type == SQL_REAL) {
        snprintf(number, sizeof number, "%.8g", value->real);
        text_add(&text, "%s", number);
    } else if (value->type == SQL_TEXT) {
        text_add(&text, "%s", value->text);
    } else if (value->type == SQL_BLOB) {
        add_blob(&text, value);
    }
    return text_take(&text);
}

static void print_csv_row(struct sql_print *print, const struct sql_value *value)
{
    struct text text = {0};
    for (size_t i = 0; i < print->columns; i++) {
        char *cell = print_cell(&value[i], false);
        text_add(&text, i ? "," : "");
        if (cell)
            add_csv(&text, cell);
        print->failed = print->failed || !cell;
        free(cell);
    }
    text_add(&text, "\n");
    put(print, &text);
}

static void print_json_row(struct sql_print *print, const struct sql_value *value)
{
    struct text text = {0};
    text_add(&text, print->rows ? ",\n{" : "\n{");
    for (size_t i = 0; i < print->columns; i++) {
        text_add(&text, i ? "," : "");
        text_add_json_string(&text, print->name[i]);
        text_add(&text, ":");
        add_json(&text, &value[i]);
    }
    text_add(&text, "}");
    put(print, &text);
}

static void keep_table_row(struct sql_print *print, const struct sql_value *value)
{
    for (size_t i = 0; i < print->columns; i++) {
        char *cell = print_cell(&value[i], true);
        size_t at = print->waiting * print->columns + i;
        print->cell[at] = cell;
        print->number[at] = value[i].type == SQL_INTEGER || value[i].type == SQL_REAL;
        print->failed = print->failed || !cell;
        for (char *c = cell; c && *c; c++)
            if ((unsigned char)*c < 0x20 || *c == 0x7F)
                *c = ' '; /* nothing that a terminal would obey */
        if (cell && characters(cell) > print->width[i])
            print->width[i] = characters(cell);
    }
    if (++print->waiting == SQL_PRINT_ROWS)
        flush_table(print);
}

bool sql_print_row(void *context, size_t columns, const struct sql_value *value)
{
    struct sql_print *print = context;
    if (print->failed || columns != print->columns)
        return false;
    if (print->form == SQL_PRINT_CSV)
        print_csv_row(print, value);
    else if (print->form == SQL_PRINT_JSON)
        print_json_row(print, value);
    else
        keep_table_row(print, value);
    print->rows++;
    return !print->failed;
}

static void add_table_cell(struct sql_print *print, struct text *text, size_t column,
                           const char *cell, bool right)
{
    size_t blanks = print->width[column] - characters(cell);
    bool last = column + 1 == print->columns;
    if (right)
        text_add(text, "%*s%s%s", (int)blanks, "", cell, last ? "\n" : "  ");
    else
        text_add(text, "%s%*s%s", cell, last ? 0 : (int)blanks, "", last ? "\n" : "  ");
}

/* The names come before the first rows, with the widths that these need. */
static void flush_table(struct sql_print *print)
{
    struct text text = {0};
    bool first = print->rows < SQL_PRINT_ROWS;
    for (size_t i = 0; first && i < print->columns; i++)
        add_table_cell(print, &text, i, print->name[i], print->waiting > 0 && print->number[i]);
    for (size_t i = 0; i < print->waiting * print->columns; i++) {
        if (print->cell[i])
            add_table_cell(print, &text, i % print->columns, print->cell[i], print->number[i]);
        free(print->cell[i]);
        print->cell[i] = NULL;
    }
    print->waiting = 0;
    put(print, &text);
}

bool sql_print_fini(struct sql_print *print)
{
    if (print->form == SQL_PRINT_TABLE && print->columns > 0 && !print->failed)
        if (print->waiting > 0 || print->rows == 0)
            flush_table(print);
    if (print->form == SQL_PRINT_JSON && print->columns > 0)
        print->failed = fputs(print->rows ? "\n]\n" : "]\n", stdout) < 0 || print->failed;
    for (size_t i = 0; print->name && i < print->columns; i++)
        free(print->name[i]);
    for (size_t i = 0; print->cell && i < print->columns * print->waiting; i++)
        free(print->cell[i]);
    free(print->name);
    free(print->cell);
    free(print->number);
    free(print->width);
    return fflush(stdout) == 0 && !print->failed;
}
