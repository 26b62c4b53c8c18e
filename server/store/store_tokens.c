/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_tokens.c - rows of the table tokens; see store_tokens.h. */
#include "store_tokens.h"

#include "limits.h"
#include "store_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

void token_records_free(struct token_record *records, size_t count)
{
    for (size_t i = 0; i < count; i++)
        free(records[i].name);
    free(records);
}

bool token_record_live(const struct token_record *record, int64_t now_ms)
{
    return record->revoked_ms == 0 && (record->expires_ms == 0 || now_ms < record->expires_ms);
}

/* -------------------------------------------------------------------- reading */

static void read_token(struct stmt *row, struct token_record *record)
{
    char role[STORE_WORD_SIZE];
    size_t size = 0;
    void *hash = stmt_blob(row, 1, &size);

    *record = (struct token_record){
        .name = stmt_text(row, 4),
        .created_ms = stmt_integer(row, 5),
        .expires_ms = stmt_integer(row, 6),
        .revoked_ms = stmt_integer(row, 7),
    };
    stmt_text_to(row, 0, record->id, sizeof record->id);
    stmt_text_to(row, 2, record->owner, sizeof record->owner);
    stmt_text_to(row, 3, role, sizeof role);
    if (record->id[0] && record->owner[0] && role_parse(role, &record->role) &&
        size == SECRET_HASH_SIZE)
        memcpy(record->hash, hash, size);
    else if (!row->status)
        row->status = store_fault(row->db, SQLITE_CORRUPT, row->sql);
    free(hash);
    if (row->status)
        free(record->name);
}

static enum store_status list_tokens(sqlite3 *db, struct token_record **records, size_t *count)
{
    struct stmt list = stmt_init(db, "SELECT id, hash, owner, role, name, created_ms, expires_ms,"
                                     " revoked_ms FROM tokens ORDER BY created_ms, id");
    struct token_record *array = NULL;
    size_t used = 0;
    enum store_status status;

    while (stmt_step(&list)) {
        array = stmt_room(&list, array, used, sizeof *array);
        if (!list.status)
            read_token(&list, &array[used]);
        used += !list.status;
    }
    status = stmt_fini(&list);
    if (status) {
        token_records_free(array, used);
        return status;
    }
    *records = array;
    *count = used;
    return STORE_OK;
}

enum store_status store_tokens_list(struct store *store, struct token_record **records,
                                    size_t *count)
{
    sqlite3 *db = store_read_begin(store);
    enum store_status status = list_tokens(db, records, count);

    store_read_end(store, db);
    return status;
}

/* Live tokens, and those of admins among them. */
static enum store_status count_live(sqlite3 *db, size_t *live, size_t *admins)
{
    struct token_record *records = NULL;
    size_t count = 0;
    int64_t now_ms = store_now_ms();
    enum store_status status = list_tokens(db, &records, &count);

    *live = *admins = 0;
    for (size_t i = 0; i < count; i++) {
        if (!token_record_live(&records[i], now_ms))
            continue;
        ++*live;
        *admins += records[i].role == ROLE_ADMIN;
    }
    token_records_free(records, count);
    return status;
}

/* -------------------------------------------------------------------- writing */

static enum store_status insert_token(sqlite3 *db, const struct token_record *token)
{
    struct stmt row = stmt_init(db, "INSERT INTO tokens (id, hash, owner, role, name, created_ms,"
                                    " expires_ms) VALUES (:id, :hash, :owner, :role, :name,"
                                    " :created, nullif(:expires, 0))");

    stmt_bind_text(&row, ":id", token->id);
    stmt_bind_blob(&row, ":hash", token->hash, sizeof token->hash);
    stmt_bind_text(&row, ":owner", token->owner);
    stmt_bind_text(&row, ":role", role_name(token->role));
    stmt_bind_text(&row, ":name", token->name);
    stmt_bind_integer(&row, ":created", token->created_ms);
    stmt_bind_integer(&row, ":expires", token->expires_ms);
    return stmt_run(&row, NULL);
}

/* Its line says what it was; who made and who revoked it stand there already. */
static enum store_status forget_one(sqlite3 *db, const struct token_record *token)
{
    static const struct identity nobody = {.role = ROLE_NONE};
    struct stmt row = stmt_init(db, "DELETE FROM tokens WHERE id = :id");
    char detail[96], end[32] = "";
    time_t end_s = (time_t)((token->revoked_ms ? token->revoked_ms : token->expires_ms) / 1000);
    struct tm utc;
    enum store_status status;

