/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_worker.c - jobs run by the workers give the bytes of the same job run in one thread, however
 * they are stopped, restored, crowded or starved of disk. */
#include "plant.h"

#include "store_attempts.h"
#include "store_internal.h"
#include "store_results.h"
#include "support/experiment.h"
#include "worker.h"

#include <dirent.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* About half a second of one core: long enough to be stopped in the middle. */
static struct bcd_scene *long_scene(void)
{
    return experiment_scene("{'particles':100,'length':200,'diameter':0.5,"
                            "'force':1,'potential':{'type':'cosine','amplitude':6},'time':250,"
                            "'time_step':0.001,'realizations':1,'seed':11,'observables':{"
                            "'msd':{'first':0.01,'last':10,'points':8},'density':{'bins':20},"
                            "'energy':{}}}");
}

/* ------------------------------------------------------------------------- runs */

static void any_number_of_workers_gives_the_same_bytes(void **state)
{
    struct bench *bench = *state;
    static const size_t counts[] = {1, 3};

    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        struct plant plant = plant_start(bench, counts[i]);
        char id[JOB_ID_SIZE];

        job_bench_submit(bench->store, plant.queue, job_bench_scene(5, 1), id);
        assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
        plant_assert_same_bytes(bench->store, id, job_bench_scene(5, 1));
        plant_stop(&plant);
        bench_tear_down(state);
        bench_set_up(state);
        bench = *state;
    }
}

/* Several realizations in a chunk, and a last chunk that is not full. */
static void chunks_of_many_realizations(void **state)
{
    static const char job[] = "{'particles':10,'length':20,'diameter':0.5,'time':10,"
                              "'time_step':0.001,'realizations':47,'observables':{"
                              "'msd':{'first':0.01,'last':1,'points':5},'density':{'bins':10},"
                              "'energy':{}}}";
    struct bench *bench = *state;
    struct bcd_scene *scene = experiment_scene("%s", job);
    struct plant plant = plant_start(bench, 2);
    char id[JOB_ID_SIZE];

    assert_in_range(bcd_scene_chunks(scene), 2, 46);
    job_bench_submit(bench->store, plant.queue, scene, id);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, experiment_scene("%s", job));
}

/* What all attempts took together is told at the end, and no less than the first one took. */
static void assert_core_seconds(struct store *store, const char *id, double least)
{
    struct job_record record;
    double all = 0;

    assert_int_equal(store_jobs_get(store, id, &record), STORE_OK);
    const char *told = record.outcome ? strstr(record.outcome, "\"core_seconds\":") : NULL;
    assert_non_null(told);
    double seconds = strtod(told + strlen("\"core_seconds\":"), NULL);
    job_record_fini(&record);
    assert_int_equal(store_attempts_used(store, id, &all), STORE_OK);
    assert_float_equal(seconds, all, 1e-9 * all);
    assert_true(seconds > least);
}

static void a_stopped_job_goes_on_where_it_was(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    struct job_record record;
    struct blob checkpoint;
    char id[JOB_ID_SIZE];
    double used = 0;
    int stops = 0;

    job_bench_submit(bench->store, plant.queue, long_scene(), id);
    for (double wanted = 0.1; wanted < 0.6; wanted += 0.2) {
        plant_wait_progress(&plant, id, wanted);
        plant_stop(&plant);
        if (bench_state(bench->store, id) == JOB_RUNNING) {
            assert_int_equal(store_results_load_checkpoint(bench->store, id, 0, &checkpoint),
                             STORE_OK);
            blob_fini(&checkpoint);
            double before = used;
            assert_int_equal(store_attempts_used(bench->store, id, &used), STORE_OK);
            assert_true(used > before);
            stops++;
        }
        bench_reopen(bench);
        plant = plant_start(bench, 2);
    }
    assert_in_range(stops, 1, 3); /* else nothing was tested: the job is too short */
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    assert_int_equal(store_jobs_get(bench->store, id, &record), STORE_OK);
    assert_int_equal(record.chunks_done, record.chunks);
    job_record_fini(&record);
    assert_core_seconds(bench->store, id, used);
    assert_int_equal(store_results_load_checkpoint(bench->store, id, 0, &checkpoint),
                     STORE_NOT_FOUND);
    plant_assert_same_bytes(bench->store, id, long_scene());
}

