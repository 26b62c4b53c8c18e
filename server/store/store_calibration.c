/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_calibration.c - rows of the table calibration; see store_calibration.h. */
#include "store_calibration.h"

#include "store_internal.h"

enum store_status store_calibration_load(struct store *store, struct calibration_row *rows,
                                         size_t room, size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt list = stmt_init(db, "SELECT method, factor, seconds FROM calibration");
    size_t used = 0;
    enum store_status status;

    while (used < room && stmt_step(&list)) {
        stmt_text_to(&list, 0, rows[used].method, sizeof rows[used].method);
        rows[used].factor = stmt_number(&list, 1);
        rows[used++].seconds = stmt_number(&list, 2);
    }
    status = stmt_fini(&list);
    store_read_end(store, db);
    *count = status ? 0 : used;
    return status;
}

static enum store_status save(sqlite3 *db, const struct calibration_row *new)
{
    struct stmt row =
        stmt_init(db, "INSERT INTO calibration (method, factor, seconds, updated_ms)"
                      " VALUES (:method, :factor, :seconds, :now)"
                      " ON CONFLICT (method) DO UPDATE SET factor = excluded.factor,"
                      " seconds = excluded.seconds, updated_ms = excluded.updated_ms");

    stmt_bind_text(&row, ":method", new->method);
    stmt_bind_number(&row, ":factor", new->factor);
    stmt_bind_number(&row, ":seconds", new->seconds);
    stmt_bind_integer(&row, ":now", store_now_ms());
    return stmt_run(&row, NULL);
}

enum store_status store_calibration_save(struct store *store, const struct calibration_row *rows,
                                         size_t count)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    for (size_t i = 0; status == STORE_OK && i < count; i++)
        status = save(db, &rows[i]);
    return store_end(store, status);
}
