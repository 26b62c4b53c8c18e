/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_audit.c - lines of the audit log; see store_audit.h. */
#include "store_audit.h"

#include "limits.h"
#include "store_internal.h"

#include <stdlib.h>

enum store_status store_audit_add(sqlite3 *db, const struct audit_new *line)
{
    struct stmt row = stmt_init(db, "INSERT INTO audit (time_ms, owner, token, action, object,"
                                    " detail) VALUES (:now, :owner, :token, :action, :object,"
                                    " :detail)");
    enum store_status status;

    stmt_bind_integer(&row, ":now", store_now_ms());
    stmt_bind_text(&row, ":owner", line->by->owner);
    stmt_bind_text(&row, ":token", line->by->token[0] ? line->by->token : NULL);
    stmt_bind_text(&row, ":action", line->action);
    stmt_bind_text(&row, ":object", line->object);
    stmt_bind_text(&row, ":detail", line->detail);
    status = stmt_run(&row, NULL);
    if (status)
        return status;
    row = stmt_init(db, "DELETE FROM audit WHERE seq <= :last");
    stmt_bind_integer(&row, ":last", sqlite3_last_insert_rowid(db) - LIMIT_AUDIT_ROWS_MAX);
    return stmt_run(&row, NULL);
}

enum store_status store_audit_write(struct store *store, const struct audit_new *line)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, store_audit_add(db, line));
}

void audit_lines_free(struct audit_line *lines, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        free(lines[i].action);
        free(lines[i].object);
        free(lines[i].detail);
    }
    free(lines);
}

static void read_line(struct stmt *row, struct audit_line *line)
{
    *line = (struct audit_line){
        .seq = stmt_integer(row, 0),
        .time_ms = stmt_integer(row, 1),
        .action = stmt_text(row, 4),
        .object = stmt_text(row, 5),
        .detail = stmt_text(row, 6),
    };
    stmt_text_to(row, 2, line->owner, sizeof line->owner);
    stmt_text_to(row, 3, line->token, sizeof line->token);
}

enum store_status store_audit_list(struct store *store, const struct audit_query *query,
                                   struct audit_line **lines, size_t *count)
{
    struct audit_line *array = calloc(query->limit + 1, sizeof *array);
    sqlite3 *db = store_read_begin(store);
    struct stmt list = stmt_init(db, "SELECT seq, time_ms, owner, token, action, object, detail"
                                     " FROM audit WHERE seq < :before"
                                     " AND (:owner IS NULL OR owner = :owner)"
                                     " AND (:action IS NULL OR action = :action)"
                                     " AND (:object IS NULL OR object = :object)"
                                     " ORDER BY seq DESC LIMIT :limit");
    size_t used = 0;
    enum store_status status;

    if (!array && !list.status)
        list.status = store_fault(db, SQLITE_NOMEM, list.sql);
    stmt_bind_integer(&list, ":before", query->before_seq > 0 ? query->before_seq : INT64_MAX);
    stmt_bind_text(&list, ":owner", query->owner);
    stmt_bind_text(&list, ":action", query->action);
    stmt_bind_text(&list, ":object", query->object);
    stmt_bind_integer(&list, ":limit", (int64_t)query->limit);
    while (stmt_step(&list))
        read_line(&list, &array[used++]);
    status = stmt_fini(&list);
    store_read_end(store, db);
    if (status) {
        audit_lines_free(array, used);
        return status;
    }
    *lines = array;
    *count = used;
    return STORE_OK;
}
