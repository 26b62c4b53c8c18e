/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_migrations.c - a database of every earlier schema, with jobs, results, chunks and the rest
 * in it, is brought up to date: nothing is lost, jobs can be found, a backup is beside it; and a
 * kill -9 in the middle leaves it as it was. */
#include "store_bench.h"

#include "sample.h"
#include "store_find.h"
#include "store_internal.h"
#include "store_reports.h"

#include <glob.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { VERSIONS_MAX = 32, JOBS = 1500 };

/* The schema as it was at a version, as far as the released files say. */
static size_t read_schema(struct migration migrations[VERSIONS_MAX])
{
    static char text[VERSIONS_MAX][32768];
    glob_t files;
    size_t count;

    assert_int_equal(glob("schema/[0-9]*.sql", 0, NULL, &files), 0); /* run from the root */
    count = files.gl_pathc;
    assert_in_range(count, 2, VERSIONS_MAX - 1);
    for (size_t i = 0; i < count; i++) {
        FILE *file = fopen(files.gl_pathv[i], "r");

        assert_non_null(file);
        text[i][fread(text[i], 1, sizeof text[i] - 1, file)] = '\0';
        fclose(file);
        migrations[i] = (struct migration){"as it was", text[i]};
    }
    globfree(&files);
    return count;
}

/* The table of an energy that was measured. */
static size_t make_energy(unsigned char *bytes, size_t room)
{
    struct sample sample;
    struct bcd_table *table = NULL;
    size_t size;

    assert_true(sample_init(&sample));
    for (size_t i = 0; (table = sample_table(&sample, i)); i++) {
        if (strcmp(table->name, "energy") == 0)
            break;
        bcd_table_free(table);
    }
    assert_non_null(table);
    table->column[0].values[0] = -1.5;
    size = bcd_table_size(table);
    assert_true(size <= room);
    bcd_table_save(table, bytes);
    bcd_table_free(table);
    sample_fini(&sample);
    return size;
}

/* Written with the columns of version 1 alone, as that version would have; but an Idempotency-Key
 * has had an owner since version 3. */
static void fill(sqlite3 *db, size_t version)
{
    unsigned char bytes[8192];
    size_t size = make_energy(bytes, sizeof bytes);
    struct stmt row;

    assert_int_equal(
        store_exec(
            db, "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1500)"
                "INSERT INTO jobs (seq, id, hash, submitted_ms, chunks, job, derived)"
                " SELECT i, 'jold' || i, CAST(printf('%032d', i) AS BLOB), 1000 + i, 4,"
                " printf('{\"diameter\":%.17g,\"seed\":%d,\"method\":\"bcd\"}', 0.1 * (i % 5), i),"
                " '{\"steps\":' || i || '}' FROM n;"
                "UPDATE jobs SET state = 'running', started_ms = 2000 WHERE seq % 3 = 0;"
                "UPDATE jobs SET state = 'done', chunks_done = 4, finished_ms = 3000 + seq"
                " WHERE seq % 9 = 0;"
                "UPDATE jobs SET state = 'failed', error = 'old \"reason\"', finished_ms = 7"
                " WHERE seq IN (3, 1497);"
                "UPDATE jobs SET state = 'cancelled', finished_ms = 8 WHERE seq = 1;"
                "INSERT INTO chunks (job, chunk, bytes) VALUES (6, 1, x'0102'), (6, 3, x'03');"
                "INSERT INTO checkpoints (job, chunk, bytes) VALUES (6, 2, x'040506');"),
        STORE_OK);
    assert_int_equal(store_exec(db, version < 3 ? "INSERT INTO idempotency_keys (key, job)"
                                                  " VALUES ('old key', 2)"
                                                : "INSERT INTO idempotency_keys (owner, key, job)"
                                                  " VALUES ('local', 'old key', 2)"),
                     STORE_OK);
    row = stmt_init(db, "INSERT INTO results (job, position, observable, bytes)"
                        " SELECT seq, 0, 'energy', :bytes FROM jobs WHERE state = 'done'");
    stmt_bind_blob(&row, ":bytes", bytes, size);
    assert_int_equal(stmt_run(&row, NULL), STORE_OK);
}

static void open_at(struct bench *bench, struct migration *migrations, size_t version)
{
    const struct store_schema schema = {migrations, version};
    char reason[512] = "";

    if (store_open_schema(&bench->store, bench->dir, &schema, reason, sizeof reason) != STORE_OK)
        fail_msg("%s", reason);
}

static void make_old(struct bench *bench, struct migration *migrations, size_t version)
{
    store_close(bench->store);
    bench->store = NULL;
    temp_dir_remove(bench->dir);
    open_at(bench, migrations, version);
    fill(bench->store->writer, version);
    assert_int_equal(bench_number(bench->store, "PRAGMA user_version"), version);
}

static size_t count_found(struct store *store, unsigned states, const char *path, const char *value)
{
    const struct find_condition condition = {.path = path, .value = value};
    const struct find_query query = {
        .states = states, .conditions = &condition, .condition_count = path != NULL, .limit = 400};
    struct find_page page;
    size_t count;

    assert_int_equal(store_find(store, &query, &page), STORE_OK);
    count = page.count;
    find_page_fini(&page);
    return count;
}

