/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_segment.c - see store_segment.h. */
#include "store_segment.h"

#include "store_news.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* So many jobs of a segment may have news before these move into the columns: a list reads them
 * all, and moving them writes the columns anew. */
enum { NEWS_MAX = 16, KEY_STARTED = 2, KEY_FINISHED = 3 };

/* ---------------------------------------------------------------- gathering */

struct gathered_text {
    struct gathered_text *before;
    size_t used, room;
    char bytes[];
};
enum { TEXT_BLOCK_BYTES = 16384 };

bool gathered_add(struct gathered *gathered, const char *path)
{
    struct gathered_key *key;

    if (gathered->count == gathered->room) {
        size_t room = gathered->room ? 2 * gathered->room : 32;

        key = realloc(gathered->key, room * sizeof *key);
        if (!key)
            return false;
        gathered->key = key;
        gathered->room = room;
    }
    key = &gathered->key[gathered->count];
    key->column = malloc(sizeof *key->column);
    if (!key->column)
        return false;
    snprintf(key->path, sizeof key->path, "%s", path);
    key->token_length = 0;
    column_clear(key->column);
    gathered->count++;
    return true;
}

void gathered_fini(struct gathered *gathered)
{
    for (size_t i = 0; i < gathered->count; i++)
        free(gathered->key[i].column);
    free(gathered->key);
    while (gathered->text) {
        struct gathered_text *before = gathered->text->before;

        free(gathered->text);
        gathered->text = before;
    }
    free(text_take(&gathered->scratch));
    *gathered = (struct gathered){0};
}

/* A text that lives as long as what is gathered. */
static struct scalar keep(struct gathered *gathered, const struct scalar *value)
{
    struct gathered_text *text = gathered->text;
    char *copy;

    if (value->type != SCALAR_TEXT)
        return *value;
    if (!text || text->used + value->length > text->room) {
        size_t room = value->length > TEXT_BLOCK_BYTES ? value->length : TEXT_BLOCK_BYTES;

        text = malloc(sizeof *text + room);
        if (!text) {
            gathered->failed = true;
            return (struct scalar){.type = SCALAR_NONE};
        }
        text->before = gathered->text;
        text->used = 0;
        text->room = room;
        gathered->text = text;
    }
    copy = text->bytes + text->used;
    memcpy(copy, value->text, value->length);
    text->used += value->length;
    return scalar_text(copy, value->length);
}

/* Jobs are alike: the path that came next last time probably does so again. NULL = not wanted. */
static struct gathered_key *find_key(struct gathered *gathered, const char *path)
{
    for (size_t i = 0; i < gathered->count; i++) {
        size_t at = (gathered->next + i) % gathered->count;

        if (strcmp(gathered->key[at].path, path) == 0) {
            gathered->next = at + 1;
            return &gathered->key[at];
        }
    }
    if (gathered->closed)
        return NULL;
    if (!gathered_add(gathered, path)) {
        gathered->failed = true;
        return NULL;
    }
    gathered->next = gathered->count;
    return &gathered->key[gathered->count - 1];
}

struct gathering {
    struct gathered *gathered;
    size_t job;         /* within the segment */
    struct text before; /* what was derived of the one before, */
    size_t job_before;  /* which is this */
};

static void gather_value(struct gathering *gathering, struct column *column,
                         const struct scalar *value)
{
    struct scalar before = gathering->job > 0 ? column_get(column, gathering->job - 1)
                                              : (struct scalar){.type = SCALAR_NONE};
    struct scalar kept =
        scalar_compare(&before, value, false) == 0 ? before : keep(gathering->gathered, value);

    if (kept.type != SCALAR_NONE)
        column_put(column, gathering->job, &kept);
}

static void gather(void *context, const char *path, const char *token, size_t length)
{
    struct gathering *gathering = context;
    struct gathered_key *key = find_key(gathering->gathered, path);
    struct scalar value;

    if (!key)
        return;
    /* What is written as in the job before need not be read again. */
    if (length == key->token_length && memcmp(token, key->token, length) == 0) {
        key->column->code[gathering->job] = key->column->code[key->token_job];
        return;
    }
    value = scalar_read(token, length, &gathering->gathered->scratch);
    gather_value(gathering, key->column, &value);
    key->token_length = length < sizeof key->token ? length : 0;
    key->token_job = gathering->job;
    memcpy(key->token, token, key->token_length);
}

