/* SPDX-License-Identifier: GPL-3.0-or-later
 * The largest sweep that is taken, and 10^4 finished MSDs in every form: how long it takes and how
 * much memory. Time is that of the process, for others may be at work; bounds are generous enough
 * for a loaded machine, the figures printed are what counts. */
#include "desk.h"
#include "scene_json.h"
#include "store_internal.h"

#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define BASE                                                                                       \
    "{\"particles\":100,\"length\":200,\"diameter\":0.5,\"potential\":{\"type\":\"cosine\","       \
    "\"amplitude\":6},\"time\":10,\"observables\":{\"msd\":{\"first\":0.01,\"last\":5,"            \
    "\"points\":40},\"density\":{\"bins\":50}}}"

static double seconds(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int ask_timed(struct desk *f, const char *method, const char *path, const char *body)
{
    double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    int status = ask(f, method, path, body);
    if (status < 300 && !f->reply.stream.read)
        print_message("%s %s: %.2f s, %.2f s of processor time\n", method, path,
                      seconds(CLOCK_MONOTONIC) - wall, seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu);
    return status;
}

static void run_sql(struct desk *f, const char *sql)
{
    sqlite3 *db;
    assert_int_equal(STORE_BEGIN(f->service.store, &db), STORE_OK);
    assert_int_equal(store_end(f->service.store, store_exec(db, sql)), STORE_OK);
}

/* Resident memory now and at its highest since the last reset, in bytes. */
static double memory(const char *name)
{
    char line[128];
    double kib = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof(line), file))
        if (strncmp(line, name, strlen(name)) == 0)
            kib = strtod(line + strlen(name) + 1, NULL);
    if (file)
        fclose(file);
    return 1024 * kib;
}

static void reset_peak(void)
{
    FILE *file = fopen("/proc/self/clear_refs", "w");
    assert_non_null(file);
    fputs("5", file);
    fclose(file);
}

/* Keeps a sweep of 10^5 points and cancels it. */
static void keep_largest(struct desk *f, const char *body)
{
    char path[64];
    malloc_trim(0);
    reset_peak();
    double cpu = seconds(CLOCK_PROCESS_CPUTIME_ID), before = memory("VmRSS");
    assert_int_equal(ask_timed(f, "POST", "/v1/sweeps", body), 202);
    assert_true(seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu < 30);
    print_message("10^5 points: %.1f MB more memory\n", 1e-6 * (memory("VmHWM") - before));
    assert_non_null(strstr(f->reply.body, "\"jobs\":100000,\"states\":{\"queued\":100000,"));
    desk_take_id(f, f->id);
    snprintf(path, sizeof(path), "/v1/sweeps/%s", f->id);
    assert_int_equal(ask_timed(f, "GET", path, NULL), 200);
    assert_int_equal(ask_timed(f, "DELETE", path, NULL), 200);
    assert_non_null(strstr(f->reply.body, "\"cancelled\":100000}"));
}

static void largest_sweep(void **state)
{
    keep_largest(*state, "{\"base\":" BASE ",\"axes\":{\"/diameter\":{\"from\":0.01,\"to\":1,"
                         "\"points\":100},\"/potential/amplitude\":{\"from\":0.1,\"to\":10,"
                         "\"points\":100},\"/seed\":{\"first\":1,\"count\":10}}}");
}

/* Each point is another scene. */
static void largest_without_seeds(void **state)
{
    keep_largest(*state, "{\"base\":" BASE ",\"axes\":{\"/diameter\":{\"from\":0.01,\"to\":1,"
                         "\"points\":250},\"/potential/amplitude\":{\"from\":0.1,\"to\":10,"
                         "\"points\":400}}}");
}

/* The table of a real job, by the engine's own hands. */
static void *make_table(size_t *size)
{
    struct bcd_scene *scene = NULL;
    struct bcd_tally *tally = NULL;
    struct bcd_table *table = NULL;
    assert_int_equal(scene_json_parse(BASE, strlen(BASE), &scene, NULL), BCD_OK);
    assert_int_equal(bcd_tally_create(&tally, scene), BCD_OK);
    struct bcd_run *run = NULL;
    assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(run, bcd_run_ticks_total(run), NULL), BCD_OK);
    bcd_tally_merge(tally, bcd_run_tally(run));
    bcd_run_free(run);
    assert_int_equal(bcd_tally_table(tally, scene, NULL, 0, &table), BCD_OK);
    assert_string_equal(table->name, "msd");
    *size = bcd_table_size(table);
    void *bytes = malloc(*size);
    bcd_table_save(table, bytes);
    bcd_table_free(table);
    bcd_tally_free(tally);
    bcd_scene_free(scene);
    return bytes;
}

/* All jobs become done with that table. */
static void finish_jobs(struct desk *f)
{
    size_t size = 0;
    void *bytes = make_table(&size);
    sqlite3 *db;
    run_sql(f, "UPDATE jobs SET state = 'running', started_ms = 1 WHERE state = 'queued'");
    run_sql(f, "UPDATE jobs SET state = 'done', finished_ms = 2, chunks_done = chunks"
               " WHERE state = 'running'");
    assert_int_equal(STORE_BEGIN(f->service.store, &db), STORE_OK);
    struct stmt row = stmt_init(db, "INSERT INTO results (job, position, observable, bytes)"
                                    " SELECT seq, 0, 'msd', :bytes FROM jobs WHERE state = 'done'");
    stmt_bind_blob(&row, ":bytes", bytes, size);
    assert_int_equal(store_end(f->service.store, stmt_run(&row, NULL)), STORE_OK);
    free(bytes);
}

static void export(struct desk *f, const char *form)
{
    char path[96], piece[32 << 10];
    size_t total = 0;
    ssize_t got;
    malloc_trim(0);
    reset_peak();
    double before = memory("VmRSS"), wall = seconds(CLOCK_MONOTONIC),
           cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    snprintf(path, sizeof(path), "/v1/sweeps/%s/results/msd%s", f->id, form);
    assert_int_equal(ask_timed(f, "GET", path, NULL), 200);
    const struct stream *stream = &f->reply.stream;
    while ((got = stream->read(stream->state, piece, sizeof(piece))) > 0)
        total += (size_t)got;
    assert_int_equal(got, STREAM_END);
    double more = memory("VmHWM") - before;
    cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu;
    print_message("10^4 MSDs as %s: %.1f MB in %.2f s, %.2f s of processor time, %.1f MB more "
                  "memory\n",
                  form[0] ? form : "json", 1e-6 * (double)total, seconds(CLOCK_MONOTONIC) - wall,
                  cpu, 1e-6 * more);
    assert_true(total > 10000000);
    assert_true(more < 20e6);
    assert_true(cpu < 15);
}

static void many_results(void **state)
{
    static const char *const forms[] = {".npz", "", ".ndjson", ".csv"};
    struct desk *f = *state;
    assert_int_equal(ask_timed(f, "POST", "/v1/sweeps",
                               "{\"base\":" BASE ",\"axes\":{\"/diameter\":{\"from\":0.01,\"to\":1,"
                               "\"points\":100},\"/seed\":{\"first\":1,\"count\":100}}}"),
                     202);
    desk_take_id(f, f->id);
    finish_jobs(f);
    for (size_t i = 0; i < sizeof(forms) / sizeof(forms[0]); i++)
        export(f, forms[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(largest_sweep),
        DESK_TEST(largest_without_seeds),
        DESK_TEST(many_results),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
