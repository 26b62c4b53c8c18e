/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_owners.c - rows of the table owners; see store_owners.h and schema/003_people.sql. */
#include "store_owners.h"

#include "limits.h"
#include "store_internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DAY_MS = 86400000 };

const char *const quota_names[QUOTAS] = {
    [QUOTA_QUEUED] = "queued_points",
    [QUOTA_DAY_SECONDS] = "core_seconds_per_day",
    [QUOTA_BYTES] = "stored_bytes",
};
const double quota_defaults[QUOTAS] = {
    [QUOTA_QUEUED] = LIMIT_OWNER_QUEUED_MAX,
    [QUOTA_DAY_SECONDS] = LIMIT_OWNER_DAY_SECONDS_MAX,
    [QUOTA_BYTES] = LIMIT_OWNER_BYTES_MAX,
};

double owner_decay(double seconds, int64_t age_ms)
{
    return age_ms > 0 ? seconds * exp2(-(double)age_ms / LIMIT_USAGE_HALF_LIFE_MS) : seconds;
}

double owner_record_use(const struct owner_record *record, enum quota quota)
{
    if (quota == QUOTA_QUEUED)
        return (double)record->queued;
    if (quota == QUOTA_BYTES)
        return record->bytes;
    return record->day_seconds + record->waiting_seconds;
}

enum quota owner_record_excess(const struct owner_record *record, const struct quota_need *need)
{
    int i = 0;

    while (i < QUOTAS &&
           (!(need->value[i] > 0) ||
            owner_record_use(record, i) + need->value[i] <= record->quota[i]))
        i++;
    return (enum quota)i;
}

/* -------------------------------------------------------------------- reading */

#define OWNER_COLUMNS                                                                              \
    "owner, queued, waiting_seconds, bytes, usage_seconds, usage_ms, day, day_seconds, "           \
    "quota_queued, quota_day_seconds, quota_bytes"

static void read_owner(struct stmt *row, int64_t now_ms, struct owner_record *record)
{
    *record = (struct owner_record){
        .queued = stmt_integer(row, 1),
        .waiting_seconds = stmt_number(row, 2),
        .bytes = stmt_number(row, 3),
        .usage_seconds = owner_decay(stmt_number(row, 4), now_ms - stmt_integer(row, 5)),
        .day_seconds = stmt_integer(row, 6) == now_ms / DAY_MS ? stmt_number(row, 7) : 0,
    };
    for (int i = 0; i < QUOTAS; i++) {
        record->given[i] = !stmt_null(row, 8 + i);
        record->quota[i] = record->given[i] ? stmt_number(row, 8 + i) : quota_defaults[i];
    }
    stmt_text_to(row, 0, record->owner, sizeof record->owner);
}

enum store_status store_owners_find(sqlite3 *db, const char *owner, struct owner_record *record)
{
    struct stmt row = stmt_init(db, "SELECT " OWNER_COLUMNS " FROM owners WHERE owner = :owner");

    *record = (struct owner_record){.queued = 0};
    snprintf(record->owner, sizeof record->owner, "%s", owner);
    memcpy(record->quota, quota_defaults, sizeof record->quota);
    stmt_bind_text(&row, ":owner", owner);
    if (stmt_step(&row))
        read_owner(&row, store_now_ms(), record);
    return stmt_fini(&row);
}

enum store_status store_owners_check(sqlite3 *db, const char *owner, const struct quota_need *need)
{
    struct owner_record record;
    enum store_status status = store_owners_find(db, owner, &record);

    if (status == STORE_OK && owner_record_excess(&record, need) != QUOTAS)
        status = STORE_QUOTA;
    return status;
}

enum store_status store_owners_get(struct store *store, const char *owner,
                                   struct owner_record *record)
{
    sqlite3 *db = store_read_begin(store);
    enum store_status status = store_owners_find(db, owner, record);

    store_read_end(store, db);
    return status;
}

enum store_status store_owners_list(struct store *store, struct owner_record **records,
                                    size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    struct stmt list = stmt_init(db, "SELECT " OWNER_COLUMNS " FROM owners ORDER BY owner");
    struct owner_record *array = NULL;
    int64_t now_ms = store_now_ms();
    size_t used = 0;
    enum store_status status;

    while (stmt_step(&list)) {
        array = stmt_room(&list, array, used, sizeof *array);
        if (!list.status)
            read_owner(&list, now_ms, &array[used++]);
    }
    status = stmt_fini(&list);
    store_read_end(store, db);
    if (status) {
        free(array);
        return status;
    }
    *records = array;
    *count = used;
    return STORE_OK;
}

