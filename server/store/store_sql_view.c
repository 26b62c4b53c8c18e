/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_sql_view.c - see store_sql_view.h; about SQLITE_CORE see store_sql_tables.c. */
#ifndef BCD_SQLITE_EXTENSION
#define SQLITE_CORE 1
#endif
#include <sqlite3ext.h>
SQLITE_EXTENSION_INIT3

#include "store_sql_view.h"

#include "outcome_facts.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOMENT(column)                                                                             \
    "strftime('%Y-%m-%dT%H:%M:%fZ', " column "_ms / 1000.0, 'unixepoch') AS " column "_at,\n  "

/* What comes from the columns of the table. */
static const char from_row[] =
    "id, seq, state, owner, label,\n  (SELECT group_concat(tag, ' ') FROM main.job_tags"
    " WHERE job_tags.job = main.jobs.seq) AS tags,\n  priority,\n  "
    "CASE state WHEN 'done' THEN 1.0 ELSE 1.0 * chunks_done / chunks END AS progress,\n  " MOMENT(
        "submitted") MOMENT("started") MOMENT("finished") "error";

static void add(struct text *sql, const char *json, const char *path, const char *name)
{
    text_add(sql, ",\n  json_extract(%s, '$.%s') AS \"%s\"", json, path, name);
}

/* Whether an earlier part of the slot has a parameter of this name. */
static bool seen(enum bcd_slot slot, size_t part, const char *name)
{
    for (size_t i = 0; i < part; i++)
        for (const struct bcd_param *row = bcd_catalogue(slot, i)->params; row && row->name; row++)
            if (strcmp(row->name, name) == 0)
                return true;
    return false;
}

/* Potential and interaction are one part each: parameters of all types side by side. */
static void add_slot(struct text *sql, enum bcd_slot slot)
{
    const char *key = bcd_slot_key(slot);
    const struct bcd_part *part;
    char path[96], name[96];

    snprintf(path, sizeof path, bcd_slot_many(slot) ? "%s" : "%s.type", key);
    add(sql, "job", path, key);
    for (size_t i = 0; !bcd_slot_many(slot) && (part = bcd_catalogue(slot, i)); i++) {
        for (const struct bcd_param *row = part->params; row && row->name; row++) {
            snprintf(path, sizeof path, "%s.%s", key, row->name);
            snprintf(name, sizeof name, "%s_%s", key, row->name);
            if (!seen(slot, i, row->name))
                add(sql, "job", path, name);
        }
    }
}

/* "outcome_target_reached": a flag is 1 or 0. Databases from before there were outcomes have
 * columns without values. */
static void add_outcome(struct text *sql, bool has)
{
    const struct outcome_fact *fact;
    char name[96];

    for (size_t i = 0; (fact = outcome_fact_at(i)); i++) {
        snprintf(name, sizeof name, "outcome_%s", fact->path);
        for (char *c = name; *c; c++)
            *c = *c == '.' ? '_' : *c;
        if (has)
            add(sql, "outcome", fact->path, name);
        else
            text_add(sql, ",\n  NULL AS \"%s\"", name);
    }
}

char *store_sql_view_text(const struct bcd_scene *sample, bool outcomes)
{
    struct text sql = {0};
    const struct bcd_fact *fact;
    char name[96];

    text_add(&sql, "CREATE TEMP VIEW jobs AS SELECT\n  %s", from_row);
    for (const struct bcd_param *row = bcd_job_params(); row->name; row++)
        add(&sql, "job", row->name, row->name);
    for (int slot = 0; slot < BCD_SLOT_COUNT; slot++)
        add_slot(&sql, (enum bcd_slot)slot);
    for (size_t i = 0; (fact = bcd_scene_fact(sample, i)); i++) {
        snprintf(name, sizeof name, "derived_%s", fact->name);
        add(&sql, "derived", fact->name, name);
    }
    add_outcome(&sql, outcomes);
    text_add(&sql, ",\n  job, derived, %s\nFROM main.jobs;\n",
             outcomes ? "outcome" : "NULL AS outcome");
    return text_take(&sql);
}

/* Whether a question has a row for an answer. */
static int has_any(sqlite3 *db, const char *sql, bool *has)
{
    sqlite3_stmt *row = NULL;
    int code = sqlite3_prepare_v2(db, sql, -1, &row, NULL);

    if (code == SQLITE_OK)
        *has = sqlite3_step(row) == SQLITE_ROW;
    sqlite3_finalize(row);
    return code;
}

int store_sql_view(sqlite3 *db, const struct bcd_scene *sample)
{
    bool has = false, outcomes = false;
    char *sql = NULL;
    int code = has_any(
        db, "SELECT 1 FROM main.sqlite_schema WHERE type = 'table' AND name = 'job_tags'", &has);

    if (code == SQLITE_OK)
        code = has_any(db, "SELECT 1 FROM pragma_table_info('jobs', 'main') WHERE name = 'outcome'",
                       &outcomes);
    if (code == SQLITE_OK && has) {
        sql = store_sql_view_text(sample, outcomes);
        code = sql ? sqlite3_exec(db, "DROP VIEW IF EXISTS temp.jobs", NULL, NULL, NULL)
                   : SQLITE_NOMEM;
    }
    if (code == SQLITE_OK && has)
        code = sqlite3_exec(db, sql, NULL, NULL, NULL);
    free(sql);
    return code;
}
