/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_news.c - see store_news.h. */
#include "store_news.h"

#include "store_segment.h"
#include "text.h"

#include "bcd.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The scalars of one job, by one statement. */
struct putting {
    sqlite3 *db;
    struct stmt row;
    int64_t seq;
    struct text scratch;
};

static struct putting putting_init(sqlite3 *db, int64_t seq)
{
    return (struct putting){
        .db = db,
        .row = stmt_init(db, "INSERT OR REPLACE INTO job_news (key, job, value)"
                             " SELECT id, :job, :value FROM job_keys WHERE path = :path"),
        .seq = seq};
}

static enum store_status putting_fini(struct putting *putting)
{
    free(text_take(&putting->scratch));
    return stmt_fini(&putting->row);
}

static void bind_scalar(struct stmt *row, const struct scalar *value, struct text *copy)
{
    if (value->type == SCALAR_INTEGER)
        stmt_bind_integer(row, ":value", value->integer);
    else if (value->type == SCALAR_REAL)
        stmt_bind_number(row, ":value", value->real);
    else if (text_add_bytes(copy, value->text, value->length), copy->bytes)
        stmt_bind_text(row, ":value", copy->bytes);
}

static void put(struct putting *putting, const char *path, const struct scalar *value)
{
    struct stmt *row = &putting->row;
    struct text copy = {0};
    int64_t key = 0;

    if (value->type == SCALAR_NONE)
        return;
    for (int tries = 0; tries < 2 && !row->status; tries++) {
        stmt_again(row);
        stmt_bind_text(row, ":path", path);
        stmt_bind_integer(row, ":job", putting->seq);
        bind_scalar(row, value, &copy);
        stmt_step(row);
        if (row->status || sqlite3_changes(putting->db) > 0)
            break;
        row->status = store_segment_key(putting->db, path, &key); /* the first of its kind */
        copy.size = 0;
    }
    stmt_again(row);
    free(text_take(&copy));
}

enum store_status store_news_result(sqlite3 *db, int64_t seq, const void *bytes, size_t size)
{
    struct bcd_table *table = NULL;
    struct putting putting;
    char path[SCALAR_PATH_SIZE];

    if (bcd_table_load(&table, bytes, size, NULL) != BCD_OK)
        return STORE_OK;
    putting = putting_init(db, seq);
    for (size_t i = 0; table->scalar && i < table->columns; i++) {
        const struct bcd_column *column = &table->column[i];
        struct scalar value = {.type = SCALAR_NONE};

        if (column->values && table->rows > 0)
            value = scalar_real(column->values[0]);
        snprintf(path, sizeof path, "results.%s.%s", table->name, column->name);
        put(&putting, path, &value);
    }
    for (size_t i = 0; i < table->notes; i++) {
        const struct bcd_note *note = &table->note[i];
        struct scalar value = scalar_real(note->number);

        snprintf(path, sizeof path, "results.%s.%s", table->name, note->name);
        if (!note->text[0])
            put(&putting, path, &value);
    }
    bcd_table_free(table);
    return putting_fini(&putting);
}

static void put_token(void *context, const char *path, const char *token, size_t length)
{
    struct putting *putting = context;
    struct scalar value = scalar_read(token, length, &putting->scratch);

    put(putting, path, &value);
}

enum store_status store_news_outcome(sqlite3 *db, int64_t seq, const char *json)
{
    struct putting putting = putting_init(db, seq);

    scalar_walk(json, "outcome.", put_token, &putting);
    return putting_fini(&putting);
}

struct scalar store_news_scalar(sqlite3_stmt *row, int column)
{
    switch (sqlite3_column_type(row, column)) {
    case SQLITE_INTEGER:
        return scalar_integer(sqlite3_column_int64(row, column));
    case SQLITE_FLOAT:
        return scalar_real(sqlite3_column_double(row, column));
    case SQLITE_TEXT:
        return scalar_text((const char *)sqlite3_column_text(row, column),
                           (size_t)sqlite3_column_bytes(row, column));
    default:
        return (struct scalar){.type = SCALAR_NONE};
    }
}

/* ------------------------------------------------------------------- reading */

static struct scalar keep_text(struct stmt *row, struct scalar value)
{
    char *copy = value.type == SCALAR_TEXT ? malloc(value.length + 1) : NULL;