/* The owner's own: queued ones of this priority and above, and what is left of those that run. */
static enum store_status own_before(sqlite3 *db, const struct ticket *ticket,
                                    struct waiting_before *before)
{
    struct stmt row = stmt_init(
        db, "SELECT count(*), total(core_seconds) FROM jobs"
            " WHERE owner = :owner AND state = 'queued' AND priority >= :priority"
            " UNION ALL SELECT count(*), total(core_seconds * (1 - 1.0 * chunks_done / chunks))"
            " FROM jobs WHERE state = 'running' AND owner = :owner AND priority >= :priority");

    stmt_bind_text(&row, ":owner", ticket->owner);
    stmt_bind_integer(&row, ":priority", ticket->priority);
    while (stmt_step(&row)) {
        before->jobs += stmt_integer(&row, 0);
        before->seconds += stmt_number(&row, 1);
    }
    return stmt_fini(&row);
}

enum store_status store_owners_before(struct store *store, const struct ticket *ticket,
                                      double seconds, struct waiting_before *before)
{
    struct waiting_before found = {0};
    sqlite3 *db = store_read_begin(store);
    enum store_status status = own_before(db, ticket, &found);
    struct stmt row;

    if (status == STORE_OK) {
        row = stmt_init(db, "SELECT total(min(waiting_seconds, :mine)) FROM owners"
                            " WHERE owner <> :owner AND waiting_seconds > 0");
        stmt_bind_text(&row, ":owner", ticket->owner);
        stmt_bind_number(&row, ":mine", found.seconds + seconds);
        if (stmt_step(&row))
            found.seconds += stmt_number(&row, 0);
        status = stmt_fini(&row);
    }
    store_read_end(store, db);
    if (status == STORE_OK)
        *before = found;
    return status;
}

/* -------------------------------------------------------------------- writing */

static enum store_status make_owner(sqlite3 *db, const char *owner)
{
    struct stmt row = stmt_init(db, "INSERT OR IGNORE INTO owners (owner) VALUES (:owner)");

    stmt_bind_text(&row, ":owner", owner);
    return stmt_run(&row, NULL);
}

static enum store_status spend(sqlite3 *db, const char *owner, double seconds)
{
    int64_t now_ms = store_now_ms();
    struct owner_record record;
    struct stmt row;
    enum store_status status = make_owner(db, owner);

    if (status == STORE_OK)
        status = store_owners_find(db, owner, &record);
    if (status)
        return status;
    row = stmt_init(db, "UPDATE owners SET usage_seconds = :usage, usage_ms = :now, day = :day,"
                        " day_seconds = :day_seconds WHERE owner = :owner");
    stmt_bind_text(&row, ":owner", owner);
    stmt_bind_number(&row, ":usage", record.usage_seconds + seconds);
    stmt_bind_integer(&row, ":now", now_ms);
    stmt_bind_integer(&row, ":day", now_ms / DAY_MS);
    stmt_bind_number(&row, ":day_seconds", record.day_seconds + seconds);
    return stmt_run(&row, NULL);
}

enum store_status store_owners_spend(struct store *store, const char *owner, double seconds)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, spend(db, owner, seconds));
}

static enum store_status set_quota(sqlite3 *db, const char *owner, const double quota[QUOTAS])
{
    struct stmt row = stmt_init(db, "UPDATE owners SET quota_queued = :queued,"
                                    " quota_day_seconds = :seconds, quota_bytes = :bytes"
                                    " WHERE owner = :owner");

    stmt_bind_text(&row, ":owner", owner);
    if (quota[QUOTA_QUEUED] >= 0)
        stmt_bind_integer(&row, ":queued", (int64_t)quota[QUOTA_QUEUED]);
    if (quota[QUOTA_DAY_SECONDS] >= 0)
        stmt_bind_number(&row, ":seconds", quota[QUOTA_DAY_SECONDS]);
    if (quota[QUOTA_BYTES] >= 0)
        stmt_bind_integer(&row, ":bytes", (int64_t)quota[QUOTA_BYTES]);
    return stmt_run(&row, NULL);
}

enum store_status store_owners_set_quota(struct store *store, const char *owner,
                                         const double quota[QUOTAS], const struct identity *by)
{
    char detail[160];
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    snprintf(detail, sizeof detail, "%s %.17g, %s %.17g, %s %.17g (-1: the default)",
             quota_names[0], quota[0], quota_names[1], quota[1], quota_names[2], quota[2]);
    status = make_owner(db, owner);
    if (status == STORE_OK)
        status = set_quota(db, owner, quota);
    if (status == STORE_OK)
        status = store_audit_add(db, &(struct audit_new){by, "owner.quota", owner, detail});
    return store_end(store, status);
}