static void progress_grows_from_nothing_to_all(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    double before = 0.0, progress;
    char id[JOB_ID_SIZE];
    int steps = 0;

    job_bench_submit(bench->store, plant.queue, long_scene(), id);
    plant_wait_start(&plant, id);
    while ((progress = queue_progress(plant.queue, id)) >= 0.0) {
        assert_true(progress >= before && progress <= 1.0);
        steps += progress > before;
        before = progress;
        job_bench_nap(2);
    }
    assert_true(steps >= 2);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
}

/* ------------------------------------------------------------------------ damage */

static void a_damaged_checkpoint_is_dropped(void **state)
{
    struct bench *bench = *state;
    struct plant plant;
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, NULL, job_bench_scene(2, 1), id);
    assert_int_equal(store_jobs_start(bench->store, id), STORE_OK);
    assert_int_equal(store_results_checkpoint(bench->store, id, 1, "no checkpoint", 13), STORE_OK);
    plant = plant_start(bench, 1);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, job_bench_scene(2, 1));
}

static void a_damaged_tally_is_run_again(void **state)
{
    struct bench *bench = *state;
    struct plant plant;
    struct job_record record;
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, NULL, job_bench_scene(2, 1), id);
    assert_int_equal(store_jobs_start(bench->store, id), STORE_OK);
    assert_int_equal(store_results_put_chunk(bench->store, id, 0, "no tally", 8), STORE_OK);
    plant = plant_start(bench, 1);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    assert_int_equal(store_jobs_get(bench->store, id, &record), STORE_OK);
    assert_int_equal(record.chunks_done, record.chunks);
    job_record_fini(&record);
    plant_assert_same_bytes(bench->store, id, job_bench_scene(2, 1));
}

/* As they are after a write of which the disk took half: each bit that is off is noticed. */
static void flip_a_bit(struct store *store, const char *sql, int64_t chunk, size_t at)
{
    struct stmt row = stmt_init(store->writer, sql);
    size_t size = 0;
    unsigned char *bytes;

    stmt_bind_integer(&row, ":chunk", chunk);
    assert_true(stmt_step(&row));
    bytes = stmt_blob(&row, 0, &size);
    assert_int_equal(stmt_fini(&row), STORE_OK);
    bytes[at % size] ^= 1U << at % 8;
    row = stmt_init(store->writer, strstr(sql, "chunks")
                                       ? "UPDATE chunks SET bytes = :bytes WHERE chunk = :chunk"
                                       : "UPDATE checkpoints SET bytes = :bytes"
                                         " WHERE chunk = :chunk");
    stmt_bind_blob(&row, ":bytes", bytes, size);
    stmt_bind_integer(&row, ":chunk", chunk);
    assert_int_equal(stmt_run(&row, NULL), STORE_OK);
    free(bytes);
}

static void no_damage_gives_wrong_bits(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    char id[JOB_ID_SIZE];
    int64_t chunks;

    job_bench_submit(bench->store, plant.queue, job_bench_scene(12, 1), id);
    /* Now and then all workers are just between two chunks: there is no checkpoint then. */
    for (double wanted = 0.3;; wanted += 0.05) {
        plant_wait_progress(&plant, id, wanted);
        plant_stop(&plant);
        if (wanted > 0.6 || bench_number(bench->store, "SELECT count(*) FROM checkpoints") > 0)
            break;
        plant = plant_start(bench, 2);
    }
    assert_int_equal(bench_state(bench->store, id), JOB_RUNNING);
    chunks = bench_number(bench->store, "SELECT count(*) FROM chunks");
    assert_in_range(chunks, 2, 11);
    assert_true(bench_number(bench->store, "SELECT count(*) FROM checkpoints") >= 1);
    flip_a_bit(bench->store, "SELECT bytes FROM chunks WHERE chunk = :chunk",
               bench_number(bench->store, "SELECT min(chunk) FROM chunks"), 4711);
    flip_a_bit(bench->store, "SELECT bytes FROM chunks WHERE chunk = :chunk",
               bench_number(bench->store, "SELECT max(chunk) FROM chunks"), 9);
    flip_a_bit(bench->store, "SELECT bytes FROM checkpoints WHERE chunk = :chunk",
               bench_number(bench->store, "SELECT min(chunk) FROM checkpoints"), 12345);
    plant = plant_start(bench, 2);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, job_bench_scene(12, 1));
}