/* Of jobs that differ in their seed alone the same is derived: it need not be read again. */
static void gather_derived(struct gathering *gathering, const char *json, size_t size)
{
    struct gathered *gathered = gathering->gathered;
    struct text *before = &gathering->before;

    if (size == before->size && size > 0 && memcmp(json, before->bytes, size) == 0) {
        for (size_t i = 0; i < gathered->count; i++)
            if (strncmp(gathered->key[i].path, "derived.", 8) == 0)
                gathered->key[i].column->code[gathering->job] =
                    gathered->key[i].column->code[gathering->job_before];
    } else {
        scalar_walk(json, "derived.", gather, gathering);
        before->size = 0;
        text_add_bytes(before, json, size);
    }
    gathering->job_before = gathering->job;
    gathered->failed = gathered->failed || before->failed;
}

/* Columns of a row beside its JSON, with the names that records and filters have for them. */
static const char *const row_paths[] = {"submitted_at", "started_at", "finished_at",
                                        "owner",        "label",      "priority"};
#define ROW_COLUMNS "submitted_ms, started_ms, finished_ms, owner, label, priority"
enum {
    ROW_PATHS = sizeof row_paths / sizeof row_paths[0],
    ROW_FIRST = 2,
    JOB_COLUMN = ROW_FIRST + ROW_PATHS,
    DERIVED_COLUMN,
};

static void gather_row(struct gathering *gathering, sqlite3_stmt *row)
{
    for (int i = 0; i < ROW_PATHS; i++) {
        struct gathered_key *key;
        struct scalar value = {.type = SCALAR_NONE};
        int type = sqlite3_column_type(row, ROW_FIRST + i);

        if (type == SQLITE_INTEGER)
            value = scalar_integer(sqlite3_column_int64(row, ROW_FIRST + i));
        if (type == SQLITE_TEXT)
            value = scalar_text((const char *)sqlite3_column_text(row, ROW_FIRST + i),
                                (size_t)sqlite3_column_bytes(row, ROW_FIRST + i));
        key = value.type == SCALAR_NONE ? NULL : find_key(gathering->gathered, row_paths[i]);
        if (key)
            gather_value(gathering, key->column, &value);
    }
}

/* What a list of paths wants of the two JSON texts; both when it is not closed. */
static bool wants(const struct gathered *gathered, bool derived)
{
    bool found = !gathered->closed;

    for (size_t i = 0; i < gathered->count && !found; i++)
        found = (strncmp(gathered->key[i].path, "derived.", 8) == 0) == derived;
    return found;
}

enum store_status store_segment_gather(sqlite3 *db, int64_t segment, struct gathered *gathered,
                                       char states[SEGMENT_JOBS])
{
    bool job = wants(gathered, false), derived = wants(gathered, true);
    struct gathering gathering = {.gathered = gathered};
    struct stmt row = stmt_init(db, "SELECT seq, state, " ROW_COLUMNS ", job, derived FROM jobs"
                                    " WHERE seq BETWEEN :first AND :last");

    stmt_bind_integer(&row, ":first", segment << SEGMENT_BITS);
    stmt_bind_integer(&row, ":last", (segment << SEGMENT_BITS) + SEGMENT_JOBS - 1);
    memset(states, '-', SEGMENT_JOBS);
    while (stmt_step(&row)) {
        const char *state = (const char *)sqlite3_column_text(row.handle, 1);

        gathering.job = (size_t)stmt_integer(&row, 0) % SEGMENT_JOBS;
        states[gathering.job] = state ? state[0] : '-';
        gathered->next = 0;
        if (gathered->count == 0 && gathered->closed)
            continue;
        gather_row(&gathering, row.handle);
        if (job && !stmt_null(&row, JOB_COLUMN))
            scalar_walk((const char *)sqlite3_column_text(row.handle, JOB_COLUMN), "", gather,
                        &gathering);
        if (derived && !stmt_null(&row, DERIVED_COLUMN))
            gather_derived(&gathering,
                           (const char *)sqlite3_column_text(row.handle, DERIVED_COLUMN),
                           (size_t)sqlite3_column_bytes(row.handle, DERIVED_COLUMN));
    }
    free(text_take(&gathering.before));
    if (gathered->failed)
        row.status = store_fault(db, SQLITE_NOMEM, "gather scalars");
    return stmt_fini(&row);
}