    stmt_bind_text(&row, ":id", token->id);
    status = stmt_run(&row, NULL);
    if (gmtime_r(&end_s, &utc))
        strftime(end, sizeof end, "%Y-%m-%dT%H:%M:%SZ", &utc);
    snprintf(detail, sizeof detail, "owner %s, role %s, %s %s", token->owner,
             role_name(token->role), token->revoked_ms ? "revoked" : "expired", end);
    return status ? status
                  : store_audit_add(
                        db, &(struct audit_new){&nobody, "token.forget", token->id, detail});
}

/* When it opened something for the last time; INT64_MAX = it does. */
static int64_t end_of(const struct token_record *token)
{
    int64_t end = token->revoked_ms ? token->revoked_ms : INT64_MAX;

    return token->expires_ms && token->expires_ms < end ? token->expires_ms : end;
}

/* Not before another one is good: a server whose last token is gone would look as if it never had
 * one, and be open. */
static enum store_status forget(sqlite3 *db)
{
    struct token_record *records = NULL;
    size_t count = 0, live = 0;
    int64_t now_ms = store_now_ms();
    enum store_status status = list_tokens(db, &records, &count);

    for (size_t i = 0; i < count; i++)
        live += token_record_live(&records[i], now_ms);
    for (size_t i = 0; live > 0 && i < count && status == STORE_OK; i++)
        if (end_of(&records[i]) < now_ms - LIMIT_TOKEN_KEPT_DAYS * INT64_C(86400000))
            status = forget_one(db, &records[i]);
    token_records_free(records, count);
    return status;
}

enum store_status store_tokens_forget(struct store *store)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, forget(db));
}

static enum store_status add(sqlite3 *db, struct token_record *token, const struct identity *by)
{
    size_t live, admins;
    char detail[96];
    enum store_status status = count_live(db, &live, &admins);

    if (status == STORE_OK &&
        (live >= LIMIT_TOKENS_MAX || (admins == 0 && token->role != ROLE_ADMIN)))
        status = STORE_CONFLICT;
    if (status == STORE_OK)
        status = store_make_id(token->id, 't');
    token->created_ms = store_now_ms();
    if (status == STORE_OK)
        status = insert_token(db, token);
    snprintf(detail, sizeof detail, "owner %s, role %s", token->owner, role_name(token->role));
    if (status == STORE_OK)
        status = store_audit_add(db, &(struct audit_new){by, "token.create", token->id, detail});
    return status ? status : forget(db);
}

enum store_status store_tokens_add(struct store *store, struct token_record *token,
                                   const struct identity *by)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, add(db, token, by));
}

static enum store_status why_not_revoked(sqlite3 *db, const char *id)
{
    struct stmt row = stmt_init(db, "SELECT 1 FROM tokens WHERE id = :id");
    bool any;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    any = stmt_step(&row);
    status = stmt_fini(&row);
    return status ? status : any ? STORE_CONFLICT : STORE_NOT_FOUND;
}

static enum store_status revoke(sqlite3 *db, const char *id, bool last_too,
                                const struct identity *by)
{
    struct stmt row = stmt_init(db, "UPDATE tokens SET revoked_ms = :now"
                                    " WHERE id = :id AND revoked_ms IS NULL");
    size_t live, admins;
    int changes = 0;
    enum store_status status;

    stmt_bind_text(&row, ":id", id);
    stmt_bind_integer(&row, ":now", store_now_ms());
    status = stmt_run(&row, &changes);
    if (status == STORE_OK && changes == 0)
        status = why_not_revoked(db, id);
    if (status == STORE_OK && !last_too) {
        status = count_live(db, &live, &admins);
        if (status == STORE_OK && admins == 0)
            status = STORE_CONFLICT;
    }
    if (status == STORE_OK)
        status = store_audit_add(db, &(struct audit_new){by, "token.revoke", id, ""});
    return status;
}

enum store_status store_tokens_revoke(struct store *store, const char *id, bool last_too,
                                      const struct identity *by)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    return status ? status : store_end(store, revoke(db, id, last_too, by));
}