/* So many rods that its checkpoint is not kept in the database. */
static struct bcd_scene *large_scene(int time)
{
    return experiment_scene("{'particles':4000,'length':8000,'diameter':0.5,'force':1,"
                            "'potential':{'type':'cosine','amplitude':6},'time':%d,"
                            "'time_step':0.001,'realizations':1,'seed':11,'observables':{"
                            "'msd':{'first':0.01,'last':10,'points':30},'density':{'bins':20},"
                            "'energy':{}}}",
                            time);
}

static size_t files_in(const struct bench *bench, char path[TEMP_DIR_SIZE + 64])
{
    char folder[TEMP_DIR_SIZE + 16];
    DIR *dir;
    struct dirent *entry;
    size_t count = 0;

    snprintf(folder, sizeof folder, "%s/checkpoints", bench->dir);
    dir = opendir(folder);
    while (dir && (entry = readdir(dir)) != NULL) {
        if (entry->d_name[0] == '.')
            continue;
        snprintf(path, TEMP_DIR_SIZE + 64, "%s/%.40s", folder, entry->d_name);
        count++;
    }
    if (dir)
        closedir(dir);
    return count;
}

/* Stopped three times; before the last start bits of its file are turned. */
static void a_large_checkpoint_is_a_file(void **state)
{
    static const double wanted[] = {0.1, 0.3, 0.5};
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    char id[JOB_ID_SIZE], path[TEMP_DIR_SIZE + 64];
    unsigned char byte = 0;
    int fd;

    job_bench_submit(bench->store, plant.queue, large_scene(12), id);
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        plant_wait_progress(&plant, id, wanted[i]);
        plant_stop(&plant);
        assert_int_equal(bench_state(bench->store, id), JOB_RUNNING);
        assert_int_equal(files_in(bench, path), 1);
        assert_in_range(bench_number(bench->store, "SELECT length(bytes) FROM checkpoints"), 65,
                        200);
        bench_reopen(bench);
        if (i == 2)
            break;
        plant = plant_start(bench, 1);
        plant_wait_start(&plant, id);
        while (queue_progress(plant.queue, id) == 0.0)
            job_bench_nap(1);
        assert_true(queue_progress(plant.queue, id) >= wanted[i]);
    }
    fd = open(path, O_RDWR);
    for (off_t at = 4711; pread(fd, &byte, 1, at) == 1; at += 1 << 16) { /* both places of all */
        byte ^= 4;
        assert_int_equal(pwrite(fd, &byte, 1, at), 1);
    }
    close(fd);
    plant = plant_start(bench, 1);
    plant_wait_start(&plant, id);
    assert_true(queue_progress(plant.queue, id) < 0.3); /* from its start */
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    assert_int_equal(files_in(bench, path), 0);
    plant_assert_same_bytes(bench->store, id, large_scene(12));
}