/* ------------------------------------------------------------------ columns */

static int64_t column_id(int64_t key, int64_t segment)
{
    return key << 32 | segment;
}

enum store_status store_segment_key(sqlite3 *db, const char *path, int64_t *key)
{
    struct stmt row = stmt_init(db, "SELECT id FROM job_keys WHERE path = :path");
    bool known;
    enum store_status status;

    stmt_bind_text(&row, ":path", path);
    known = stmt_step(&row);
    if (known)
        *key = stmt_integer(&row, 0);
    status = stmt_fini(&row);
    if (status || known)
        return status;
    row = stmt_init(db, "INSERT INTO job_keys (path) VALUES (:path)");
    stmt_bind_text(&row, ":path", path);
    status = stmt_run(&row, NULL);
    *key = sqlite3_last_insert_rowid(db);
    return status;
}

static void bind_end(struct stmt *row, const char *name, const struct scalar *end)
{
    if (end->type == SCALAR_INTEGER)
        stmt_bind_integer(row, name, end->integer);
    if (end->type == SCALAR_REAL)
        stmt_bind_number(row, name, end->real);
}

static enum store_status write_column(sqlite3 *db, int64_t id, const struct column *column)
{
    struct scalar least, most;
    size_t size = 0;
    void *bytes = column_encode(column, &size);
    struct stmt row;
    enum store_status status;

    if (!bytes || !column_ends(bytes, size, &least, &most)) {
        free(bytes);
        return store_fault(db, SQLITE_NOMEM, "encode a column");
    }
    row = stmt_init(db, "INSERT OR REPLACE INTO job_columns (id, bytes) VALUES (:id, :bytes)");
    stmt_bind_integer(&row, ":id", id);
    stmt_bind_blob(&row, ":bytes", bytes, size);
    status = stmt_run(&row, NULL);
    free(bytes);
    if (status)
        return status;
    row = stmt_init(db, "INSERT OR REPLACE INTO job_ends (id, version, least, most)"
                        " VALUES (:id, random(), :least, :most)");
    stmt_bind_integer(&row, ":id", id);
    bind_end(&row, ":least", &least);
    bind_end(&row, ":most", &most);
    return stmt_run(&row, NULL);
}

/* Runs a statement with :key, :first and :last of a segment's jobs. */
static struct stmt news_of(sqlite3 *db, const char *sql, int64_t key, int64_t segment)
{
    struct stmt row = stmt_init(db, sql);

    stmt_bind_integer(&row, ":key", key);
    stmt_bind_integer(&row, ":first", segment << SEGMENT_BITS);
    stmt_bind_integer(&row, ":last", (segment << SEGMENT_BITS) + SEGMENT_JOBS - 1);
    return row;
}
#define OF_NEWS " FROM job_news WHERE key = :key AND job BETWEEN :first AND :last"

/* A column as it is overlaid with its news: those, and what its texts are borrowed from. */
struct overlaid {
    struct column *column;
    size_t news;
    void *bytes;
    struct gathered texts;
};

static void overlaid_fini(struct overlaid *overlaid)
{
    free(overlaid->bytes);
    gathered_fini(&overlaid->texts);
}

static enum store_status read_column(sqlite3 *db, int64_t key, int64_t segment,
                                     struct overlaid *overlaid)
{
    struct column *column = overlaid->column;
    struct stmt row = stmt_init(db, "SELECT bytes FROM job_columns WHERE id = :id");
    size_t size = 0;
    enum store_status status;

    stmt_bind_integer(&row, ":id", column_id(key, segment));
    if (stmt_step(&row))
        overlaid->bytes = stmt_blob(&row, 0, &size);
    status = stmt_fini(&row);
    column_clear(column);
    if (status == STORE_OK && overlaid->bytes && !column_decode(column, overlaid->bytes, size))
        status = store_fault(db, SQLITE_CORRUPT, "decode a column");
    if (status)
        return status;
    row = news_of(db, "SELECT job, value" OF_NEWS, key, segment);
    for (; stmt_step(&row); overlaid->news++) {
        struct scalar found = store_news_scalar(row.handle, 1), value;

        value = keep(&overlaid->texts, &found);
        column_put(column, (size_t)stmt_integer(&row, 0) % SEGMENT_JOBS, &value);
    }
    if (overlaid->texts.failed)
        row.status = store_fault(db, SQLITE_NOMEM, "fold news");
    return stmt_fini(&row);
}

