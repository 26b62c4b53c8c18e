/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_incoming.c - see store_incoming.h. */
#include "store_incoming.h"

static const char pointer_type[] = "incoming";

enum {
    COLUMN_POINT,
    COLUMN_PLACE,
    COLUMN_JOB,
    COLUMN_SEQ,
    COLUMN_ID,
    COLUMN_HASH,
    COLUMN_CHUNKS,
    COLUMN_JOB_TEXT,
    COLUMN_DERIVED,
    COLUMN_CORE_SECONDS,
    COLUMN_BYTES,
    COLUMN_ROWS, /* hidden: the pointer */
};

struct incoming_cursor {
    sqlite3_vtab_cursor base;
    const struct incoming *rows;
    size_t at;
};

static int connect(sqlite3 *db, void *context, int argc, const char *const *argv,
                   sqlite3_vtab **vtab, char **error)
{
    sqlite3_vtab *table = sqlite3_malloc64(sizeof *table);
    int code =
        table ? sqlite3_declare_vtab(db, "CREATE TABLE incoming (point, place, job, seq, id, hash,"
                                         " chunks, job_text, derived, core_seconds, bytes,"
                                         " rows HIDDEN)")
              : SQLITE_NOMEM;

    (void)context, (void)argc, (void)argv, (void)error;
    if (code != SQLITE_OK) {
        sqlite3_free(table);
        return code;
    }
    sqlite3_vtab_config(db, SQLITE_VTAB_DIRECTONLY);
    *table = (sqlite3_vtab){0};
    *vtab = table;
    return SQLITE_OK;
}

static int disconnect(sqlite3_vtab *vtab)
{
    sqlite3_free(vtab);
    return SQLITE_OK;
}

/* Nothing but incoming(:rows) is known how to read. */
static int best_index(sqlite3_vtab *vtab, struct sqlite3_index_info *info)
{
    (void)vtab;
    info->estimatedCost = INCOMING_MAX;
    info->estimatedRows = INCOMING_MAX;
    for (int i = 0; i < info->nConstraint; i++) {
        if (info->aConstraint[i].iColumn != COLUMN_ROWS || !info->aConstraint[i].usable ||
            info->aConstraint[i].op != SQLITE_INDEX_CONSTRAINT_EQ)
            continue;
        info->aConstraintUsage[i].argvIndex = 1;
        info->aConstraintUsage[i].omit = 1;
        return SQLITE_OK;
    }
    return SQLITE_CONSTRAINT;
}

static int open_cursor(sqlite3_vtab *vtab, sqlite3_vtab_cursor **cursor)
{
    struct incoming_cursor *made = sqlite3_malloc64(sizeof *made);

    (void)vtab;
    if (!made)
        return SQLITE_NOMEM;
    *made = (struct incoming_cursor){0};
    *cursor = &made->base;
    return SQLITE_OK;
}

static int close_cursor(sqlite3_vtab_cursor *cursor)
{
    sqlite3_free(cursor);
    return SQLITE_OK;
}

static int filter(sqlite3_vtab_cursor *base, int plan, const char *name, int argc,
                  sqlite3_value **argv)
{
    struct incoming_cursor *cursor = (struct incoming_cursor *)base;

    (void)plan, (void)name, (void)argc;
    cursor->rows = sqlite3_value_pointer(argv[0], pointer_type); /* NULL of what is none */
    cursor->at = 0;
    return SQLITE_OK;
}

static int next(sqlite3_vtab_cursor *base)
{
    ((struct incoming_cursor *)base)->at++;
    return SQLITE_OK;
}

static int eof(sqlite3_vtab_cursor *base)
{
    const struct incoming_cursor *cursor = (const struct incoming_cursor *)base;

    return !cursor->rows || cursor->at >= cursor->rows->count;
}

static int column(sqlite3_vtab_cursor *base, sqlite3_context *context, int i)
{
    const struct incoming_cursor *cursor = (const struct incoming_cursor *)base;
    const struct incoming *rows = cursor->rows;
    const struct sweep_point_new *point = &rows->points[cursor->at];

    if (i == COLUMN_POINT)
        sqlite3_result_int64(context, rows->first_point + (int64_t)cursor->at);
    else if (i == COLUMN_PLACE)
        sqlite3_result_text(context, point->place, -1, SQLITE_STATIC);
    else if (i == COLUMN_JOB)
        sqlite3_result_int64(context, rows->jobs[cursor->at]);
    else if (i == COLUMN_SEQ)
        sqlite3_result_int64(context, rows->first_seq + (int64_t)cursor->at);
    else if (i == COLUMN_ID)
        sqlite3_result_text(context, rows->ids[cursor->at], -1, SQLITE_STATIC);
    else if (i == COLUMN_HASH)
        sqlite3_result_blob(context, point->job.hash, JOB_HASH_SIZE, SQLITE_STATIC);
    else if (i == COLUMN_CHUNKS)
        sqlite3_result_int64(context, point->job.chunks);
    else if (i == COLUMN_JOB_TEXT)
        sqlite3_result_text(context, point->job.job, -1, SQLITE_STATIC);
    else if (i == COLUMN_DERIVED)
        sqlite3_result_text(context, point->job.derived, -1, SQLITE_STATIC);
    else if (i == COLUMN_CORE_SECONDS)
        sqlite3_result_double(context, point->job.core_seconds);
    else if (i == COLUMN_BYTES)
        sqlite3_result_int64(context, (int64_t)point->job.bytes);
    return SQLITE_OK;
}

static int rowid(sqlite3_vtab_cursor *base, sqlite3_int64 *id)
{
    *id = (sqlite3_int64)((struct incoming_cursor *)base)->at;
    return SQLITE_OK;
}

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

int store_incoming_add(sqlite3 *db)
{
    return sqlite3_create_module_v2(db, pointer_type, &module, NULL, NULL);
}

void store_incoming_bind(struct stmt *stmt, struct incoming *incoming)
{
    int index = stmt->status ? 0 : sqlite3_bind_parameter_index(stmt->handle, ":rows");
    int code = index ? sqlite3_bind_pointer(stmt->handle, index, incoming, pointer_type, NULL)
                     : SQLITE_MISUSE;

    if (!stmt->status && code != SQLITE_OK)
        stmt->status = store_fault(stmt->db, code, stmt->sql);
}
