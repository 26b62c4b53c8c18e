/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "people_json.h"
#include "faults.h"
#include "limits.h"
#include "record_json.h"
#include "scene_json_tree.h"
#include "text.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DAY_S 86400.0

static void read_text(const json_t *value, const char *key, struct token_record *token,
                      struct bcd_errors *errors);
static void read_expiry(const json_t *value, int64_t now_ms, struct token_record *token,
                        struct bcd_errors *errors);
static void fault_key(const char *key, const char *known, struct bcd_errors *errors);
static void add_token(struct text *text, const struct token_record *token);
static void add_owner(struct text *text, const struct owner_record *owner);
static void add_words(struct text *text, const char *words);

bool people_json_read_token(const char *text, size_t size, int64_t now_ms,
                            struct token_record *token, struct bcd_errors *errors)
{
    json_t *object = scene_json_load(text, size, "request for a token", errors), *value;
    const char *key;
    if (!object)
        return false;
    json_object_foreach(object, key, value)
    {
        if (strcmp(key, "expires_in") == 0)
            read_expiry(value, now_ms, token, errors);
        else if (strcmp(key, "owner") == 0 || strcmp(key, "role") == 0 || strcmp(key, "name") == 0)
            read_text(value, key, token, errors);
        else
            fault_key(key, "owner, role, name, expires_in", errors);
    }
    if (!json_object_get(object, "owner"))
        bcd_errors_add(errors, "/owner", "is needed");
    if (!json_object_get(object, "role"))
        bcd_errors_add(errors, "/role", "is needed");
    json_decref(object);
    return errors->count == 0;
}

static void read_text(const json_t *value, const char *key, struct token_record *token,
                      struct bcd_errors *errors)
{
    const char *word = json_string_value(value);
    if (strcmp(key, "owner") == 0) {
        if (word && owner_sound(word))
            snprintf(token->owner, sizeof(token->owner), "%s", word);
        else
            bcd_errors_add(errors, "/owner", "must be 1 to %d of a-z 0-9 _ -", OWNER_SIZE - 1);
    } else if (strcmp(key, "role") == 0) {
        if (!word || !role_parse(word, &token->role))
            bcd_errors_add(errors, "/role", "must be worker, reader, submitter, operator or admin");
    } else if (!json_is_null(value)) {
        size_t characters = 0;
        for (const char *c = word; c && *c; c++)
            characters += ((unsigned char)*c & 0xC0) != 0x80;
        if (!word || characters > LIMIT_TOKEN_NAME_CHARACTERS_MAX)
            bcd_errors_add(errors, "/name", "must be a text of at most %d characters",
                           LIMIT_TOKEN_NAME_CHARACTERS_MAX);
        else if (!(token->name = strdup(word)))
            faults_no_memory(errors, "/name");
    }
}

static void read_expiry(const json_t *value, int64_t now_ms, struct token_record *token,
                        struct bcd_errors *errors)
{
    double seconds = json_number_value(value);
    if (json_is_null(value))
        return;
    if (json_is_number(value) && seconds >= 1 && seconds <= LIMIT_TOKEN_DAYS_MAX * DAY_S)
        token->expires_ms = now_ms + (int64_t)(seconds * 1000);
    else
        bcd_errors_add(errors, "/expires_in",
                       "must be 1 to %.10g seconds (%d days), or null: never",
                       LIMIT_TOKEN_DAYS_MAX * DAY_S, LIMIT_TOKEN_DAYS_MAX);
}

static void fault_key(const char *key, const char *known, struct bcd_errors *errors)
{
    char pointer[64];
    snprintf(pointer, sizeof(pointer), "/%.60s", key);
    bcd_errors_add(errors, pointer, "unknown key; known are %s", known);
}

char *people_json_token(const struct token_record *token, const char *secret)
{
    struct text text = {0};
    text_add(&text, "{");
    if (secret)
        text_add(&text, "\"token\":\"%s\",", secret);
    add_token(&text, token);
    text_add(&text, "}\n");
    return text_take(&text);
}

char *people_json_tokens(const struct token_record *tokens, size_t count)
{
    struct text text = {0};
    text_add(&text, "{\"tokens\":[");
    for (size_t i = 0; i < count; i++) {
        text_add(&text, i ? ",\n{" : "{");
        add_token(&text, &tokens[i]);
        text_add(&text, "}");
    }
    text_add(&text, "]}\n");
    return text_take(&text);
}

static void add_token(struct text *text, const struct token_record *token)
{
    text_add(text, "\"id\":\"%s\",\"owner\":\"%s\",\"role\":\"%s\",\"name\":", token->id,
             token->owner, role_name(token->role));
    add_words(text, token->name);
    record_json_add_time(text, "created_at", token->created_ms);
    record_json_add_time(text, "expires_at", token->expires_ms);
    record_json_add_time(text, "revoked_at", token->revoked_ms);
}

