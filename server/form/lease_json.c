/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "lease_json.h"
#include "base64.h"
#include "limits.h"
#include "scene_json_tree.h"
#include "text.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A member, and what it must be. */
struct member {
    const char *name;
    bool needed;
};

void lease_loan_fini(struct lease_loan *loan)
{
    free(loan->scene);
    blob_fini(&loan->checkpoint);
    blob_fini(&loan->begun);
    *loan = (struct lease_loan){0};
}

void lease_word_fini(struct lease_word *word)
{
    free(word->failed);
    blob_fini(&word->bytes);
    *word = (struct lease_word){0};
}

/* ------------------------------------------------------------------ pieces */

static void add_hex(struct text *text, const unsigned char *bytes, size_t size)
{
    text_add(text, "\"");
    for (size_t i = 0; i < size; i++)
        text_add(text, "%02x", bytes[i]);
    text_add(text, "\"");
}

static bool read_hex(const json_t *value, unsigned char *bytes, size_t size)
{
    static const char digits[] = "0123456789abcdef";
    const char *word = json_string_value(value);
    if (!word || strlen(word) != 2 * size || strspn(word, digits) != 2 * size)
        return false;
    for (size_t i = 0; i < size; i++)
        bytes[i] = (unsigned char)((strchr(digits, word[2 * i]) - digits) << 4 |
                                   (strchr(digits, word[2 * i + 1]) - digits));
    return true;
}

static void digest(const struct blob *blob, unsigned char digest[LEASE_DIGEST_SIZE])
{
    SHA2_CTX context;
    SHA256Init(&context);
    SHA256Update(&context, blob->bytes, blob->size);
    SHA256Final(digest, &context);
}

/* null where there are none */
static void add_blob(struct text *text, const char *key, const struct blob *blob)
{
    char *words = blob->size > 0 ? base64_print(blob->bytes, blob->size) : NULL;
    text->failed |= blob->size > 0 && !words;
    if (words)
        text_add(text, ",\"%s\":\"%s\"", key, words);
    else
        text_add(text, ",\"%s\":null", key);
    free(words);
}

static bool read_blob(const json_t *value, struct blob *blob)
{
    if (!value || json_is_null(value))
        return true;
    return json_is_string(value) &&
           base64_parse(json_string_value(value), json_string_length(value), &blob->bytes,
                        &blob->size);
}

/* Every member is one of these, and those that are needed are there. */
static void check_members(json_t *object, const struct member *members, size_t count,
                          struct bcd_errors *errors)
{
    const char *key;
    json_t *value;
    char pointer[64];
    json_object_foreach(object, key, value)
    {
        size_t i = 0;
        while (i < count && strcmp(members[i].name, key) != 0)
            i++;
        snprintf(pointer, sizeof pointer, "/%.60s", key);
        if (i == count)
            bcd_errors_add(errors, pointer, "unknown key");
    }
    for (size_t i = 0; i < count; i++) {
        snprintf(pointer, sizeof pointer, "/%s", members[i].name);
        if (members[i].needed && !json_object_get(object, members[i].name))
            bcd_errors_add(errors, pointer, "is needed");
    }
}

/* What an id of ours can look like. */
static void read_id(json_t *object, const char *key, char *id, size_t size,
                    struct bcd_errors *errors)
{
    const char *word = json_string_value(json_object_get(object, key));
    size_t length = word ? strspn(word, "abcdefghijklmnopqrstuvwxyz0123456789-") : 0;
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s", key);
    if (length > 0 && length < size && !word[length])
        snprintf(id, size, "%s", word);
    else
        bcd_errors_add(errors, pointer, "must be an id");
}

static void read_count(json_t *object, const char *key, int64_t *count, struct bcd_errors *errors)
{
    json_t *value = json_object_get(object, key);
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s", key);
    if (json_is_integer(value) && json_integer_value(value) >= 0)
        *count = json_integer_value(value);
    else if (value)
        bcd_errors_add(errors, pointer, "must be a whole number of 0 or more");
}

/* ------------------------------------------------------------------ asking */

