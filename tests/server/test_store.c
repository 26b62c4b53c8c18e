/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store.c - store.h: opening, refusing, migrating, full disks, threads. */
#include "store_bench.h"

#include "limits.h"
#include "store_internal.h"
#include "store_results.h"

#include <glob.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

/* -------------------------------------------------------------------- opening */

static void opens_with_the_promised_settings(void **state)
{
    struct bench *bench = *state;
    struct store *store = bench->store;
    char path[TEMP_DIR_SIZE + 32];
    struct stat info;

    assert_int_equal(bench_number(store, "PRAGMA application_id"), STORE_APPLICATION_ID);
    assert_true(bench_number(store, "PRAGMA user_version") >= 1);
    assert_int_equal(bench_number(store, "PRAGMA synchronous"), 2);
    assert_int_equal(bench_number(store, "PRAGMA foreign_keys"), 1);
    assert_int_equal(bench_number(store, "PRAGMA trusted_schema"), 0);
    assert_int_equal(bench_number(store, "PRAGMA busy_timeout"), STORE_BUSY_MS);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM sqlite_schema"
                                         " WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
                                         " AND sql NOT LIKE '%STRICT%'"),
                     0);
    snprintf(path, sizeof path, "%s/bcd.sqlite", bench->dir);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0600);
    snprintf(path, sizeof path, "%s/bcd.sqlite-wal", bench->dir);
    assert_int_equal(stat(path, &info), 0);
}

static void only_one_connection_can_write(void **state)
{
    struct store *store = ((struct bench *)*state)->store;

    assert_int_equal(store->idle_count, STORE_READERS);
    for (size_t i = 0; i < STORE_READERS; i++) {
        sqlite3 *db = store->idle[i];
        struct stmt row = stmt_init(db, "PRAGMA wal_autocheckpoint");

        assert_int_equal(sqlite3_db_readonly(db, "main"), 1);
        assert_true(stmt_step(&row));
        assert_int_equal(stmt_integer(&row, 0), 0);
        assert_int_equal(stmt_fini(&row), STORE_OK);
        assert_int_equal(store_exec(db, "UPDATE job_counts SET jobs = 7"), STORE_BROKEN);
    }
    assert_int_equal(sqlite3_db_readonly(store->writer, "main"), 0);
}

static void creates_directories_for_the_owner_alone(void **state)
{
    struct bench *bench = *state;
    char parent[TEMP_DIR_SIZE + 8], dir[TEMP_DIR_SIZE + 16], reason[512];
    struct store *store = NULL;
    struct stat info;

    snprintf(parent, sizeof parent, "%s/a", bench->dir);
    snprintf(dir, sizeof dir, "%s/a//b/", bench->dir);
    assert_int_equal(store_open(&store, dir, reason, sizeof reason), STORE_OK);
    assert_int_equal(stat(dir, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0700);
    store_close(store);
    temp_dir_remove(dir);
    temp_dir_remove(parent);
}

static void keeps_what_it_was_given(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE];

    bench_insert(bench->store, 1, "{\"particles\":5}", id);
    bench_reopen(bench);
    assert_int_equal(bench_state(bench->store, id), JOB_QUEUED);
}

static void refuses_a_second_daemon(void **state)
{
    struct bench *bench = *state;
    struct store *second = NULL;
    char reason[512] = "";

    assert_int_equal(store_open(&second, bench->dir, reason, sizeof reason), STORE_CONFLICT);
    assert_null(second);
    assert_non_null(strstr(reason, "another bcdd"));
    assert_non_null(strstr(reason, bench->dir));
}

static void assert_refused(struct bench *bench, const char *why)
{
    struct store *store = NULL;
    char reason[512] = "";

    assert_int_not_equal(store_open(&store, bench->dir, reason, sizeof reason), STORE_OK);
    assert_null(store);
    if (!strstr(reason, why))
        fail_msg("\"%s\" does not say \"%s\"", reason, why);
}

static void refuses_a_newer_schema(void **state)
{
    struct bench *bench = *state;

    assert_int_equal(store_exec(bench->store->writer, "PRAGMA user_version = 999"), STORE_OK);
    store_close(bench->store);
    bench->store = NULL;
    assert_refused(bench, "newer");
}

static void refuses_a_database_of_another_program(void **state)
{
    struct bench *bench = *state;

    assert_int_equal(store_exec(bench->store->writer, "PRAGMA application_id = 12345"), STORE_OK);
    store_close(bench->store);
    bench->store = NULL;
    assert_refused(bench, "another program");
}

