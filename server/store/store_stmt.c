/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_stmt.c - transactions, read-only connections and statements; see store_internal.h.
 *
 * THREADS  The writing connection is reached through store_begin alone, which holds write_mutex
 * until store_end. A reader belongs to whoever took it from the pool.
 */
#include "store_internal.h"

#include "log.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    STATEMENT_BYTES = 512, /* of a statement in the log */
    ROOM_FIRST = 16,       /* elements; a power of two */
};

/* -------------------------------------------------------------------- errors */

/* The errno behind an I/O error. A failed COMMIT leaves it only with the file that failed: the
 * database or its write-ahead log. */
static int find_errno(sqlite3 *db)
{
    int cause = sqlite3_system_errno(db);
    sqlite3_file *file = NULL;

    if (cause == 0)
        sqlite3_file_control(db, "main", SQLITE_FCNTL_LAST_ERRNO, &cause);
    if (cause == 0 &&
        sqlite3_file_control(db, "main", SQLITE_FCNTL_JOURNAL_POINTER, &file) == SQLITE_OK &&
        file && file->pMethods)
        file->pMethods->xFileControl(file, SQLITE_FCNTL_LAST_ERRNO, &cause);
    return cause;
}

/* A full disk comes in several guises: SQLite knows ENOSPC, but quotas and RLIMIT_FSIZE reach it as
 * an I/O error. */
static bool is_full(int code, int cause)
{
    int primary = code & 0xff;

    if (primary == SQLITE_FULL)
        return true;
    return (primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN) &&
           (cause == ENOSPC || cause == EDQUOT || cause == EFBIG);
}

enum store_status store_fault(sqlite3 *db, int code, const char *sql)
{
    int cause =
        (code & 0xff) == SQLITE_IOERR || (code & 0xff) == SQLITE_CANTOPEN ? find_errno(db) : 0;
    bool full = is_full(code, cause);
    char statement[STATEMENT_BYTES];

    snprintf(statement, sizeof statement, "%s", sql); /* migrations are long */
    log_write(full ? LOG_LEVEL_WARNING : LOG_LEVEL_ERROR, full ? "store_full" : "store_broken",
              LOG_FIELDS(log_integer("code", code), log_text("name", sqlite3_errstr(code)),
                         log_integer("errno", cause), log_text("message", sqlite3_errmsg(db)),
                         log_text("statement", statement)));
    return full ? STORE_FULL : STORE_BROKEN;
}

enum store_status store_exec(sqlite3 *db, const char *sql)
{
    int code = sqlite3_exec(db, sql, NULL, NULL, NULL);

    return code == SQLITE_OK ? STORE_OK : store_fault(db, code, sql);
}

/* -------------------------------------------------------------- transactions */

/* A ROLLBACK needs memory, and may have found none: without a later one the connection would be
 * good for nothing any more. */
static void end_left_over(sqlite3 *db)
{
    if (!sqlite3_get_autocommit(db))
        store_exec(db, "ROLLBACK");
}

enum store_status store_begin_alone(struct store *store, const char *file, int line)
{
    enum store_status status;

    end_left_over(store->writer);
    status = store_exec(store->writer, "BEGIN IMMEDIATE");
    if (status) {
        store_health_note(store, status);
        log_write(LOG_LEVEL_ERROR, "store_begin_failed",
                  LOG_FIELDS(log_text("file", file), log_integer("line", line)));
    }
    return status;
}

enum store_status store_begin(struct store *store, sqlite3 **db, const char *file, int line)
{
    enum store_status status;

    pthread_mutex_lock(&store->write_mutex);
    if (store->group)
        store_group_commit(store);
    status = store_begin_alone(store, file, line);
    if (status) {
        pthread_mutex_unlock(&store->write_mutex);
        return status;
    }
    store->begin_file = file;
    store->begin_line = line;
    *db = store->writer;
    return STORE_OK;
}

void store_rolled_back(struct store *store, enum store_status status)
{
    if (status == STORE_FULL || status == STORE_BROKEN)
        log_write(LOG_LEVEL_ERROR, "store_rolled_back",
                  LOG_FIELDS(log_text("file", store->begin_file),
                             log_integer("line", store->begin_line)));
    /* Some errors have rolled back by themselves already. */
    if (!sqlite3_get_autocommit(store->writer))
        store_exec(store->writer, "ROLLBACK");
    /* What the log holds moves into the database, if that has room: the log's file is then used
     * again from its start, and the next try may fit. */
    if (status == STORE_FULL)
        sqlite3_wal_checkpoint_v2(store->writer, NULL, SQLITE_CHECKPOINT_PASSIVE, NULL, NULL);
}

enum store_status store_end(struct store *store, enum store_status status)
{
    struct watch moves;

    if (store->shared) {
        status = store_group_end(store, status, &moves);
    } else {
        if (status == STORE_OK)
            status = store_commit(store);
        if (status)
            store_rolled_back(store, status);
        store_health_note(store, status);
        store_watch_take(store, status == STORE_OK, &moves);
    }
    pthread_mutex_unlock(&store->write_mutex);
    store_watch_tell(&moves);
    return status;
}

sqlite3 *store_read_begin(struct store *store)
{
    sqlite3 *db;

    pthread_mutex_lock(&store->read_mutex);
    while (store->idle_count == 0)
        pthread_cond_wait(&store->read_returned, &store->read_mutex);
    db = store->idle[--store->idle_count];
    pthread_mutex_unlock(&store->read_mutex);
    end_left_over(db);
    return db;
}

void store_read_end(struct store *store, sqlite3 *db)
{
    pthread_mutex_lock(&store->read_mutex);
    assert(store->idle_count < store->reader_count);
    store->idle[store->idle_count++] = db;
    pthread_cond_signal(&store->read_returned);
    pthread_mutex_unlock(&store->read_mutex);
}