char *lease_json_request(const char *worker)
{
    struct text text = {0};
    text_add(&text, "{\"worker\":");
    text_add_json_string(&text, worker);
    text_add(&text, ",\"result_version\":%d}", BCD_RESULT_VERSION);
    return text_take(&text);
}

bool lease_json_read_request(const char *text, size_t size, char worker[LEASE_WORKER_SIZE],
                             struct bcd_errors *errors)
{
    static const struct member members[] = {{"worker", true}, {"result_version", true}};
    json_t *object = scene_json_load(text, size, "request for a lease", errors);
    int64_t version = -1;
    if (!object)
        return false;
    check_members(object, members, sizeof members / sizeof *members, errors);
    json_t *value = json_object_get(object, "worker");
    const char *name = json_string_value(value);
    read_count(object, "result_version", &version, errors);
    if (value && (!name || !*name || strlen(name) >= LEASE_WORKER_SIZE))
        bcd_errors_add(errors, "/worker", "must be a name of 1 to %d bytes", LEASE_WORKER_SIZE - 1);
    else if (name)
        snprintf(worker, LEASE_WORKER_SIZE, "%s", name);
    if (version >= 0 && version != BCD_RESULT_VERSION)
        bcd_errors_add(errors, "/result_version",
                       "must be %d, the server's: other programs give other bits",
                       BCD_RESULT_VERSION);
    json_decref(object);
    return errors->count == 0;
}

char *lease_json_loan(const struct lease_loan *loan)
{
    struct text text = {0};
    if (!loan)
        return strdup("{\"lease\":null}\n");
    text_add(&text,
             "{\"lease\":{\"id\":\"%s\",\"job\":\"%s\",\"chunk\":%" PRId64 ",\"attempt\":%" PRId64
             ",\"lease_seconds\":",
             loan->id, loan->job, loan->chunk, loan->attempt);
    text_add_number(&text, (double)loan->lease_ms / 1000);
    text_add(&text, ",\"core_seconds_max\":");
    text_add_number(&text, loan->core_seconds_max);
    text_add(&text, ",\"bytes_max\":");
    text_add_number(&text, loan->bytes_max);
    text_add(&text, ",\"hash\":");
    add_hex(&text, loan->hash, sizeof loan->hash);
    text_add(&text, ",\"scene\":%s", loan->scene);
    add_blob(&text, "checkpoint", &loan->checkpoint);
    add_blob(&text, "begun", &loan->begun);
    text_add(&text, "}}\n");
    return text_take(&text);
}

bool lease_json_read_loan(const char *text, size_t size, struct lease_loan *loan,
                          struct bcd_errors *errors)
{
    json_t *whole = json_loadb(text, size, JSON_REJECT_DUPLICATES, NULL);
    json_t *lease = json_object_get(whole, "lease");
    *loan = (struct lease_loan){0};
    if (json_is_object(lease)) {
        read_id(lease, "id", loan->id, sizeof loan->id, errors);
        read_id(lease, "job", loan->job, sizeof loan->job, errors);
        read_count(lease, "chunk", &loan->chunk, errors);
        read_count(lease, "attempt", &loan->attempt, errors);
        loan->lease_ms =
            (int64_t)(1000 * json_number_value(json_object_get(lease, "lease_seconds")));
        loan->core_seconds_max = json_number_value(json_object_get(lease, "core_seconds_max"));
        loan->bytes_max = json_number_value(json_object_get(lease, "bytes_max"));
        loan->scene =
            json_dumps(json_object_get(lease, "scene"), JSON_COMPACT | JSON_REAL_PRECISION(17));
        if (!read_hex(json_object_get(lease, "hash"), loan->hash, sizeof loan->hash) ||
            !read_blob(json_object_get(lease, "checkpoint"), &loan->checkpoint) ||
            !read_blob(json_object_get(lease, "begun"), &loan->begun) || !loan->scene)
            bcd_errors_add(errors, "/lease", "cannot be read");
    } else if (!json_is_null(lease)) {
        bcd_errors_add(errors, "/lease", "must be there");
    }
    json_decref(whole);
    if (errors->count > 0)
        lease_loan_fini(loan);
    return errors->count == 0;
}

/* ----------------------------------------------------------------- telling */

