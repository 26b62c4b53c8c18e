/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_npz.h"
#include "zip_stored.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEAD_SIZE = 128, STATE_SIZE = 9, CELL_SIZE_MAX = 512 };

/* A point in the first pass: jobs may end, and be tried again, while the archive is written, which
 * shows all of them as they were then. */
struct seen {
    char job[JOB_ID_SIZE];
    unsigned char state;
    bool table;
};

/* A pass writes one array: those before the columns are told from the points alone. */
struct sweep_npz {
    const struct sweep *sweep;
    struct zip zip;
    size_t points, at; /* how many; the one that comes next */
    struct seen *seen; /* [points] */
    size_t rows;       /* of the longest table */
    bool scalar;       /* all tables are */
    struct sweep_columns columns;
    size_t pass; /* 0: looks; 1: job; 2: state; then axes; then columns */
    size_t axes;
    size_t cell; /* bytes of a text of the array in progress; 0 = numbers */
    bool whole;  /* its numbers are integers */
};

static void look(struct sweep_npz *npz, const struct sweep_point *point,
                 const struct bcd_table *table);
static void begin_array(struct sweep_npz *npz, struct text *text);
static size_t axis_cell(const struct sweep_npz *npz, size_t axis, bool *whole);
static void array_name(const struct sweep_npz *npz, char name[ZIP_NAME_SIZE]);
static void dotted(const char *pointer, char name[ZIP_NAME_SIZE]);
static void add_text(struct sweep_npz *npz, struct text *text, const char *string);
static void add_axis(struct sweep_npz *npz, struct text *text, const struct sweep_point *point);
static void add_column(struct sweep_npz *npz, struct text *text, const struct bcd_table *table);

struct sweep_npz *sweep_npz_create(const struct sweep *sweep, size_t points)
{
    struct sweep_npz *npz = calloc(1, sizeof(*npz));
    if (!npz)
        return NULL;
    npz->sweep = sweep;
    npz->points = points;
    npz->scalar = true;
    npz->seen = calloc(points + 1, sizeof(*npz->seen));
    while (sweep_axis(sweep, npz->axes))
        npz->axes++;
    if (npz->seen)
        return npz;
    sweep_npz_free(npz);
    return NULL;
}

void sweep_npz_free(struct sweep_npz *npz)
{
    if (npz)
        free(npz->seen);
    free(npz);
}

void sweep_npz_add(struct sweep_npz *npz, struct text *text, const struct sweep_point *point,
                   const struct bcd_table *table)
{
    if (npz->at >= npz->points)
        return; /* it came after the archive was begun */
    if (npz->pass == 0)
        look(npz, point, table);
    else if (npz->pass == 1)
        add_text(npz, text, npz->seen[npz->at].job);
    else if (npz->pass == 2)
        add_text(npz, text, job_state_name((enum job_state)npz->seen[npz->at].state));
    else if (npz->pass < 3 + npz->axes)
        add_axis(npz, text, point);
    else
        add_column(npz, text, npz->seen[npz->at].table ? table : NULL);
    npz->at++;
}

void sweep_npz_end_pass(struct sweep_npz *npz, struct text *text)
{
    if (npz->pass == 0)
        npz->points = npz->at; /* there cannot be fewer later */
    else
        zip_end_file(&npz->zip, text);
    npz->pass++;
    npz->at = 0;
    if (sweep_npz_ended(npz))
        zip_end(&npz->zip, text);
    else
        begin_array(npz, text);
}

bool sweep_npz_ended(const struct sweep_npz *npz)
{
    return npz->pass >= 3 + npz->axes + npz->columns.count;
}

static void look(struct sweep_npz *npz, const struct sweep_point *point,
                 const struct bcd_table *table)
{
    struct seen *seen = &npz->seen[npz->at];
    memcpy(seen->job, point->job, sizeof(seen->job));
    seen->state = (unsigned char)point->state;
    seen->table = table != NULL;
    if (!table)
        return;
    if (npz->columns.count == 0)
        for (; npz->columns.count < table->columns; npz->columns.count++)
            snprintf(npz->columns.name[npz->columns.count], sizeof(npz->columns.name[0]), "%s",
                     table->column[npz->columns.count].name);
    npz->rows = table->rows > npz->rows ? table->rows : npz->rows;
    npz->scalar = npz->scalar && table->scalar;
}

/* The file's and the array's header: magic, version, length, a Python literal, blanks up to a
 * newline. */