    if (value.type == SCALAR_TEXT && !copy) {
        row->status = store_fault(row->db, SQLITE_NOMEM, row->sql);
        value.type = SCALAR_NONE;
    } else if (copy) {
        memcpy(copy, value.text, value.length);
        value.text = copy;
    }
    return value;
}

enum store_status store_news_load(sqlite3 *db, int64_t key, struct news_list *list)
{
    struct stmt row =
        stmt_init(db, "SELECT job, value FROM job_news WHERE key = :key ORDER BY job");

    stmt_bind_integer(&row, ":key", key);
    while (stmt_step(&row)) {
        list->items = stmt_room(&row, list->items, list->count, sizeof *list->items);
        if (!row.status)
            list->items[list->count++] = (struct news){
                stmt_integer(&row, 0), keep_text(&row, store_news_scalar(row.handle, 1))};
    }
    return stmt_fini(&row);
}

void store_news_free(struct news_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        if (list->items[i].value.type == SCALAR_TEXT)
            free((char *)list->items[i].value.text);
    free(list->items);
    *list = (struct news_list){0};
}

const struct news *store_news_of(const struct news_list *list, int64_t segment, size_t *count)
{
    int64_t first = segment << SEGMENT_BITS;
    size_t low = 0, high = list->count;

    while (low < high) {
        size_t middle = low + (high - low) / 2;

        if (list->items[middle].job < first)
            low = middle + 1;
        else
            high = middle;
    }
    for (*count = 0;
         low + *count < list->count && list->items[low + *count].job < first + SEGMENT_JOBS;)
        ++*count;
    return list->items ? list->items + low : NULL;
}

/* ------------------------------------------------------------------- old jobs */

static enum store_status index_results(sqlite3 *db)
{
    struct stmt row = stmt_init(db, "SELECT job, bytes FROM results WHERE NOT EXISTS"
                                    " (SELECT 1 FROM job_keys WHERE path >= 'results.'"
                                    " AND path < 'results/')");
    enum store_status status = STORE_OK;

    while (status == STORE_OK && stmt_step(&row))
        status = store_news_result(db, stmt_integer(&row, 0), sqlite3_column_blob(row.handle, 1),
                                   (size_t)sqlite3_column_bytes(row.handle, 1));
    row.status = row.status ? row.status : status;
    return stmt_fini(&row);
}

/* A segment that is not sealed folds its news when it is. */
static enum store_status fold_if_sealed(sqlite3 *db, int64_t segment)
{
    struct stmt row = stmt_init(db, "SELECT 1 FROM job_segments WHERE segment = :segment");
    bool sealed;
    enum store_status status;

    stmt_bind_integer(&row, ":segment", segment);
    sealed = stmt_step(&row);
    status = stmt_fini(&row);
    return status || !sealed ? status : store_segment_fold(db, segment);
}

/* Segment by segment, so that there are never many news. */
static enum store_status index_outcomes(sqlite3 *db)
{
    struct stmt row = stmt_init(db, "SELECT seq, outcome FROM jobs WHERE state = 'done'"
                                    " AND outcome IS NOT NULL AND NOT EXISTS"
                                    " (SELECT 1 FROM job_keys WHERE path >= 'outcome.'"
                                    " AND path < 'outcome/') ORDER BY seq");
    int64_t segment = -1;
    enum store_status status = STORE_OK;

    while (status == STORE_OK && stmt_step(&row)) {
        int64_t seq = stmt_integer(&row, 0);
        const char *outcome = (const char *)sqlite3_column_text(row.handle, 1);

        if (segment >= 0 && seq >> SEGMENT_BITS != segment)
            status = fold_if_sealed(db, segment);
        segment = seq >> SEGMENT_BITS;
        if (status == STORE_OK && outcome)
            status = store_news_outcome(db, seq, outcome);
    }
    if (status == STORE_OK && segment >= 0)
        status = fold_if_sealed(db, segment);
    row.status = row.status ? row.status : status;
    return stmt_fini(&row);
}

enum store_status store_news_index_old(sqlite3 *db)
{
    struct stmt row =
        stmt_init(db, "SELECT 1 FROM pragma_table_info('jobs') WHERE name = 'outcome'");
    bool outcomes = stmt_step(&row); /* since 006; this may be in between */
    enum store_status status = stmt_fini(&row);

    if (status == STORE_OK)
        status = index_results(db);
    return status || !outcomes ? status : index_outcomes(db);
}