static void refuses_a_database_without_a_name(void **state)
{
    struct bench *bench = *state;

    assert_int_equal(
        store_exec(bench->store->writer, "PRAGMA application_id = 0; PRAGMA user_version = 0"),
        STORE_OK);
    store_close(bench->store);
    bench->store = NULL;
    assert_refused(bench, "another program");
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");

    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static void refuses_what_is_no_database(void **state)
{
    struct bench *bench = *state;
    char path[TEMP_DIR_SIZE + 32];

    store_close(bench->store);
    bench->store = NULL;
    snprintf(path, sizeof path, "%s/bcd.sqlite", bench->dir);
    write_text(path, "This is a diary and not a database, and it must not be overwritten.\n");
    assert_refused(bench, "not a database");
}

static void refuses_a_file_as_directory(void **state)
{
    struct bench *bench = *state;
    struct bench wrong = {0};

    snprintf(wrong.dir, sizeof wrong.dir, "%.200s/bcd.sqlite", bench->dir);
    assert_refused(&wrong, "not a directory");
}

enum { MIGRATIONS_MAX = 64 };

/* The migrations as they are, how many tells *count, and a last one that changes something. */
static enum store_status open_with(struct bench *bench, const char *last, size_t *count,
                                   char *reason)
{
    static char text[MIGRATIONS_MAX][32768];
    struct migration migrations[MIGRATIONS_MAX + 1];
    struct store_schema schema = {migrations, 0};
    glob_t files;

    assert_int_equal(glob("schema/[0-9]*.sql", 0, NULL, &files), 0); /* run from the root */
    assert_true(files.gl_pathc <= MIGRATIONS_MAX);
    for (size_t i = 0; i < files.gl_pathc; i++) {
        FILE *file = fopen(files.gl_pathv[i], "r");

        assert_non_null(file);
        text[i][fread(text[i], 1, sizeof text[i] - 1, file)] = '\0';
        fclose(file);
        migrations[i] = (struct migration){"as it is", text[i]};
    }
    migrations[files.gl_pathc] = (struct migration){"test.sql", last};
    *count = files.gl_pathc;
    schema.count = files.gl_pathc + (last != NULL);
    globfree(&files);
    store_close(bench->store);
    bench->store = NULL;
    return store_open_schema(&bench->store, bench->dir, &schema, reason, 512);
}

static void migrates_after_a_backup(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE], path[TEMP_DIR_SIZE + 32], reason[512] = "";
    size_t version;
    sqlite3 *backup;
    struct stmt row;

    temp_dir_remove(bench->dir);
    assert_int_equal(open_with(bench, NULL, &version, reason), STORE_OK);
    bench_insert(bench->store, 1, "{\"particles\":5}", id);
    assert_int_equal(open_with(bench, "ALTER TABLE jobs ADD COLUMN extra TEXT", &version, reason),
                     STORE_OK);
    assert_int_equal(bench_number(bench->store, "PRAGMA user_version"), version + 1);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM jobs WHERE extra IS NULL"),
                     1);
    assert_int_equal(bench_state(bench->store, id), JOB_QUEUED);

    snprintf(path, sizeof path, "%s/bcd.sqlite.v%zu.bak", bench->dir, version);
    assert_int_equal(sqlite3_open_v2(path, &backup, SQLITE_OPEN_READONLY, NULL), SQLITE_OK);
    row = stmt_init(backup, "SELECT user_version FROM pragma_user_version"
                            " WHERE (SELECT count(*) FROM jobs) = 1");
    assert_true(stmt_step(&row));
    assert_int_equal(stmt_integer(&row, 0), version);
    assert_int_equal(stmt_fini(&row), STORE_OK);
    sqlite3_close(backup);
}

static void a_failed_migration_changes_nothing(void **state)
{
    struct bench *bench = *state;
    char id[JOB_ID_SIZE], reason[512] = "";
    size_t version;

    temp_dir_remove(bench->dir);
    assert_int_equal(open_with(bench, NULL, &version, reason), STORE_OK);
    bench_insert(bench->store, 1, "{\"particles\":5}", id);
    assert_int_equal(open_with(bench, "CREATE TABLE extra (a INT) STRICT; DROP TABLE nothing;",
                               &version, reason),
                     STORE_BROKEN);
    assert_non_null(strstr(reason, "test.sql"));
    assert_int_equal(open_with(bench, NULL, &version, reason), STORE_OK);
    assert_int_equal(bench_number(bench->store, "PRAGMA user_version"), version);
    assert_int_equal(
        bench_number(bench->store, "SELECT count(*) FROM sqlite_schema WHERE name = 'extra'"), 0);
    assert_int_equal(bench_state(bench->store, id), JOB_QUEUED);
}

/* ------------------------------------------------------------------- full disks */

