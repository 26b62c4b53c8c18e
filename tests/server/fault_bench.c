/* SPDX-License-Identifier: GPL-3.0-or-later
 * fault_bench.c - see fault_bench.h. */
#include "fault_bench.h"

#include "store_internal.h"
#include "store_samples.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { BLOB_BYTES = 20000, K_MAX = 100000 };

/* ---------------------------------------------------------------------- memory */

static struct {
    sqlite3_mem_methods below;
    int64_t k, calls; /* k = 0: nothing fails */
    bool met;
} memory;

static bool runs_out(void)
{
    if (memory.k == 0 || ++memory.calls != memory.k)
        return false;
    return memory.met = true;
}

static void *memory_malloc(int size)
{
    return runs_out() ? NULL : memory.below.xMalloc(size);
}

static void *memory_realloc(void *bytes, int size)
{
    return runs_out() ? NULL : memory.below.xRealloc(bytes, size);
}

void fault_bench_begin(void)
{
    sqlite3_mem_methods methods;

    assert_int_equal(sqlite3_config(SQLITE_CONFIG_GETMALLOC, &memory.below), SQLITE_OK);
    methods = memory.below;
    methods.xMalloc = memory_malloc;
    methods.xRealloc = memory_realloc;
    assert_int_equal(sqlite3_config(SQLITE_CONFIG_MALLOC, &methods), SQLITE_OK);
    assert_int_equal(sqlite3_initialize(), SQLITE_OK);
    power_vfs_register();
    if (access("/dev/shm", W_OK) == 0) /* thousands of databases: no disk is to wait for */
        setenv("TMPDIR", "/dev/shm", 1);
}

/* --------------------------------------------------------------------- the day */

enum { JOBS = 3 };
enum step {
    INSERT_0,
    INSERT_1,
    START_0,
    CHECKPOINT,
    CHUNK_0,
    CHUNK_1,
    WAL_BACK, /* what is in the write-ahead log goes into the database */
    CHUNK_2,
    DONE_0,
    CANCEL_1,
    INSERT_2,
    AUDIT,
    STEPS
};

struct day {
    struct store *store;
    char id[JOBS][JOB_ID_SIZE];
    bool acknowledged[STEPS];
};

static const char *blob(char letter)
{
    static char bytes[BLOB_BYTES];

    memset(bytes, letter, sizeof bytes);
    return bytes;
}

static enum store_status insert(struct day *day, int number)
{
    struct job_new job = bench_job(number + 1, "{\"particles\":5,\"seed\":7}");
    struct job_record record;
    bool existed;
    enum store_status status = store_jobs_insert(day->store, &job, &record, &existed);

    if (status)
        return status;
    snprintf(day->id[number], JOB_ID_SIZE, "%s", record.id);
    job_record_fini(&record);
    return STORE_OK;
}

static enum store_status finish(struct day *day)
{
    const struct result_new result = {"energy", blob('r'), BLOB_BYTES};

    return store_results_finish(day->store, day->id[0], &result, 1);
}

/* As the daemon does it after a full disk, and SQLite by itself every thousand pages. */
static enum store_status move_log(struct store *store)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return status;
    status = store_end(store, STORE_OK);
    sqlite3_wal_checkpoint_v2(store->writer, NULL, SQLITE_CHECKPOINT_TRUNCATE, NULL, NULL);
    return status;
}

static enum store_status take_step(struct day *day, enum step step)
{
    struct store *store = day->store;
    static const struct identity by = {.owner = "local"};

    switch (step) {
    case INSERT_0:
        return insert(day, 0);
    case INSERT_1:
        return insert(day, 1);
    case INSERT_2:
        return insert(day, 2);
    case START_0:
        return store_jobs_start(store, day->id[0]);
    case CHECKPOINT:
        return store_results_checkpoint(store, day->id[0], 2, blob('c'), BLOB_BYTES);
    case CHUNK_0:
        return store_results_put_chunk(store, day->id[0], 0, blob('0'), BLOB_BYTES);
    case CHUNK_1:
        return store_results_put_chunk(store, day->id[0], 1, blob('1'), BLOB_BYTES);
    case CHUNK_2:
        return store_results_put_chunk(store, day->id[0], 2, blob('2'), BLOB_BYTES);
    case WAL_BACK:
        return move_log(store);
    case DONE_0:
        return finish(day);
    case CANCEL_1:
        return store_jobs_cancel(store, day->id[1]);
    case AUDIT:
        return store_audit_write(store, &(struct audit_new){&by, "test", "day", "x"});
    case STEPS:
        break;
    }
    return STORE_BROKEN;
}