static void a_cancelled_job_leaves_no_file(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 1);
    char id[JOB_ID_SIZE], path[TEMP_DIR_SIZE + 64];

    job_bench_submit(bench->store, plant.queue, large_scene(12), id);
    plant_wait_progress(&plant, id, 0.1);
    plant_stop(&plant);
    assert_int_equal(files_in(bench, path), 1);
    /* Nobody works at it: the next start removes the file. */
    assert_int_equal(store_jobs_cancel(bench->store, id), STORE_OK);
    plant = plant_start(bench, 1);
    assert_int_equal(files_in(bench, path), 0);
    job_bench_submit(bench->store, plant.queue, large_scene(10000), id);
    while (files_in(bench, path) == 0)
        job_bench_nap(10);
    assert_int_equal(store_jobs_cancel(bench->store, id), STORE_OK);
    queue_cancel(plant.queue, id);
    for (int waited = 0; waited < 6000 && files_in(bench, path) > 0; waited++)
        job_bench_nap(10);
    assert_int_equal(files_in(bench, path), 0);
    plant_stop(&plant);
}

/* Killed after the last chunk was stored and before the tables were. */
static void a_job_with_all_chunks_is_finished_at_start(void **state)
{
    struct bench *bench = *state;
    struct bcd_scene *scene = job_bench_scene(3, 1);
    struct plant plant;
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, NULL, job_bench_scene(3, 1), id);
    assert_int_equal(store_jobs_start(bench->store, id), STORE_OK);
    for (int64_t chunk = 2; chunk >= 0; chunk--) {
        struct bcd_run *run = NULL;
        struct bcd_error error;
        void *bytes;
        size_t size;

        assert_int_equal(bcd_run_create(&run, scene, chunk, &error), BCD_OK);
        assert_int_equal(bcd_run_advance(run, bcd_run_ticks_total(run), NULL), BCD_OK);
        size = bcd_tally_size(bcd_run_tally(run));
        bytes = malloc(size);
        assert_non_null(bytes);
        bcd_tally_save(bcd_run_tally(run), bytes);
        assert_int_equal(store_results_put_chunk(bench->store, id, chunk, bytes, size), STORE_OK);
        free(bytes);
        bcd_run_free(run);
    }
    plant = plant_start(bench, 2);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, scene);
}

static void a_full_disk_is_waited_out(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue, job_bench_scene(16, 1), id);
    plant_wait_progress(&plant, id, 0.05);
    job_bench_disk(true);
    job_bench_nap(400);
    assert_int_equal(bench_state(bench->store, id), JOB_RUNNING);
    job_bench_disk(false);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, job_bench_scene(16, 1));
}

/* A stop does not wait for the disk; what was finished and not stored is done again. */
static void a_stop_with_a_full_disk_loses_nothing(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    char id[JOB_ID_SIZE];

    job_bench_submit(bench->store, plant.queue, job_bench_scene(16, 1), id);
    plant_wait_progress(&plant, id, 0.05);
    job_bench_disk(true);
    job_bench_nap(200);
    plant_stop(&plant);
    job_bench_disk(false);
    assert_int_equal(bench_state(bench->store, id), JOB_RUNNING);
    plant = plant_start(bench, 2);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, job_bench_scene(16, 1));
}

/* A daemon of its own process, until it is killed. */
static void run_until_killed(const char *dir)
{
    struct bench bench = {0};

    snprintf(bench.dir, sizeof bench.dir, "%s", dir);
    bench_reopen(&bench);
    plant_start(&bench, 2);
    for (;;)
        pause();
}

/* SIGKILL at any moment: during recovery, in a chunk, in a commit. No process forks with the
 * database open. */
static void a_killed_daemon_loses_nothing(void **state)
{
    static const int lives_ms[] = {3, 10, 20, 35, 50, 70, 90, 60, 40};
    struct bench *bench = *state;
    struct plant plant;
    char id[JOB_ID_SIZE];
    int64_t before = 0, after;

    job_bench_submit(bench->store, NULL, job_bench_scene(12, 1), id);
    for (size_t i = 0; i < sizeof lives_ms / sizeof lives_ms[0]; i++) {
        pid_t child;

        store_close(bench->store);
        bench->store = NULL;
        child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            run_until_killed(bench->dir);
            _exit(0);
        }
        job_bench_nap(lives_ms[i]);
        assert_int_equal(kill(child, SIGKILL), 0);
        assert_int_equal(waitpid(child, NULL, 0), child);
        bench_reopen(bench);
        after = bench_chunks_done(bench->store, id);
        assert_true(after >= before);
        before = after;
    }
    plant = plant_start(bench, 2);
    assert_int_equal(job_bench_wait(bench->store, id), JOB_DONE);
    plant_stop(&plant);
    plant_assert_same_bytes(bench->store, id, job_bench_scene(12, 1));
}

