/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sql.c - see store_sql.h. */
#include "store_sql.h"

#include "limits.h"
#include "sample.h"
#include "store_internal.h"
#include "store_sql_tables.h"
#include "store_sql_view.h"
#include "text.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { OPCODES_PER_LOOK = 10000, BUSY_MS = 5000 };

struct asking {
    const struct sql_question *question;
    const struct sql_reader *reader;
    sqlite3 *db;
    struct timespec deadline;
    bool late;
    char *reason;
    size_t size;
};

static enum store_status explain(struct asking *asking, enum store_status status)
{
    if (asking->late) {
        snprintf(asking->reason, asking->size, "it takes longer than %g s",
                 asking->question->timeout_s);
        return STORE_FULL;
    }
    switch (sqlite3_errcode(asking->db)) {
    case SQLITE_NOMEM:
        snprintf(asking->reason, asking->size, "it needs more than %d bytes of memory",
                 LIMIT_SQL_HEAP_BYTES_MAX);
        return STORE_FULL;
    case SQLITE_TOOBIG:
        snprintf(asking->reason, asking->size, "one text or blob would be longer than %d bytes",
                 LIMIT_SQL_TEXT_BYTES_MAX);
        return STORE_FULL;
    default:
        snprintf(asking->reason, asking->size, "%s", sqlite3_errmsg(asking->db));
        return status;
    }
}

/* Reading, and nothing else: no other file, no change, not even of a setting. */
static int authorize(void *context, int action, const char *a, const char *b, const char *database,
                     const char *trigger)
{
    (void)context, (void)a, (void)database, (void)trigger;
    switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_RECURSIVE:
        return SQLITE_OK;
    case SQLITE_FUNCTION:
        return b && sqlite3_stricmp(b, "load_extension") == 0 ? SQLITE_DENY : SQLITE_OK;
    default:
        return SQLITE_DENY;
    }
}

static int look_at_clock(void *context)
{
    struct asking *asking = context;
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    asking->late =
        now.tv_sec > asking->deadline.tv_sec ||
        (now.tv_sec == asking->deadline.tv_sec && now.tv_nsec >= asking->deadline.tv_nsec);
    return asking->late;
}

static void set_deadline(struct asking *asking)
{
    double s = asking->question->timeout_s;

    clock_gettime(CLOCK_MONOTONIC, &asking->deadline);
    asking->deadline.tv_sec += (time_t)s;
    asking->deadline.tv_nsec += (long)(1e9 * (s - (double)(time_t)s));
    if (asking->deadline.tv_nsec >= 1000000000) {
        asking->deadline.tv_nsec -= 1000000000;
        asking->deadline.tv_sec++;
    }
    if (s > 0)
        sqlite3_progress_handler(asking->db, OPCODES_PER_LOOK, look_at_clock, asking);
}

/* The clock is looked at between steps; a single function must not be a long one, as far as that
 * can be had: LIKE still can. */
static void set_limits(sqlite3 *db)
{
    sqlite3_limit(db, SQLITE_LIMIT_LENGTH, LIMIT_SQL_TEXT_BYTES_MAX);
    sqlite3_limit(db, SQLITE_LIMIT_LIKE_PATTERN_LENGTH, LIMIT_SQL_PATTERN_BYTES_MAX);
    sqlite3_hard_heap_limit64(LIMIT_SQL_HEAP_BYTES_MAX);
}

/* A table comes to life when it is first looked at, in a way that the authorizer would not allow.
 */
static void touch_tables(sqlite3 *db)
{
    const struct bcd_part *part;
    char sql[96];

    for (size_t i = 0; (part = bcd_catalogue(BCD_SLOT_OBSERVABLE, i)); i++) {
        snprintf(sql, sizeof sql, "SELECT 1 FROM \"%s\" LIMIT 0", part->name);
        sqlite3_exec(db, sql, NULL, NULL, NULL);
    }
    sqlite3_exec(db, "SELECT 1 FROM notes LIMIT 0", NULL, NULL, NULL);
}

static enum store_status open_file(struct asking *asking)
{
    const char *file = asking->question->file;
    int64_t application = 0;
    struct stmt row;

    if (access(file, R_OK) != 0) {
        snprintf(asking->reason, asking->size, "%s: there is no such file to be read", file);
        return STORE_NOT_FOUND;
    }
    if (sqlite3_open_v2(file, &asking->db, SQLITE_OPEN_READONLY, NULL) != SQLITE_OK)
        return explain(asking, STORE_BROKEN);
    set_limits(asking->db);
    sqlite3_busy_timeout(asking->db, BUSY_MS);
    sqlite3_db_config(asking->db, SQLITE_DBCONFIG_DEFENSIVE, 1, (int *)NULL);
    sqlite3_db_config(asking->db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, (int *)NULL);
    if (sqlite3_exec(asking->db, "PRAGMA temp_store = MEMORY; SELECT 1 FROM sqlite_schema", NULL,
                     NULL, NULL) != SQLITE_OK)
        return explain(asking, STORE_BROKEN);
    row = stmt_init(asking->db, "PRAGMA application_id");
    if (stmt_step(&row))
        application = stmt_integer(&row, 0);
    if (stmt_fini(&row) || application != STORE_APPLICATION_ID) {
        snprintf(asking->reason, asking->size, "%s: no database of bcdd", file);
        return STORE_BROKEN;
    }
    if (store_sql_tables(asking->db) != SQLITE_OK ||
        sqlite3_exec(asking->db, "PRAGMA query_only = ON", NULL, NULL, NULL) != SQLITE_OK)
        return explain(asking, STORE_BROKEN);
    touch_tables(asking->db);
    sqlite3_set_authorizer(asking->db, authorize, NULL);
    set_deadline(asking);
    return STORE_OK;
}