/* -------------------------------------------------------------------- checking */

static void assert_blob(enum store_status status, struct blob *found, char letter)
{
    assert_int_equal(status, STORE_OK);
    assert_int_equal(found->size, BLOB_BYTES);
    assert_memory_equal(found->bytes, blob(letter), BLOB_BYTES);
    blob_fini(found);
}

static void assert_chunks(struct day *day)
{
    struct blob found = {0};

    for (int chunk = 0; chunk < 3; chunk++)
        if (day->acknowledged[chunk == 2 ? CHUNK_2 : chunk == 1 ? CHUNK_1 : CHUNK_0])
            assert_blob(store_results_load_chunk(day->store, day->id[0], chunk, &found), &found,
                        (char)('0' + chunk));
    if (day->acknowledged[CHECKPOINT] &&
        store_results_load_chunk(day->store, day->id[0], 2, &found) != STORE_OK)
        assert_blob(store_results_load_checkpoint(day->store, day->id[0], 2, &found), &found, 'c');
    blob_fini(&found);
}

/* All that was acknowledged; what was not may be there or not, but whole. */
static void assert_day(struct day *day)
{
    static const char *const sound[] = {
        "SELECT group_concat(integrity_check) = 'ok' FROM pragma_integrity_check",
        "SELECT count(*) = 0 FROM pragma_foreign_key_check",
        "SELECT (SELECT sum(jobs) FROM job_counts) = (SELECT count(*) FROM jobs)",
        "SELECT count(*) = 0 FROM attempts JOIN jobs ON seq = attempts.job"
        " WHERE (ended IS NULL) <> (state = 'running')",
        "SELECT count(*) = 0 FROM jobs WHERE state <> 'done' AND chunks_done <>"
        " (SELECT count(*) FROM chunks WHERE chunks.job = jobs.seq)",
    };
    struct blob found = {0};
    enum job_state state;

    for (size_t i = 0; i < sizeof sound / sizeof sound[0]; i++)
        if (bench_number(day->store, sound[i]) != 1)
            fail_msg("not so: %s", sound[i]);
    if (day->acknowledged[INSERT_2])
        assert_int_equal(bench_state(day->store, day->id[2]), JOB_QUEUED);
    if (day->acknowledged[INSERT_1]) {
        state = bench_state(day->store, day->id[1]);
        assert_true(state == JOB_CANCELLED ||
                    (state == JOB_QUEUED && !day->acknowledged[CANCEL_1]));
    }
    if (day->acknowledged[AUDIT])
        assert_int_equal(
            bench_number(day->store, "SELECT count(*) FROM audit WHERE action = 'test'"), 1);
    if (!day->acknowledged[INSERT_0])
        return;
    state = bench_state(day->store, day->id[0]);
    if (state == JOB_DONE)
        assert_blob(store_results_get(day->store, day->id[0], "energy", &found), &found, 'r');
    else if (day->acknowledged[DONE_0])
        fail_msg("a finished job is %s", job_state_name(state));
    else
        assert_chunks(day);
    if (day->acknowledged[START_0])
        assert_true(state == JOB_RUNNING || state == JOB_DONE);
}

/* ------------------------------------------------------------------- beginnings */