/* null where there are none */
static void add_words(struct text *text, const char *words)
{
    if (words)
        text_add_json_string(text, words);
    else
        text_add(text, "null");
}

/* --------------------------------------------------------------------- owners */

bool people_json_read_quotas(const char *text, size_t size, double quota[QUOTAS],
                             struct bcd_errors *errors)
{
    json_t *object = scene_json_load(text, size, "list of quotas", errors), *value;
    const char *key;
    if (!object)
        return false;
    json_object_foreach(object, key, value)
    {
        char pointer[64];
        int i = 0;
        double number = json_number_value(value);
        while (i < QUOTAS && strcmp(key, quota_names[i]) != 0)
            i++;
        snprintf(pointer, sizeof(pointer), "/%.60s", key);
        if (i == QUOTAS)
            fault_key(key, "queued_points, core_seconds_per_day, stored_bytes", errors);
        else if (json_is_null(value))
            quota[i] = -1;
        else if (json_is_number(value) && number >= 0 && number <= 1e15 &&
                 (i == QUOTA_DAY_SECONDS || number == rint(number)))
            quota[i] = number;
        else
            bcd_errors_add(errors, pointer,
                           "must be a %snumber from 0 to 1e15, or null: the default",
                           i == QUOTA_DAY_SECONDS ? "" : "whole ");
    }
    json_decref(object);
    return errors->count == 0;
}

char *people_json_owner(const struct owner_record *owner)
{
    struct text text = {0};
    text_add(&text, "{");
    add_owner(&text, owner);
    text_add(&text, "}\n");
    return text_take(&text);
}

char *people_json_owners(const struct owner_record *owners, size_t count)
{
    struct text text = {0};
    text_add(&text, "{\"owners\":[");
    for (size_t i = 0; i < count; i++) {
        text_add(&text, i ? ",\n{" : "{");
        add_owner(&text, &owners[i]);
        text_add(&text, "}");
    }
    text_add(&text, "]}\n");
    return text_take(&text);
}

char *people_json_me(const struct identity *me, const struct owner_record *owner)
{
    struct text text = {0};
    text_add(&text, "{\"role\":\"%s\",\"token\":", role_name(me->role));
    add_words(&text, me->token[0] ? me->token : NULL);
    text_add(&text, ",");
    add_owner(&text, owner);
    text_add(&text, "}\n");
    return text_take(&text);
}

static void add_owner(struct text *text, const struct owner_record *owner)
{
    text_add(text, "\"owner\":\"%s\",\"quotas\":{", owner->owner);
    for (int i = 0; i < QUOTAS; i++) {
        text_add(text, "%s\"%s\":{\"limit\":", i ? "," : "", quota_names[i]);
        text_add_number(text, owner->quota[i]);
        text_add(text, ",\"used\":");
        text_add_number(text, owner_record_use(owner, (enum quota)i));
        text_add(text, ",\"default\":%s}", owner->given[i] ? "false" : "true");
    }
    text_add(text, "},\"core_seconds\":{\"today\":");
    text_add_number(text, owner->day_seconds);
    text_add(text, ",\"waiting\":");
    text_add_number(text, owner->waiting_seconds);
    text_add(text, ",\"decayed\":");
    text_add_number(text, owner->usage_seconds);
    text_add(text, "}");
}

char *people_json_excess(const struct owner_record *owner, enum quota quota, double need)
{
    struct text text = {0};
    text_add(&text, "\"quota\":\"%s\",\"limit\":", quota_names[quota]);
    text_add_number(&text, owner->quota[quota]);
    text_add(&text, ",\"used\":");
    text_add_number(&text, owner_record_use(owner, quota));
    text_add(&text, ",\"needed\":");
    text_add_number(&text, need);
    return text_take(&text);
}

/* ---------------------------------------------------------------------- audit */

char *people_json_audit(const struct audit_line *lines, size_t count, int64_t next)
{
    struct text text = {0};
    text_add(&text, "{\"entries\":[");
    for (size_t i = 0; i < count; i++) {
        const struct audit_line *line = &lines[i];
        text_add(&text, "%s{\"owner\":", i ? ",\n" : "");
        add_words(&text, line->owner[0] ? line->owner : NULL);
        text_add(&text, ",\"token\":");
        add_words(&text, line->token[0] ? line->token : NULL);
        text_add(&text, ",\"action\":");
        add_words(&text, line->action);
        text_add(&text, ",\"object\":");
        add_words(&text, line->object);
        text_add(&text, ",\"detail\":");
        add_words(&text, line->detail);
        record_json_add_time(&text, "time", line->time_ms);
        text_add(&text, "}");
    }
    record_json_end_page_at(&text, next);
    return text_take(&text);
}