/* The column is written as it is now, with the news that were read into it. */
static enum store_status write_folded(sqlite3 *db, int64_t key, int64_t segment,
                                      const struct overlaid *overlaid)
{
    enum store_status status = write_column(db, column_id(key, segment), overlaid->column);
    struct stmt row;

    if (status || overlaid->news == 0)
        return status;
    row = news_of(db, "DELETE" OF_NEWS, key, segment);
    return stmt_run(&row, NULL);
}

/* News move into their column. */
static enum store_status fold(sqlite3 *db, int64_t key, int64_t segment, struct column *column)
{
    struct overlaid overlaid = {.column = column};
    enum store_status status = read_column(db, key, segment, &overlaid);

    if (status == STORE_OK && overlaid.news > 0)
        status = write_folded(db, key, segment, &overlaid);
    overlaid_fini(&overlaid);
    return status;
}

enum store_status store_segment_fold(sqlite3 *db, int64_t segment)
{
    struct column *column = malloc(sizeof *column);
    struct stmt keys = stmt_init(db, "SELECT id FROM job_keys WHERE id IN (2, 3)"
                                     " OR path >= 'results.' AND path < 'results/'"
                                     " OR path >= 'outcome.' AND path < 'outcome/'");
    enum store_status status = column ? STORE_OK : store_fault(db, SQLITE_NOMEM, "fold news");

    while (status == STORE_OK && stmt_step(&keys))
        status = fold(db, stmt_integer(&keys, 0), segment, column);
    keys.status = keys.status ? keys.status : status;
    free(column);
    return stmt_fini(&keys);
}

/* ------------------------------------------------------------------ sealing */

#define OLD_COLUMNS                                                                                \
    " WHERE id IN (SELECT id << 32 | :segment FROM job_keys"                                       \
    " WHERE path NOT GLOB 'results.*' AND path NOT GLOB 'outcome.*')"

static enum store_status delete_columns(sqlite3 *db, int64_t segment)
{
    static const char *const sql[] = {"DELETE FROM job_columns" OLD_COLUMNS,
                                      "DELETE FROM job_ends" OLD_COLUMNS};
    enum store_status status = STORE_OK;

    for (size_t i = 0; i < sizeof sql / sizeof sql[0] && status == STORE_OK; i++) {
        struct stmt old = stmt_init(db, sql[i]);

        stmt_bind_integer(&old, ":segment", segment);
        status = stmt_run(&old, NULL);
    }
    return status;
}

static enum store_status write_columns(sqlite3 *db, int64_t segment, struct gathered *gathered)
{
    enum store_status status = delete_columns(db, segment);

    for (size_t i = 0; i < gathered->count && status == STORE_OK; i++) {
        int64_t key = 0;

        status = store_segment_key(db, gathered->key[i].path, &key);
        if (status == STORE_OK)
            status = write_column(db, column_id(key, segment), gathered->key[i].column);
    }
    return status;
}

static enum store_status seal(sqlite3 *db, int64_t segment)
{
    struct gathered gathered = {0};
    char states[SEGMENT_JOBS + 1] = "";
    enum store_status status = store_segment_gather(db, segment, &gathered, states);
    struct stmt row;

    if (status == STORE_OK)
        status = write_columns(db, segment, &gathered);
    gathered_fini(&gathered);
    if (status == STORE_OK)
        status = store_segment_fold(db, segment);
    if (status)
        return status;
    row = stmt_init(db, "INSERT OR REPLACE INTO job_segments (segment, states)"
                        " VALUES (:segment, :states)");
    stmt_bind_integer(&row, ":segment", segment);
    stmt_bind_text(&row, ":states", states);
    return stmt_run(&row, NULL);
}

enum store_status store_segment_inserted(sqlite3 *db, int64_t seq)
{
    return seq % SEGMENT_JOBS == SEGMENT_JOBS - 1 ? seal(db, seq >> SEGMENT_BITS) : STORE_OK;
}