static void begin_array(struct sweep_npz *npz, struct text *text)
{
    char name[ZIP_NAME_SIZE], head[HEAD_SIZE + 1], type[24] = "<f8", shape[64];
    size_t values = npz->points, first_column = 3 + npz->axes;
    bool column = npz->pass >= first_column;
    npz->whole = false;
    npz->cell = npz->pass == 1   ? JOB_ID_SIZE - 1
                : npz->pass == 2 ? STATE_SIZE
                : column         ? 0
                                 : axis_cell(npz, npz->pass - 3, &npz->whole);
    if (npz->cell > 0)
        snprintf(type, sizeof(type), "<U%zu", npz->cell);
    else if (npz->whole)
        snprintf(type, sizeof(type), "<i8");
    snprintf(shape, sizeof(shape), "(%zu,)", npz->points);
    if (column && !npz->scalar) {
        snprintf(shape, sizeof(shape), "(%zu, %zu)", npz->points, npz->rows);
        values *= npz->rows;
    }
    array_name(npz, name);
    int used =
        snprintf(head, sizeof(head), "%.10s{'descr': '%s', 'fortran_order': False, 'shape': %s, }",
                 "\x93NUMPY\x01..v", type, shape);
    memcpy(head + 6, "\x01\x00\x76\x00", 4); /* 118 bytes follow */
    memset(head + used, ' ', (size_t)(HEAD_SIZE - 1 - used));
    head[HEAD_SIZE - 1] = '\n';
    zip_begin_file(&npz->zip, text, name,
                   HEAD_SIZE + (uint64_t)values * (npz->cell > 0 ? 4 * npz->cell : 8));
    zip_add(&npz->zip, text, head, HEAD_SIZE);
}

/* 0 for numbers, else the length of the longest value as a text. */
static size_t axis_cell(const struct sweep_npz *npz, size_t axis, bool *whole)
{
    struct text value = {0};
    size_t longest = 0;
    bool numbers = true;
    *whole = true;
    for (size_t i = 0; sweep_add_value(&value, npz->sweep, axis, i); i++) {
        bool integer;
        numbers = numbers && !isnan(sweep_number(npz->sweep, axis, i, &integer));
        *whole = *whole && integer;
        longest = value.size > longest ? value.size : longest;
        value.size = 0;
    }
    free(value.bytes);
    *whole = *whole && numbers;
    return numbers ? 0 : longest > CELL_SIZE_MAX ? CELL_SIZE_MAX : longest;
}

static void array_name(const struct sweep_npz *npz, char name[ZIP_NAME_SIZE])
{
    char axis[ZIP_NAME_SIZE];
    size_t column = npz->pass - 3 - npz->axes;
    if (npz->pass < 3) {
        snprintf(name, ZIP_NAME_SIZE, "%s.npy", npz->pass == 1 ? "job" : "state");
    } else if (npz->pass < 3 + npz->axes) {
        dotted(sweep_axis(npz->sweep, npz->pass - 3), axis);
        snprintf(name, ZIP_NAME_SIZE, "%.70s.npy", axis);
    } else {
        const char *stem = npz->columns.name[column];
        bool taken = false; /* by an axis: "time" of trajectories */
        for (size_t a = 0; a < npz->axes; a++) {
            dotted(sweep_axis(npz->sweep, a), axis);
            taken = taken || strcmp(axis, stem) == 0;
        }
        snprintf(name, ZIP_NAME_SIZE, "%.60s%s.npy", stem, taken ? "_column" : "");
    }
}

/* "/potential/amplitude" as "potential.amplitude". */
static void dotted(const char *pointer, char name[ZIP_NAME_SIZE])
{
    snprintf(name, ZIP_NAME_SIZE, "%s", pointer + 1);
    for (char *c = name; *c; c++)
        *c = *c == '/' ? '.' : *c;
}

/* Characters of four bytes, zeros behind. What is not ASCII becomes one for each of its bytes. */
static void add_text(struct sweep_npz *npz, struct text *text, const char *string)
{
    unsigned char cell[4 * CELL_SIZE_MAX] = {0};
    for (size_t i = 0; i < npz->cell && string[i]; i++)
        cell[4 * i] = (unsigned char)string[i];
    zip_add(&npz->zip, text, cell, 4 * npz->cell);
}

static void add_axis(struct sweep_npz *npz, struct text *text, const struct sweep_point *point)
{
    size_t at[SWEEP_AXES_MAX], axis = npz->pass - 3;
    struct text value = {0};
    if (!sweep_place_parse(npz->sweep, point->place, at)) {
        text->failed = true;
        return;
    }
    size_t i = at[sweep_axis_group(npz->sweep, axis)];
    double number = sweep_number(npz->sweep, axis, i, NULL);
    if (npz->cell > 0) {
        sweep_add_value(&value, npz->sweep, axis, i);
        const char *word = value.bytes ? value.bytes : "";
        bool quoted = word[0] == '"' && !strchr(word, '\\');
        if (quoted)
            value.bytes[value.size - 1] = '\0';
        add_text(npz, text, word + quoted);
        text->failed = text->failed || value.failed;
        free(value.bytes);
    } else if (npz->whole) {
        int64_t whole = (int64_t)number;
        zip_add(&npz->zip, text, &whole, sizeof(whole));
    } else {
        zip_add(&npz->zip, text, &number, sizeof(number));
    }
}

static void add_column(struct sweep_npz *npz, struct text *text, const struct bcd_table *table)
{
    const double none = NAN;
    const char *name = npz->columns.name[npz->pass - 3 - npz->axes];
    const struct bcd_column *column = table ? sweep_rows_column(table, name) : NULL;
    size_t rows = npz->scalar ? 1 : npz->rows, given = column ? table->rows : 0;
    given = given < rows ? given : rows;
    if (given > 0)
        zip_add(&npz->zip, text, column->values, given * sizeof(double));
    for (size_t row = given; row < rows; row++)
        zip_add(&npz->zip, text, &none, sizeof(none));
}
