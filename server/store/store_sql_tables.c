/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sql_tables.c - see store_sql_tables.h.
 *
 * In an extension every function of SQLite is reached through a table that the loading program
 * hands over; linked into a program they are called as they are (SQLITE_CORE). */
#ifndef BCD_SQLITE_EXTENSION
#define SQLITE_CORE 1
#endif
#include <sqlite3ext.h>
SQLITE_EXTENSION_INIT1

#include "store_sql_tables.h"

#include "sample.h"
#include "store_sql_view.h"
#include "text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS_MAX = BCD_COLUMNS_MAX + 2, OF_NOTES = -1, NOTE_COLUMNS = 4 };
enum plan { PLAN_ALL, PLAN_JOB }; /* idxNum: one job, or whatever there is */

/* One observable, or (observable == "") the notes of all. */
struct shape {
    char observable[32];
    size_t columns;
    char column[COLUMNS_MAX][32];
};

struct results_table {
    sqlite3_vtab base;
    sqlite3 *db;
    const struct shape *shape;
};

struct results_cursor {
    sqlite3_vtab_cursor base;
    sqlite3_stmt *jobs;                           /* id, bytes of the tables that are wanted */
    struct bcd_table *table;                      /* the one in turn; NULL = at the end */
    const struct bcd_column *column[COLUMNS_MAX]; /* of it, in the order of the shape */
    size_t row;
    sqlite3_int64 passed; /* rows */
};

static bool of_notes(const struct results_table *table)
{
    return !table->shape->observable[0];
}

/* ------------------------------------------------------------------- tables */

static int connect(sqlite3 *db, void *context, int argc, const char *const *argv,
                   sqlite3_vtab **vtab, char **error)
{
    const struct shape *shape = context;
    struct results_table *table = sqlite3_malloc64(sizeof *table);
    struct text sql = {0};
    char *declaration;
    int code;

    (void)argc, (void)argv, (void)error;
    text_add(&sql, "CREATE TABLE results (");
    for (size_t i = 0; i < shape->columns; i++)
        text_add(&sql, "\"%s\", ", shape->column[i]);
    text_add(&sql, "job HIDDEN)");
    declaration = text_take(&sql);
    code = table && declaration ? sqlite3_declare_vtab(db, declaration) : SQLITE_NOMEM;
    free(declaration);
    if (code != SQLITE_OK) {
        sqlite3_free(table);
        return code;
    }
    sqlite3_vtab_config(db, SQLITE_VTAB_INNOCUOUS);
    *table = (struct results_table){.db = db, .shape = shape};
    *vtab = &table->base;
    return SQLITE_OK;
}

static int disconnect(sqlite3_vtab *vtab)
{
    sqlite3_free(vtab);
    return SQLITE_OK;
}

/* With the job known it is one lookup. A join that has not got to the job yet is refused, so that
 * SQLite turns it round. */
static int best_index(sqlite3_vtab *vtab, struct sqlite3_index_info *info)
{
    const struct results_table *table = (const struct results_table *)vtab;
    bool unusable = false;

    info->idxNum = PLAN_ALL;
    info->estimatedCost = 1e9;
    info->estimatedRows = 1000000;
    for (int i = 0; i < info->nConstraint; i++) {
        if (info->aConstraint[i].iColumn != (int)table->shape->columns ||
            info->aConstraint[i].op != SQLITE_INDEX_CONSTRAINT_EQ)
            continue;
        if (!info->aConstraint[i].usable) {
            unusable = true;
            continue;
        }
        info->aConstraintUsage[i].argvIndex = 1;
        info->aConstraintUsage[i].omit = 1;
        info->idxNum = PLAN_JOB;
        info->estimatedCost = 100;
        info->estimatedRows = 50;
        break;
    }
    return unusable && info->idxNum == PLAN_ALL ? SQLITE_CONSTRAINT : SQLITE_OK;
}

/* -------------------------------------------------------------------- rows */

static int open_cursor(sqlite3_vtab *vtab, sqlite3_vtab_cursor **cursor)
{
    struct results_cursor *made = sqlite3_malloc64(sizeof *made);

    (void)vtab;
    if (!made)
        return SQLITE_NOMEM;
    *made = (struct results_cursor){0};
    *cursor = &made->base;
    return SQLITE_OK;
}