#define UNSEALED                                                                                   \
    "WITH RECURSIVE all_segments (segment) AS (SELECT 0 UNION ALL"                                 \
    " SELECT segment + 1 FROM all_segments"                                                        \
    " WHERE segment + 1 < ((SELECT coalesce(max(seq), 0) FROM jobs) + 1) >> 10)"                   \
    " SELECT segment FROM all_segments"                                                            \
    " WHERE segment < ((SELECT coalesce(max(seq), 0) FROM jobs) + 1) >> 10"                        \
    " AND segment NOT IN (SELECT segment FROM job_segments)"

enum store_status store_segment_seal_next(sqlite3 *db, bool *sealed)
{
    struct stmt row = stmt_init(db, UNSEALED " LIMIT 1");
    int64_t segment = 0;

    *sealed = stmt_step(&row);
    if (*sealed)
        segment = stmt_integer(&row, 0);
    return stmt_fini(&row) || !*sealed ? row.status : seal(db, segment);
}

enum store_status store_segment_seal_all(sqlite3 *db)
{
    struct stmt row = stmt_init(db, UNSEALED);
    enum store_status status = store_news_index_old(db);

    while (status == STORE_OK && stmt_step(&row))
        status = seal(db, stmt_integer(&row, 0));
    row.status = row.status ? row.status : status;
    return stmt_fini(&row);
}

/* ---------------------------------------------------------------- job's end */

static enum store_status settle_one(sqlite3 *db, int64_t segment)
{
    struct stmt row =
        news_of(db,
                "SELECT count(*)" OF_NEWS
                " AND EXISTS (SELECT 1 FROM job_segments WHERE segment = :first >> 10)",
                KEY_FINISHED, segment);
    int64_t news = 0;
    enum store_status status;

    if (stmt_step(&row))
        news = stmt_integer(&row, 0);
    status = stmt_fini(&row);
    return status || news < NEWS_MAX ? status : store_segment_fold(db, segment);
}

enum store_status store_segment_settle(sqlite3 *db, int64_t first, int64_t last)
{
    enum store_status status = STORE_OK;

    for (int64_t segment = first >> SEGMENT_BITS;
         segment <= last >> SEGMENT_BITS && status == STORE_OK; segment++)
        status = settle_one(db, segment);
    return status;
}

/* The states of a sealed segment, with a NUL; "" = it is not sealed. */
static enum store_status read_states(sqlite3 *db, int64_t segment, char states[SEGMENT_JOBS + 1])
{
    struct stmt row = stmt_init(db, "SELECT states FROM job_segments WHERE segment = :segment");

    states[0] = '\0';
    stmt_bind_integer(&row, ":segment", segment);
    if (stmt_step(&row))
        stmt_text_to(&row, 0, states, SEGMENT_JOBS + 1);
    return stmt_fini(&row);
}

static enum store_status write_states(sqlite3 *db, int64_t segment, const char *states)
{
    struct stmt row =
        stmt_init(db, "UPDATE job_segments SET states = :states WHERE segment = :segment");

    stmt_bind_text(&row, ":states", states);
    stmt_bind_integer(&row, ":segment", segment);
    return stmt_run(&row, NULL);
}

enum store_status store_segment_cancelled(sqlite3 *db, const int64_t *seqs, size_t count,
                                          int64_t finished_ms)
{
    int64_t segment = seqs[0] >> SEGMENT_BITS;
    const struct scalar finished = scalar_integer(finished_ms);
    struct overlaid overlaid = {.column = malloc(sizeof *overlaid.column)};
    char states[SEGMENT_JOBS + 1];
    enum store_status status = overlaid.column ? read_states(db, segment, states)
                                               : store_fault(db, SQLITE_NOMEM, "cancel jobs");

    if (status == STORE_OK && states[0]) {
        for (size_t i = 0; i < count; i++)
            states[seqs[i] % SEGMENT_JOBS] = 'c';
        status = write_states(db, segment, states);
        if (status == STORE_OK)
            status = read_column(db, KEY_FINISHED, segment, &overlaid);
        for (size_t i = 0; i < count && status == STORE_OK; i++)
            column_put(overlaid.column, (size_t)seqs[i] % SEGMENT_JOBS, &finished);
        if (status == STORE_OK)
            status = write_folded(db, KEY_FINISHED, segment, &overlaid);
    }
    overlaid_fini(&overlaid);
    free(overlaid.column);
    return status;
}