char *lease_json_word(const struct lease_word *word, bool ended)
{
    unsigned char sum[LEASE_DIGEST_SIZE];
    struct text text = {0};
    text_add(&text, "{\"job\":\"%s\",\"chunk\":%" PRId64 ",\"core_seconds\":", word->job,
             word->chunk);
    text_add_number(&text, word->core_seconds);
    if (!ended) {
        text_add(&text, ",\"ticks_done\":%" PRId64 ",\"ticks_total\":%" PRId64 ",\"let_go\":%s",
                 word->ticks_done, word->ticks_total, word->let_go ? "true" : "false");
        text_add(&text, ",\"failed\":");
        if (word->failed)
            text_add_json_string(&text, word->failed);
        else
            text_add(&text, "null");
    }
    add_blob(&text, ended ? "tally" : "checkpoint", &word->bytes);
    if (word->bytes.size > 0) {
        digest(&word->bytes, sum);
        text_add(&text, ",\"sha256\":");
        add_hex(&text, sum, sizeof sum);
    }
    text_add(&text, "}\n");
    return text_take(&text);
}

static void read_bytes(json_t *object, const char *key, struct lease_word *word,
                       struct bcd_errors *errors)
{
    unsigned char sum[LEASE_DIGEST_SIZE];
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s", key);
    if (!read_blob(json_object_get(object, key), &word->bytes)) {
        bcd_errors_add(errors, pointer, "must be bytes in base64");
    } else if (word->bytes.size > 0) {
        digest(&word->bytes, word->digest);
        if (!read_hex(json_object_get(object, "sha256"), sum, sizeof sum) ||
            memcmp(sum, word->digest, sizeof sum) != 0)
            bcd_errors_add(errors, "/sha256", "must be the checksum of %s", key);
    } else {
        free(word->bytes.bytes);
        word->bytes = (struct blob){0};
    }
}

static void read_heartbeat(json_t *object, struct lease_word *word, struct bcd_errors *errors)
{
    const json_t *failed = json_object_get(object, "failed");
    const json_t *let_go = json_object_get(object, "let_go");
    read_count(object, "ticks_done", &word->ticks_done, errors);
    read_count(object, "ticks_total", &word->ticks_total, errors);
    word->let_go = json_is_true(let_go);
    if (let_go && !json_is_boolean(let_go))
        bcd_errors_add(errors, "/let_go", "must be true or false");
    if (json_is_string(failed) && !(word->failed = strdup(json_string_value(failed))))
        bcd_errors_add(errors, "/failed", "no memory");
    else if (failed && !json_is_string(failed) && !json_is_null(failed))
        bcd_errors_add(errors, "/failed", "must be words, or null");
}

bool lease_json_read_word(const char *text, size_t size, bool ended, struct lease_word *word,
                          struct bcd_errors *errors)
{
    static const struct member heartbeat[] = {
        {"job", true},        {"chunk", true},       {"core_seconds", true},
        {"ticks_done", true}, {"ticks_total", true}, {"let_go", false},
        {"failed", false},    {"checkpoint", false}, {"sha256", false}};
    static const struct member end[] = {
        {"job", true}, {"chunk", true}, {"core_seconds", true}, {"tally", true}, {"sha256", true}};
    json_t *object = scene_json_load(text, size, "word of a worker", errors);
    if (!object)
        return false;
    check_members(object, ended ? end : heartbeat,
                  ended ? sizeof end / sizeof *end : sizeof heartbeat / sizeof *heartbeat, errors);
    read_id(object, "job", word->job, sizeof word->job, errors);
    read_count(object, "chunk", &word->chunk, errors);
    json_t *seconds = json_object_get(object, "core_seconds");
    word->core_seconds = json_number_value(seconds);
    if (seconds && (!json_is_number(seconds) || !(word->core_seconds >= 0)))
        bcd_errors_add(errors, "/core_seconds", "must be a number of 0 or more");
    if (!ended)
        read_heartbeat(object, word, errors);
    read_bytes(object, ended ? "tally" : "checkpoint", word, errors);
    if (ended && !word->bytes.bytes && errors->count == 0)
        bcd_errors_add(errors, "/tally", "must be bytes in base64");
    json_decref(object);
    return errors->count == 0;
}