static void copy_file(const char *from, const char *to)
{
    static char bytes[8 << 20];
    FILE *file = fopen(from, "rb");
    size_t size;

    assert_non_null(file);
    size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    assert_in_range(size, 1000, sizeof bytes - 1);
    file = fopen(to, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* Without a store, and with an empty database of today's schema beside it as a pattern. */
static void make_pattern(struct bench *bench, char path[TEMP_DIR_SIZE + 32],
                         char pattern[TEMP_DIR_SIZE + 32])
{
    store_close(bench->store);
    bench->store = NULL;
    snprintf(path, TEMP_DIR_SIZE + 32, "%s/bcd.sqlite", bench->dir);
    snprintf(pattern, TEMP_DIR_SIZE + 32, "%s/pattern", bench->dir);
    copy_file(path, pattern);
}

static void begin_anew(const char *path, const char *pattern)
{
    char name[TEMP_DIR_SIZE + 40];

    snprintf(name, sizeof name, "%s-wal", path);
    unlink(name);
    snprintf(name, sizeof name, "%s-shm", path);
    unlink(name);
    unlink(path);
    power_vfs_forget();
    if (pattern)
        copy_file(pattern, path);
}

static void drop_shared_memory(const char *path)
{
    char name[TEMP_DIR_SIZE + 40];

    snprintf(name, sizeof name, "%s-shm", path);
    unlink(name);
}

/* ----------------------------------------------------------------------- faults */

int fault_writers(struct bench *bench)
{
    char path[TEMP_DIR_SIZE + 32], pattern[TEMP_DIR_SIZE + 32];
    struct day day = {0};
    int writers;

    make_pattern(bench, path, pattern);
    begin_anew(path, pattern);
    bench_reopen(bench);
    day.store = bench->store;
    for (enum step step = 0; step < STEPS; step++) {
        assert_int_equal(take_step(&day, step), STORE_OK);
        day.acknowledged[step] = true;
        assert_day(&day);
    }
    writers = power_vfs_writers();
    return writers;
}

static int cut_everywhere(struct bench *bench, int stride, bool at_start)
{
    char path[TEMP_DIR_SIZE + 32], pattern[TEMP_DIR_SIZE + 32], reason[512];

    make_pattern(bench, path, pattern);
    for (int k = 1; k < K_MAX; k += stride) {
        struct day day = {0};
        bool met;

        begin_anew(path, at_start ? NULL : pattern);
        power_vfs_arm(POWER_CUT, k);
        if (store_open(&bench->store, bench->dir, reason, sizeof reason) == STORE_OK) {
            day.store = bench->store;
            for (enum step step = 0; step < STEPS && !power_vfs_met(); step++)
                day.acknowledged[step] = take_step(&day, step) == STORE_OK;
            store_close(bench->store);
        }
        met = power_vfs_met();
        power_vfs_restore((uint64_t)k);
        drop_shared_memory(path);
        bench->store = NULL;
        bench_reopen(bench);
        day.store = bench->store;
        assert_day(&day);
        store_close(bench->store);
        bench->store = NULL;
        if (!met) {
            print_message("# %d calls\n", k);
            return k;
        }
    }
    fail_msg("the day has no end");
    return 0;
}

int fault_power_cuts(struct bench *bench, int stride)
{
    return cut_everywhere(bench, stride, false);
}

int fault_power_cuts_at_start(struct bench *bench, int stride)
{
    return cut_everywhere(bench, stride, true);
}

static void arm(enum power_fault fault, int k)
{
    if (fault == POWER_NONE) {
        memory.calls = 0;
        memory.met = false;
        memory.k = k;
    } else {
        power_vfs_arm(fault, k);
    }
}

static bool disarm(enum power_fault fault)
{
    bool met = fault == POWER_NONE ? memory.met : power_vfs_met();

    memory.k = 0;
    power_vfs_arm(POWER_NONE, 0);
    return met;
}

/* A step fails in words, and works as soon as the fault is gone: the first that meets it. */
static void live_through(struct day *day, enum power_fault fault, bool *met)
{
    for (enum step step = 0; step < STEPS; step++) {
        enum store_status status = take_step(day, step);

        if (status) {
            assert_true(status == STORE_FULL || status == STORE_BROKEN);
            if (fault == POWER_FULL_ON)
                assert_int_equal(status, STORE_FULL);
            *met |= disarm(fault);
            assert_true(*met);
            assert_day(day);
            assert_int_equal(take_step(day, step), STORE_OK);
        }
        day->acknowledged[step] = true;
    }
    *met |= disarm(fault);
}

static int fail_everywhere(struct bench *bench, enum power_fault fault, int stride)
{
    char path[TEMP_DIR_SIZE + 32], pattern[TEMP_DIR_SIZE + 32], reason[512];

    make_pattern(bench, path, pattern);
    for (int k = 1; k < K_MAX; k += stride) {
        struct day day = {0};
        bool met = false;

        begin_anew(path, pattern);
        reason[0] = '\0';
        arm(fault, k);
        if (store_open(&bench->store, bench->dir, reason, sizeof reason) != STORE_OK) {
            met = disarm(fault);
            assert_true(met);
            assert_true(strlen(reason) > strlen(bench->dir)); /* it says what and where */
            bench->store = NULL;
            bench_reopen(bench);
        }
        day.store = bench->store;
        live_through(&day, fault, &met);
        assert_day(&day);
        bench_reopen(bench);
        day.store = bench->store;
        assert_day(&day);
        store_close(bench->store);
        bench->store = NULL;
        if (!met) {
            print_message("# %d calls\n", k);
            return k;
        }
    }
    fail_msg("the day has no end");
    return 0;
}

int fault_disk(struct bench *bench, enum power_fault fault, int stride)
{
    return fail_everywhere(bench, fault, stride);
}

int fault_memory(struct bench *bench, int stride)
{
    return fail_everywhere(bench, POWER_NONE, stride);
}