static void assert_all_there(struct store *store)
{
    static const char *const checks[] = {
        "SELECT count(*) = 1500 FROM jobs",
        "SELECT sum(jobs) = 1500 FROM job_counts",
        "SELECT jobs = 166 FROM job_counts WHERE state = 'done'",
        "SELECT count(*) = 166 FROM results",
        "SELECT group_concat(hex(bytes)) = '0102,03' FROM chunks WHERE job = 6",
        "SELECT hex(bytes) = '040506' FROM checkpoints WHERE job = 6 AND chunk = 2",
        "SELECT job = 2 FROM idempotency_keys WHERE key = 'old key'",
        "SELECT error = 'old \"reason\"' AND finished_ms = 7 FROM jobs WHERE id = 'jold3'",
        "SELECT count(*) = 0 FROM pragma_foreign_key_check",
        "SELECT group_concat(integrity_check) = 'ok' FROM pragma_integrity_check",
        "SELECT count(*) = 1 FROM job_segments",
    };

    for (size_t i = 0; i < sizeof checks / sizeof checks[0]; i++)
        if (bench_number(store, checks[i]) != 1)
            fail_msg("not so: %s", checks[i]);
}

/* As users see it: found by values that are in the index only since now. */
static void assert_usable(struct store *store)
{
    struct blob blob;
    struct job_record record;
    char id[JOB_ID_SIZE];

    assert_int_equal(count_found(store, 0, "diameter", "0.2"), JOBS / 5);
    assert_int_equal(count_found(store, 0, "derived.steps", "77"), 1);
    assert_int_equal(count_found(store, 1U << JOB_DONE, "owner", "local"), 166);
    assert_int_equal(count_found(store, 0, "results.energy.energy", "-1.5"), 166);
    assert_int_equal(count_found(store, 1U << JOB_FAILED, NULL, NULL), 2);
    assert_int_equal(store_results_get(store, "jold9", "energy", &blob), STORE_OK);
    blob_fini(&blob);
    assert_int_equal(store_jobs_get(store, "jold4", &record), STORE_OK);
    assert_string_equal(record.ticket.owner, "local");
    assert_int_equal(record.state, JOB_QUEUED);
    job_record_fini(&record);
    assert_int_equal(store_jobs_start(store, "jold4"), STORE_OK);
    bench_insert(store, 99, "{\"diameter\":0.2}", id);
    assert_int_equal(count_found(store, 0, "diameter", "0.2"), JOBS / 5 + 1);
}

static void every_earlier_version_is_brought_up_to_date(void **state)
{
    struct migration migrations[VERSIONS_MAX];
    struct bench *bench = *state;
    size_t count = read_schema(migrations);

    for (size_t version = 1; version < count; version++) {
        char backup[TEMP_DIR_SIZE + 40];
        struct stmt row;
        sqlite3 *db;

        make_old(bench, migrations, version);
        bench_reopen(bench);
        assert_int_equal(bench_number(bench->store, "PRAGMA user_version"), count);
        assert_all_there(bench->store);
        assert_usable(bench->store);
        bench_reopen(bench); /* and once more, when nothing is left to do */
        assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM jobs"), JOBS + 1);

        snprintf(backup, sizeof backup, "%s/bcd.sqlite.v%zu.bak", bench->dir, version);
        assert_int_equal(sqlite3_open_v2(backup, &db, SQLITE_OPEN_READONLY, NULL), SQLITE_OK);
        row = stmt_init(db, "SELECT user_version FROM pragma_user_version"
                            " WHERE (SELECT count(*) FROM jobs) = 1500");
        assert_true(stmt_step(&row));
        assert_int_equal(stmt_integer(&row, 0), version);
        assert_int_equal(stmt_fini(&row), STORE_OK);
        sqlite3_close(db);
    }
}

/* A migration that never ends is begun by a process of its own, which is killed in it. */
static void a_kill_in_a_migration_changes_nothing(void **state)
{
    static const char endless[] = "CREATE TABLE half (i INTEGER) STRICT;"
                                  "DELETE FROM results;"
                                  "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
                                  " INSERT INTO half (i) SELECT i FROM n";
    struct migration migrations[VERSIONS_MAX], real;
    struct bench *bench = *state;
    char path[TEMP_DIR_SIZE + 40];
    struct stat log = {0};
    size_t version;
    pid_t child;
    int status;

    read_schema(migrations);
    version = 2;
    make_old(bench, migrations, version);
    store_close(bench->store);
    bench->store = NULL;
    real = migrations[version];
    migrations[version].sql = endless;
    child = fork();
    if (child == 0) {
        open_at(bench, migrations, version + 1);
        _exit(0);
    }
    /* Once it is over the size of its cache it writes: then it is in the middle. */
    snprintf(path, sizeof path, "%s/bcd.sqlite-wal", bench->dir);
    for (int i = 0; i < 3000 && (stat(path, &log) != 0 || log.st_size < 100000); i++)
        usleep(10000);
    assert_true(log.st_size >= 100000);
    assert_int_equal(kill(child, SIGKILL), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);

    migrations[version] = real;
    open_at(bench, migrations, version);
    assert_int_equal(bench_number(bench->store, "PRAGMA user_version"), version);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM results"), 166);
    assert_int_equal(
        bench_number(bench->store, "SELECT count(*) FROM sqlite_schema WHERE name = 'half'"), 0);
    bench_reopen(bench);
    assert_all_there(bench->store);
    assert_usable(bench->store);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(every_earlier_version_is_brought_up_to_date),
        BENCH_TEST(a_kill_in_a_migration_changes_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