/* ---------------------------------------------------------------- statements */

struct stmt stmt_init(sqlite3 *db, const char *sql)
{
    struct stmt stmt = {.db = db, .sql = sql, .handle = store_cache_take(db, sql)};
    int code = SQLITE_OK;

    if (!stmt.handle)
        code = sqlite3_prepare_v3(db, sql, -1, SQLITE_PREPARE_PERSISTENT, &stmt.handle, NULL);
    if (code != SQLITE_OK)
        stmt.status = store_fault(db, code, sql);
    return stmt;
}

/* Index of a named parameter, 0 when the statement has failed already. */
static int parameter(struct stmt *stmt, const char *name)
{
    int index;

    if (stmt->status)
        return 0;
    index = sqlite3_bind_parameter_index(stmt->handle, name);
    assert(index > 0);
    if (index == 0)
        stmt->status = store_fault(stmt->db, SQLITE_MISUSE, stmt->sql);
    return index;
}

static void check(struct stmt *stmt, int code)
{
    if (code != SQLITE_OK)
        stmt->status = store_fault(stmt->db, code, stmt->sql);
}

void stmt_bind_text(struct stmt *stmt, const char *name, const char *value)
{
    int index = parameter(stmt, name);

    if (index)
        check(stmt, sqlite3_bind_text64(stmt->handle, index, value, value ? strlen(value) : 0,
                                        SQLITE_STATIC, SQLITE_UTF8));
}

void stmt_bind_integer(struct stmt *stmt, const char *name, int64_t value)
{
    int index = parameter(stmt, name);

    if (index)
        check(stmt, sqlite3_bind_int64(stmt->handle, index, value));
}

void stmt_bind_number(struct stmt *stmt, const char *name, double value)
{
    int index = parameter(stmt, name);

    if (index)
        check(stmt, sqlite3_bind_double(stmt->handle, index, value));
}

void stmt_bind_blob(struct stmt *stmt, const char *name, const void *bytes, size_t size)
{
    int index = parameter(stmt, name);

    if (!index)
        return;
    if (size == 0)
        check(stmt, sqlite3_bind_zeroblob(stmt->handle, index, 0));
    else
        check(stmt, sqlite3_bind_blob64(stmt->handle, index, bytes, size, SQLITE_STATIC));
}

bool stmt_step(struct stmt *stmt)
{
    int code;

    if (stmt->status)
        return false;
    code = sqlite3_step(stmt->handle);
    if (code == SQLITE_ROW)
        return true;
    if (code != SQLITE_DONE)
        stmt->status = store_fault(stmt->db, code, stmt->sql);
    return false;
}

void *stmt_blob(struct stmt *stmt, int column, size_t *size)
{
    const void *bytes = sqlite3_column_blob(stmt->handle, column);
    size_t length = (size_t)sqlite3_column_bytes(stmt->handle, column);
    char *copy;

    if (sqlite3_column_type(stmt->handle, column) == SQLITE_NULL)
        return NULL;
    copy = bytes || length == 0 ? malloc(length + 1) : NULL;
    if (!copy) {
        stmt->status = store_fault(stmt->db, SQLITE_NOMEM, stmt->sql);
        return NULL;
    }
    if (length)
        memcpy(copy, bytes, length);
    copy[length] = '\0'; /* so that a text is one, too */
    if (size)
        *size = length;
    return copy;
}

char *stmt_text(struct stmt *stmt, int column)
{
    return stmt_blob(stmt, column, NULL);
}

void stmt_text_to(struct stmt *stmt, int column, char *to, size_t room)
{
    const unsigned char *text = sqlite3_column_text(stmt->handle, column);

    if (!text && !stmt_null(stmt, column))
        stmt->status = store_fault(stmt->db, SQLITE_NOMEM, stmt->sql);
    snprintf(to, room, "%s", text ? (const char *)text : "");
}

int64_t stmt_integer(struct stmt *stmt, int column)
{
    return sqlite3_column_int64(stmt->handle, column);
}

double stmt_number(struct stmt *stmt, int column)
{
    return sqlite3_column_double(stmt->handle, column);
}

bool stmt_null(struct stmt *stmt, int column)
{
    return sqlite3_column_type(stmt->handle, column) == SQLITE_NULL;
}

/* There is room for 16, 32, 64 .. */
void *stmt_room(struct stmt *stmt, void *array, size_t used, size_t element_size)
{
    bool full = used == 0 || (used >= ROOM_FIRST && (used & (used - 1)) == 0);
    void *longer;

    if (!full)
        return array;
    longer = realloc(array, (used ? 2 * used : ROOM_FIRST) * element_size);
    if (!longer)
        stmt->status = store_fault(stmt->db, SQLITE_NOMEM, stmt->sql);
    return longer ? longer : array;
}

enum store_status stmt_fini(struct stmt *stmt)
{
    if (stmt->handle)
        store_cache_give(stmt->db, stmt->handle);
    stmt->handle = NULL;
    return stmt->status;
}

void stmt_again(struct stmt *stmt)
{
    sqlite3_reset(stmt->handle); /* repeats an error that is known already */
}

enum store_status stmt_run_again(struct stmt *stmt, int *changes)
{
    if (stmt_step(stmt)) {
        assert(!"a statement without rows gave one");
        stmt->status = STORE_BROKEN;
    }
    if (changes && !stmt->status)
        *changes = sqlite3_changes(stmt->db);
    stmt_again(stmt);
    return stmt->status;
}

enum store_status stmt_run(struct stmt *stmt, int *changes)
{
    stmt_run_again(stmt, changes);
    return stmt_fini(stmt);
}

int64_t store_now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