static int close_cursor(sqlite3_vtab_cursor *base)
{
    struct results_cursor *cursor = (struct results_cursor *)base;

    bcd_table_free(cursor->table);
    sqlite3_finalize(cursor->jobs);
    sqlite3_free(cursor);
    return SQLITE_OK;
}

static size_t rows_of(const struct results_cursor *cursor, const struct bcd_table *table)
{
    return of_notes((const struct results_table *)cursor->base.pVtab) ? table->notes : table->rows;
}

/* Tables of other versions may have other columns: they are told by their names. */
static void match_columns(struct results_cursor *cursor)
{
    const struct shape *shape = ((const struct results_table *)cursor->base.pVtab)->shape;
    const struct bcd_table *table = cursor->table;

    for (size_t i = 0; i < shape->columns; i++) {
        cursor->column[i] = NULL;
        for (size_t k = 0; k < table->columns; k++)
            if (strcmp(table->column[k].name, shape->column[i]) == 0)
                cursor->column[i] = &table->column[k];
    }
}

/* The next table that has rows. */
static int next_table(struct results_cursor *cursor)
{
    int code;

    bcd_table_free(cursor->table);
    cursor->table = NULL;
    cursor->row = 0;
    while ((code = sqlite3_step(cursor->jobs)) == SQLITE_ROW) {
        if (bcd_table_load(&cursor->table, sqlite3_column_blob(cursor->jobs, 1),
                           (size_t)sqlite3_column_bytes(cursor->jobs, 1), NULL) != BCD_OK) {
            cursor->base.pVtab->zErrMsg =
                sqlite3_mprintf("the result of job %s is damaged",
                                (const char *)sqlite3_column_text(cursor->jobs, 0));
            return SQLITE_CORRUPT_VTAB;
        }
        if (rows_of(cursor, cursor->table) > 0) {
            match_columns(cursor);
            return SQLITE_OK;
        }
        bcd_table_free(cursor->table);
        cursor->table = NULL;
    }
    return code == SQLITE_DONE ? SQLITE_OK : code;
}

static int filter(sqlite3_vtab_cursor *base, int plan, const char *name, int argc,
                  sqlite3_value **argv)
{
    struct results_cursor *cursor = (struct results_cursor *)base;
    const struct results_table *table = (const struct results_table *)base->pVtab;
    char *sql =
        sqlite3_mprintf("SELECT j.id, r.bytes FROM main.results r JOIN main.jobs j ON j.seq = r.job"
                        " WHERE %s%s ORDER BY r.job, r.position",
                        of_notes(table) ? "?2 IS ?2" : "r.observable = ?2",
                        plan != PLAN_JOB ? ""
                        : sqlite3_value_type(argv[0]) == SQLITE_TEXT
                            ? " AND r.job = (SELECT seq FROM main.jobs WHERE id = ?1)"
                            : " AND r.job = ?1");
    int code = sql ? SQLITE_OK : SQLITE_NOMEM;

    (void)name, (void)argc;
    sqlite3_finalize(cursor->jobs);
    cursor->jobs = NULL;
    cursor->passed = 0;
    if (code == SQLITE_OK)
        code = sqlite3_prepare_v2(table->db, sql, -1, &cursor->jobs, NULL);
    if (code == SQLITE_OK && plan == PLAN_JOB)
        code = sqlite3_bind_value(cursor->jobs, 1, argv[0]);
    if (code == SQLITE_OK)
        code = sqlite3_bind_text(cursor->jobs, 2, table->shape->observable, -1, SQLITE_STATIC);
    sqlite3_free(sql);
    if (code != SQLITE_OK) {
        base->pVtab->zErrMsg = sqlite3_mprintf("%s", sqlite3_errmsg(table->db));
        return code;
    }
    return next_table(cursor);
}

static int next(sqlite3_vtab_cursor *base)
{
    struct results_cursor *cursor = (struct results_cursor *)base;

    cursor->passed++;
    return ++cursor->row < rows_of(cursor, cursor->table) ? SQLITE_OK : next_table(cursor);
}

static int eof(sqlite3_vtab_cursor *base)
{
    return ((struct results_cursor *)base)->table == NULL;
}