static struct sql_value value_of(sqlite3_stmt *row, int column)
{
    struct sql_value value = {.type = SQL_NULL};

    switch (sqlite3_column_type(row, column)) {
    case SQLITE_INTEGER:
        value.type = SQL_INTEGER;
        value.integer = sqlite3_column_int64(row, column);
        break;
    case SQLITE_FLOAT:
        value.type = SQL_REAL;
        value.real = sqlite3_column_double(row, column);
        break;
    case SQLITE_TEXT:
        value.type = SQL_TEXT;
        value.text = (const char *)sqlite3_column_text(row, column);
        break;
    case SQLITE_BLOB:
        value.type = SQL_BLOB;
        value.text = sqlite3_column_blob(row, column);
        break;
    default:
        break;
    }
    if (value.type == SQL_TEXT || value.type == SQL_BLOB)
        value.size = (size_t)sqlite3_column_bytes(row, column);
    if ((value.type == SQL_TEXT || value.type == SQL_BLOB) && !value.text)
        value.text = "";
    return value;
}

static enum store_status read_rows(struct asking *asking, sqlite3_stmt *row)
{
    const struct sql_reader *reader = asking->reader;
    size_t columns = (size_t)sqlite3_column_count(row);
    const char **name = calloc(columns + 1, sizeof *name);
    struct sql_value *value = calloc(columns + 1, sizeof *value);
    int code = name && value ? SQLITE_ROW : SQLITE_NOMEM;

    for (size_t i = 0; code == SQLITE_ROW && i < columns; i++)
        name[i] = sqlite3_column_name(row, (int)i);
    if (code == SQLITE_ROW)
        code = sqlite3_step(row);
    if ((code == SQLITE_ROW || code == SQLITE_DONE) && columns > 0)
        reader->names(reader->context, columns, name);
    for (; code == SQLITE_ROW; code = code == SQLITE_ROW ? sqlite3_step(row) : code) {
        for (size_t i = 0; i < columns; i++)
            value[i] = value_of(row, (int)i);
        if (!reader->row(reader->context, columns, value))
            code = SQLITE_DONE;
    }
    free(name);
    free(value);
    return code == SQLITE_DONE ? STORE_OK : explain(asking, STORE_CONFLICT);
}

static bool is_blank(const char *sql)
{
    while (isspace((unsigned char)*sql) || *sql == ';')
        sql++;
    return !*sql;
}

static enum store_status ask(struct asking *asking)
{
    const char *rest = "";
    sqlite3_stmt *row = NULL;
    enum store_status status = STORE_CONFLICT;

    if (sqlite3_prepare_v2(asking->db, asking->question->sql, -1, &row, &rest) != SQLITE_OK) {
        status = explain(asking, STORE_CONFLICT);
        if (strcmp(asking->reason, "not authorized") == 0)
            snprintf(asking->reason, asking->size, "only questions are answered: SELECT ...");
    } else if (!row || !is_blank(rest)) {
        snprintf(asking->reason, asking->size, "one statement is wanted: SELECT ...");
    } else {
        status = read_rows(asking, row);
    }
    sqlite3_finalize(row);
    return status;
}

enum store_status store_sql_ask(const struct sql_question *question,
                                const struct sql_reader *reader, char *reason, size_t size)
{
    struct asking asking = {.question = question, .reader = reader, .reason = reason, .size = size};
    enum store_status status = open_file(&asking);

    if (status == STORE_OK)
        status = ask(&asking);
    sqlite3_close(asking.db);
    return status;
}

char *store_sql_schema(void)
{
    const struct store_schema *schema = store_schema();
    struct sample sample;
    struct text text = {0};
    char *view;

    if (!sample_init(&sample))
        return NULL;
    for (size_t i = 0; i < schema->count; i++)
        text_add(&text, "%s%s", i ? "\n" : "", schema->migrations[i].sql);
    view = store_sql_view_text(sample.scene, true);
    text_add(&text,
             "\n-- Before the table jobs comes this view of it, in bcd sql and with the "
             "extension:\n%s",
             view ? view : "");
    text_add(&text,
             "\n-- Results as tables of one job, whose id or seq they take, or of all jobs:\n");
    for (size_t i = 0; bcd_catalogue(BCD_SLOT_OBSERVABLE, i); i++) {
        struct bcd_table *table = sample_table(&sample, i);

        text_add(&text, "--   %s(job): ", bcd_catalogue(BCD_SLOT_OBSERVABLE, i)->name);
        for (size_t k = 0; table && k < table->columns; k++)
            text_add(&text, "%s%s", k ? ", " : "", table->column[k].name);
        text_add(&text,
                 table && bcd_table_column(table, BCD_ROLE_THEORY) ? ", z, job\n" : ", job\n");
        bcd_table_free(table);
    }
    text_add(&text, "--   notes(job): observable, name, value, text, job\n");
    text.failed = text.failed || !view;
    free(view);
    sample_fini(&sample);
    return text_take(&text);
}