/* ------------------------------------------------------------------------ cancel */

static void cancel(struct plant *plant, const char *id)
{
    if (store_jobs_cancel(plant->bench->store, id) == STORE_OK)
        queue_cancel(plant->queue, id);
}

static void a_cancelled_job_makes_room(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 2);
    char id[JOB_ID_SIZE], next[JOB_ID_SIZE];
    struct blob blob;

    job_bench_submit(bench->store, plant.queue, long_scene(), id);
    plant_wait_progress(&plant, id, 0.05);
    cancel(&plant, id);
    job_bench_submit(bench->store, plant.queue, job_bench_scene(2, 1), next);
    assert_int_equal(job_bench_wait(bench->store, next), JOB_DONE);
    plant_stop(&plant);
    assert_int_equal(bench_state(bench->store, id), JOB_CANCELLED);
    assert_int_equal(store_results_get(bench->store, id, "msd", &blob), STORE_NOT_FOUND);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM checkpoints"), 0);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM chunks"), 0);
}

enum { RACES = 40 };

/* Cancels come at every moment of short jobs' lives: each ends either way, and cleanly. */
static void a_cancel_may_meet_the_end(void **state)
{
    struct bench *bench = *state;
    struct plant plant = plant_start(bench, 3);
    char id[RACES][JOB_ID_SIZE];
    int64_t counts[JOB_STATES];

    for (int i = 0; i < RACES; i++) {
        struct bcd_scene *scene =
            experiment_scene("{'particles':10,'length':20,'diameter':0.5,'time':%d,"
                             "'time_step':0.001,'realizations':40,'seed':%d,'observables':{"
                             "'energy':{}}}",
                             1 + i % 4, i);
        job_bench_submit(bench->store, plant.queue, scene, id[i]);
        if (i > 0) {
            job_bench_nap(i % 7);
            cancel(&plant, id[i - 1]);
        }
    }
    for (int i = 0; i < RACES; i++) {
        enum job_state ended = job_bench_wait(bench->store, id[i]);
        enum store_status found;
        struct blob blob = {0};

        assert_true(ended == JOB_DONE || ended == JOB_CANCELLED);
        found = store_results_get(bench->store, id[i], "energy", &blob);
        assert_int_equal(found, ended == JOB_DONE ? STORE_OK : STORE_NOT_FOUND);
        blob_fini(&blob);
    }
    plant_stop(&plant);
    assert_int_equal(store_jobs_counts(bench->store, counts), STORE_OK);
    assert_int_equal(counts[JOB_DONE] + counts[JOB_CANCELLED], RACES);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM chunks"), 0);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM checkpoints"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(any_number_of_workers_gives_the_same_bytes),
        BENCH_TEST(chunks_of_many_realizations),
        BENCH_TEST(a_stopped_job_goes_on_where_it_was),
        BENCH_TEST(progress_grows_from_nothing_to_all),
        BENCH_TEST(a_damaged_checkpoint_is_dropped),
        BENCH_TEST(a_damaged_tally_is_run_again),
        BENCH_TEST(no_damage_gives_wrong_bits),
        BENCH_TEST(a_large_checkpoint_is_a_file),
        BENCH_TEST(a_cancelled_job_leaves_no_file),
        BENCH_TEST(a_job_with_all_chunks_is_finished_at_start),
        BENCH_TEST(a_full_disk_is_waited_out),
        BENCH_TEST(a_stop_with_a_full_disk_loses_nothing),
        BENCH_TEST(a_killed_daemon_loses_nothing),
        BENCH_TEST(a_cancelled_job_makes_room),
        BENCH_TEST(a_cancel_may_meet_the_end),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