static void put_note(const struct results_cursor *cursor, sqlite3_context *context, int i)
{
    const struct bcd_note *note = &cursor->table->note[cursor->row];

    if (i == 0)
        sqlite3_result_text(context, cursor->table->name, -1, SQLITE_TRANSIENT);
    else if (i == 1)
        sqlite3_result_text(context, note->name, -1, SQLITE_TRANSIENT);
    else if (i == 2 && !note->text[0])
        sqlite3_result_double(context, note->number);
    else if (i == 3 && note->text[0])
        sqlite3_result_text(context, note->text, -1, SQLITE_TRANSIENT);
}

/* What is not there is NULL, and so is NaN to SQLite. */
static int column(sqlite3_vtab_cursor *base, sqlite3_context *context, int i)
{
    const struct results_cursor *cursor = (const struct results_cursor *)base;
    const struct results_table *table = (const struct results_table *)base->pVtab;

    if (i == (int)table->shape->columns)
        sqlite3_result_value(context, sqlite3_column_value(cursor->jobs, 0));
    else if (of_notes(table))
        put_note(cursor, context, i);
    else if (cursor->column[i] && cursor->column[i]->values)
        sqlite3_result_double(context, cursor->column[i]->values[cursor->row]);
    return SQLITE_OK;
}

static int rowid(sqlite3_vtab_cursor *base, sqlite3_int64 *id)
{
    *id = ((struct results_cursor *)base)->passed;
    return SQLITE_OK;
}

/* Without xCreate a table exists under its own name, as a function of its hidden column. */
static const sqlite3_module module = {
    .xConnect = connect,
    .xBestIndex = best_index,
    .xDisconnect = disconnect,
    .xOpen = open_cursor,
    .xClose = close_cursor,
    .xFilter = filter,
    .xNext = next,
    .xEof = eof,
    .xColumn = column,
    .xRowid = rowid,
};

/* ------------------------------------------------------------------ shapes */

static void add_column(struct shape *shape, const char *name)
{
    for (size_t i = 0; i < shape->columns; i++)
        if (strcmp(shape->column[i], name) == 0)
            return;
    if (shape->columns < COLUMNS_MAX)
        memcpy(shape->column[shape->columns++], name, strlen(name) + 1);
}

/* The columns of an empty table, and "z", which stands beside a theory. */
static void shape_of(const struct bcd_table *table, struct shape *shape)
{
    memcpy(shape->observable, table->name, sizeof shape->observable);
    for (size_t i = 0; i < table->columns; i++)
        add_column(shape, table->column[i].name);
    for (size_t i = 0; i < table->columns; i++)
        if (table->column[i].role == BCD_ROLE_THEORY)
            add_column(shape, "z");
}

static int create(sqlite3 *db, const struct shape *shape)
{
    struct shape *kept = malloc(sizeof *kept);

    if (!kept)
        return SQLITE_NOMEM;
    *kept = *shape;
    return sqlite3_create_module_v2(db, shape->observable[0] ? shape->observable : "notes", &module,
                                    kept, free);
}

int store_sql_tables(sqlite3 *db)
{
    struct shape notes = {"", NOTE_COLUMNS, {"observable", "name", "value", "text"}};
    struct sample sample;
    int code = sample_init(&sample) ? SQLITE_OK : SQLITE_NOMEM;

    if (code != SQLITE_OK)
        return code;
    for (size_t i = 0; bcd_catalogue(BCD_SLOT_OBSERVABLE, i) && code == SQLITE_OK; i++) {
        struct bcd_table *table = sample_table(&sample, i);
        struct shape shape = {0};

        if (table)
            shape_of(table, &shape);
        code = table ? create(db, &shape) : SQLITE_NOMEM;
        bcd_table_free(table);
    }
    if (code == SQLITE_OK)
        code = create(db, &notes);
    if (code == SQLITE_OK)
        code = store_sql_view(db, sample.scene);
    sample_fini(&sample);
    return code;
}

#ifdef BCD_SQLITE_EXTENSION
/* What `.load bcd_sqlite` and sqlite3_load_extension() look for. */
__attribute__((visibility("default"))) int sqlite3_extension_init(sqlite3 *db, char **error,
                                                                  const sqlite3_api_routines *api);

int sqlite3_extension_init(sqlite3 *db, char **error, const sqlite3_api_routines *api)
{
    int code;

    SQLITE_EXTENSION_INIT2(api)
    code = store_sql_tables(db);
    if (code != SQLITE_OK)
        *error = sqlite3_mprintf("bcd_sqlite: %s", sqlite3_errstr(code));
    return code;
}
#endif