/* SQLite's own limit on pages answers SQLITE_FULL, as a full disk does. */
static void a_full_database_changes_nothing(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    static const char big[300000];
    char id[JOB_ID_SIZE];
    struct blob blob;

    bench_insert(store, 1, "{}", id);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_results_checkpoint(store, id, 0, "old", 3), STORE_OK);
    assert_true(bench_number(store, "PRAGMA max_page_count = 40") >= 1);
    assert_int_equal(store_results_checkpoint(store, id, 0, big, sizeof big), STORE_FULL);
    assert_int_equal(store_results_put_chunk(store, id, 0, big, sizeof big), STORE_FULL);
    assert_int_equal(bench_chunks_done(store, id), 0);
    assert_int_equal(store_results_load_checkpoint(store, id, 0, &blob), STORE_OK);
    bench_assert_blob(&blob, "old");
    blob_fini(&blob);
    assert_true(bench_number(store, "PRAGMA max_page_count = 1000000") >= 1);
    assert_int_equal(store_results_put_chunk(store, id, 0, big, sizeof big), STORE_OK);
    assert_int_equal(bench_chunks_done(store, id), 1);
}

/* A limit on file sizes reaches SQLite as an I/O error (EFBIG), not as SQLITE_FULL. */
static void a_limit_on_the_file_is_a_full_disk(void **state)
{
    struct bench *bench = *state;
    static const char big[400000];
    struct rlimit kept, small;
    char id[JOB_ID_SIZE];
    enum store_status status;

    bench_insert(bench->store, 1, "{}", id);
    assert_int_equal(store_jobs_start(bench->store, id), STORE_OK);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &kept), 0);
    small = kept;
    small.rlim_cur = 200000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    status = store_results_put_chunk(bench->store, id, 0, big, sizeof big);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &kept), 0);
    assert_int_equal(status, STORE_FULL);
    assert_int_equal(bench_chunks_done(bench->store, id), 0);
    assert_int_equal(store_results_put_chunk(bench->store, id, 0, big, sizeof big), STORE_OK);
    bench_reopen(bench);
    assert_int_equal(bench_chunks_done(bench->store, id), 1);
}

/* ---------------------------------------------------------------------- threads */

enum { THREADS = 4, JOBS_PER_THREAD = 40 };

struct crowd {
    struct store *store;
    int number;
    bool failed;
};

/* Every thread submits the same jobs, reads them back and moves those that it made first. */
static void *crowd_main(void *context)
{
    struct crowd *crowd = context;

    for (int i = 0; i < JOBS_PER_THREAD && !crowd->failed; i++) {
        struct job_new job = bench_job(i, "{\"particles\":5}");
        struct job_record record = {0}, read = {0};
        int64_t counts[JOB_STATES];
        bool existed = false;

        crowd->failed = store_jobs_insert(crowd->store, &job, &record, &existed) ||
                        store_jobs_get(crowd->store, record.id, &read) ||
                        store_jobs_counts(crowd->store, counts) ||
                        (!existed && store_jobs_start(crowd->store, record.id)) ||
                        strcmp(read.id, record.id) != 0;
        job_record_fini(&read);
        job_record_fini(&record);
    }
    return NULL;
}

static void many_threads_agree(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct crowd crowd[THREADS];
    pthread_t threads[THREADS];

    for (int i = 0; i < THREADS; i++) {
        crowd[i] = (struct crowd){.store = store, .number = i};
        assert_int_equal(pthread_create(&threads[i], NULL, crowd_main, &crowd[i]), 0);
    }
    for (int i = 0; i < THREADS; i++)
        pthread_join(threads[i], NULL);
    for (int i = 0; i < THREADS; i++)
        assert_false(crowd[i].failed);
    bench_assert_counts(store, (int64_t[]){0, JOBS_PER_THREAD, 0, 0, 0});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(opens_with_the_promised_settings),
        BENCH_TEST(only_one_connection_can_write),
        BENCH_TEST(creates_directories_for_the_owner_alone),
        BENCH_TEST(keeps_what_it_was_given),
        BENCH_TEST(refuses_a_second_daemon),
        BENCH_TEST(refuses_a_newer_schema),
        BENCH_TEST(refuses_a_database_of_another_program),
        BENCH_TEST(refuses_a_database_without_a_name),
        BENCH_TEST(refuses_what_is_no_database),
        BENCH_TEST(refuses_a_file_as_directory),
        BENCH_TEST(migrates_after_a_backup),
        BENCH_TEST(a_failed_migration_changes_nothing),
        BENCH_TEST(a_full_database_changes_nothing),
        BENCH_TEST(a_limit_on_the_file_is_a_full_disk),
        BENCH_TEST(many_threads_agree),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
