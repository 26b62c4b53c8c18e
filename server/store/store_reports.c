/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "store_reports.h"

#include "store_internal.h"

#include <stdlib.h>

enum store_status store_reports_put(struct store *store, const struct report_new *report)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    struct stmt row = stmt_init(db, "INSERT OR REPLACE INTO reports"
                                    " (name, created_ms, version, machine, json, csv, svg) VALUES"
                                    " (:name, :now, :version, :machine, :json, :csv, :svg)");
    stmt_bind_text(&row, ":name", report->name);
    stmt_bind_integer(&row, ":now", store_now_ms());
    stmt_bind_text(&row, ":version", report->version);
    stmt_bind_text(&row, ":machine", report->machine);
    stmt_bind_text(&row, ":json", report->form[REPORT_JSON]);
    stmt_bind_text(&row, ":csv", report->form[REPORT_CSV]);
    stmt_bind_text(&row, ":svg", report->form[REPORT_SVG]);
    return store_end(store, stmt_run(&row, NULL));
}

enum store_status store_reports_get(struct store *store, const struct report_new *which,
                                    enum report_form form, char **text)
{
    static const char *const queries[REPORT_FORMS] = {
        [REPORT_JSON] = "SELECT json FROM reports"
                        " WHERE name = :name AND version = :version AND machine = :machine",
        [REPORT_CSV] = "SELECT csv FROM reports"
                       " WHERE name = :name AND version = :version AND machine = :machine",
        [REPORT_SVG] = "SELECT svg FROM reports"
                       " WHERE name = :name AND version = :version AND machine = :machine",
    };
    sqlite3 *db = store_read_begin(store);
    struct stmt row = stmt_init(db, queries[form]);
    char *found = NULL;

    stmt_bind_text(&row, ":name", which->name);
    stmt_bind_text(&row, ":version", which->version);
    stmt_bind_text(&row, ":machine", which->machine);
    if (stmt_step(&row))
        found = stmt_text(&row, 0);
    enum store_status status = stmt_fini(&row);
    store_read_end(store, db);
    if (status == STORE_OK && found)
        *text = found;
    else
        free(found);
    return status ? status : found ? STORE_OK : STORE_NOT_FOUND;
}

enum store_status store_reports_when(struct store *store, const struct report_new *which,
                                     int64_t *created_ms)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt row =
        stmt_init(db, "SELECT created_ms FROM reports"
                      " WHERE name = :name AND version = :version AND machine = :machine");
    int64_t found = 0;

    stmt_bind_text(&row, ":name", which->name);
    stmt_bind_text(&row, ":version", which->version);
    stmt_bind_text(&row, ":machine", which->machine);
    if (stmt_step(&row))
        found = stmt_integer(&row, 0);
    enum store_status status = stmt_fini(&row);
    store_read_end(store, db);
    if (status == STORE_OK && found)
        *created_ms = found;
    return status ? status : found ? STORE_OK : STORE_NOT_FOUND;
}
