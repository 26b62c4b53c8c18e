/* SPDX-License-Identifier: GPL-3.0-or-later
 * table.c - see table.h and bcd.h. */
#include "table.h"
#include "blob.h"
#include "status.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void table_describe(struct bcd_table *table, const char *name, size_t rows)
{
    snprintf(table->name, sizeof table->name, "%s", name);
    table->rows = rows;
}

void table_axes(struct bcd_table *table, const char *x_label, const char *y_label)
{
    snprintf(table->x_label, sizeof table->x_label, "%s", x_label);
    snprintf(table->y_label, sizeof table->y_label, "%s", y_label);
}

static struct bcd_column *next_column(struct bcd_table *table, const char *name,
                                      enum bcd_role role)
{
    assert(table->columns < BCD_COLUMNS_MAX);
    struct bcd_column *column = &table->column[table->columns++];
    *column = (struct bcd_column){.role = role};
    snprintf(column->name, sizeof column->name, "%s", name);
    return column;
}

double *table_add(struct bcd_table *table, const char *name, enum bcd_role role)
{
    struct bcd_column *column = next_column(table, name, role);
    column->values = calloc(table->rows ? table->rows : 1, sizeof *column->values);
    return column->values;
}

enum bcd_status table_add_centres(struct bcd_table *table, const char *name, double range)
{
    double *x = table_add(table, name, BCD_ROLE_X);
    if (!x)
        return BCD_NO_MEMORY;
    for (size_t i = 0; i < table->rows; i++)
        x[i] = ((double)i + 0.5) * range / (double)table->rows;
    return BCD_OK;
}

void table_add_absent(struct bcd_table *table, const char *name, enum bcd_role role,
                      const char *reason)
{
    struct bcd_column *column = next_column(table, name, role);
    snprintf(column->reason, sizeof column->reason, "%s", reason);
}

void table_make_absent(struct bcd_table *table, enum bcd_role role, const char *reason)
{
    for (size_t i = 0; i < table->columns; i++) {
        struct bcd_column *column = &table->column[i];
        if (column->role != role)
            continue;
        free(column->values);
        column->values = NULL;
        snprintf(column->reason, sizeof column->reason, "%s", reason);
        return;
    }
}

static struct bcd_note *next_note(struct bcd_table *table, const char *name)
{
    assert(table->notes < BCD_NOTES_MAX);
    struct bcd_note *note = &table->note[table->notes++];
    *note = (struct bcd_note){.number = NAN};
    snprintf(note->name, sizeof note->name, "%s", name);
    return note;
}

void table_note_text(struct bcd_table *table, const char *name, const char *text)
{
    snprintf(next_note(table, name)->text, sizeof table->note[0].text, "%s", text);
}

void table_note_number(struct bcd_table *table, const char *name, double number)
{
    next_note(table, name)->number = number;
}

enum bcd_status table_add_moments(struct bcd_table *table, const char *name,
                                  const struct moments *moments)
{
    assert(table->rows <= moments->count);
    double *mean = table_add(table, name, BCD_ROLE_VALUE);
    double *error = table_add(table, "stderr", BCD_ROLE_STDERR);
    if (!mean || !error)
        return BCD_NO_MEMORY;
    for (size_t i = 0; i < table->rows; i++) {
        double n = moments->samples[i];
        mean[i] = n > 0 ? moments->mean[i] : NAN;
        error[i] = n > 1 ? sqrt(moments->square[i] / (n * (n - 1))) : NAN;
    }
    return BCD_OK;
}

const struct bcd_column *bcd_table_column(const struct bcd_table *table, enum bcd_role role)
{
    for (size_t i = 0; i < table->columns; i++)
        if (table->column[i].role == role)
            return &table->column[i];
    return NULL;
}

void bcd_table_free(struct bcd_table *table)
{
    if (!table)
        return;
    for (size_t i = 0; i < table->columns; i++)
        free(table->column[i].values);
    free(table);
}

/* ------------------------------------------------------------------- bytes */
/* The struct as it stands (fixed-size members, little-endian, pointers cleared), then the values of
 * the columns that are there. BLOB_TABLE's version rises with struct bcd_table. */

static size_t value_bytes(const struct bcd_table *table)
{
    size_t present = 0;
    for (size_t i = 0; i < table->columns; i++)
        present += table->column[i].values != NULL;
    return present * table->rows * sizeof(double);
}

size_t bcd_table_size(const struct bcd_table *table)
{
    return BLOB_HEADER_SIZE + sizeof *table + value_bytes(table);
}

void bcd_table_save(const struct bcd_table *table, void *bytes)
{
    /* Presence is kept in place of addresses. */
    unsigned char *body = (unsigned char *)bytes + BLOB_HEADER_SIZE;
    memcpy(body, table, sizeof *table);
    for (size_t i = 0; i < BCD_COLUMNS_MAX; i++) {
        uintptr_t present = i < table->columns && table->column[i].values != NULL;
        memcpy(body + offsetof(struct bcd_table, column) + i * sizeof(struct bcd_column) +
                   offsetof(struct bcd_column, values),
               &present, sizeof present);
    }
    unsigned char *to = body + sizeof *table;
    for (size_t i = 0; i < table->columns; i++) {
        if (!table->column[i].values)
            continue;
        memcpy(to, table->column[i].values, table->rows * sizeof(double));
        to += table->rows * sizeof(double);
    }
    blob_seal(bytes, BLOB_TABLE, 0, bcd_table_size(table));
}

enum bcd_status bcd_table_load(struct bcd_table **out, const void *bytes, size_t size,
                               struct bcd_error *error)
{
    enum bcd_status status = blob_check(bytes, BLOB_TABLE, 0, size, error);
    if (status)
        return status;
    const unsigned char *from = (const unsigned char *)bytes + BLOB_HEADER_SIZE;
    if (size < BLOB_HEADER_SIZE + sizeof(struct bcd_table))
        return error_set(error, BCD_CORRUPT, "", "the table is cut short");
    struct bcd_table *table = malloc(sizeof *table);
    if (!table)
        return error_set(error, BCD_NO_MEMORY, "", "no memory for a table");
    memcpy(table, from, sizeof *table);
    from += sizeof *table;
    size_t columns = table->columns, left = size - BLOB_HEADER_SIZE - sizeof *table;
    table->columns = 0; /* rises as columns become ours to free */
    if (columns > BCD_COLUMNS_MAX || table->notes > BCD_NOTES_MAX ||
        table->rows > SIZE_MAX / sizeof(double))
        goto corrupt;
    for (size_t i = 0; i < columns; i++) {
        bool present = table->column[i].values != NULL;
        table->column[i].values = NULL;
        table->columns++;
        if (!present)
            continue;
        size_t wanted = table->rows * sizeof(double);
        if (wanted > left)
            goto corrupt;
        table->column[i].values = malloc(wanted ? wanted : 1);
        if (!table->column[i].values) {
            bcd_table_free(table);
            return error_set(error, BCD_NO_MEMORY, "", "no memory for a table");
        }
        memcpy(table->column[i].values, from, wanted);
        from += wanted;
        left -= wanted;
    }
    if (left == 0) {
        *out = table;
        return BCD_OK;
    }
corrupt:
    bcd_table_free(table);
    return error_set(error, BCD_CORRUPT, "", "the table's shape does not fit its size");
}
