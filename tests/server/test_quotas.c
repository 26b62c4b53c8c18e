/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_quotas.c - what each owner may have, and what is said before a job is submitted. */
#include "calibration.h"
#include "desk.h"
#include "job_bench.h"
#include "limits.h"
#include "store_internal.h"
#include "store_results.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct desk open_service(struct bench *bench)
{
    struct desk f = {.service = {.store = bench->store}};
    assert_int_equal(queue_create(&f.service.queue, bench->store), STORE_OK);
    return f;
}

static void close_service(struct desk *f)
{
    reply_fini(&f->reply);
    queue_stop(f->service.queue);
    queue_free(f->service.queue);
}

static double number(const struct desk *f, const char *name)
{
    char key[64];
    snprintf(key, sizeof(key), "\"%s\":", name);
    const char *at = strstr(f->reply.body, key);
    if (!at)
        fail_msg("no %s in %s", name, f->reply.body);
    return strtod(at + strlen(key), NULL);
}

static void queued_points(void **state)
{
    struct desk f = open_service(*state);
    char id[JOB_ID_SIZE], path[64];
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", "{\"queued_points\":2}"), 200);
    assert_says(&f, "\"queued_points\":{\"limit\":2,\"used\":0,\"default\":false}");
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB("")), 202);
    desk_take_id(&f, id);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":2")), 202);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":3")), 429);
    assert_says(&f, "over-quota");
    assert_says(&f, "\"quota\":\"queued_points\",\"limit\":2,\"used\":2,\"needed\":1");
    assert_says(&f, "needs 1 queued_points; of 2 that local may have, 2 are taken");
    /* What stands already costs nothing; nothing was left behind by what was refused. */
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB("")), 200);
    assert_int_equal(bench_number(f.service.store, "SELECT count(*) FROM jobs"), 2);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(ask(&f, "DELETE", path, NULL), 200);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":3")), 202);
    /* A PUT says all there is to be said: what it does not name is as for everybody. */
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", "{\"stored_bytes\":1e9}"), 200);
    assert_int_equal((int)number(&f, "queued_points\":{\"limit"), LIMIT_OWNER_QUEUED_MAX);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":4")), 202);
    close_service(&f);
}

static void core_seconds(void **state)
{
    struct desk f = open_service(*state);
    char body[128];
    assert_int_equal(ask(&f, "POST", "/v1/estimate", JOB("")), 200);
    double need = number(&f, "core_seconds");
    snprintf(body, sizeof(body), "{\"core_seconds_per_day\":%.17g}", 3.5 * need);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", body), 200);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB("")), 202);
    assert_int_equal(store_owners_spend(f.service.store, "local", 2 * need), STORE_OK);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":2")), 429);
    assert_says(&f, "\"quota\":\"core_seconds_per_day\"");
    assert_true(number(&f, "used") > 2.9 * need && number(&f, "used") < 3.1 * need);
    assert_true(number(&f, "needed") > 0.99 * need && number(&f, "needed") < 1.01 * need);
    /* Yesterday's do not count. */
    assert_int_equal(store_exec(f.service.store->writer, "UPDATE owners SET day = day - 1"),
                     STORE_OK);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":2")), 202);
    close_service(&f);
}

/* Expected while a job waits, real when it is done, nothing when it left nothing. */
static void stored_bytes(void **state)
{
    struct desk f = open_service(*state);
    struct result_new result = {"energy", "0123456789", 10};
    char a[JOB_ID_SIZE], b[JOB_ID_SIZE];
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB("")), 202);
    assert_int_equal(sscanf(f.reply.body, "{\"id\":\"%23[a-z0-9-]", a), 1);
    assert_true(bench_number(f.service.store, "SELECT bytes FROM owners") > 100);
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":2")), 202);
    assert_int_equal(sscanf(f.reply.body, "{\"id\":\"%23[a-z0-9-]", b), 1);
    assert_int_equal(store_jobs_start(f.service.store, a), STORE_OK);
    assert_int_equal(store_results_finish(f.service.store, a, &result, 1), STORE_OK);
    assert_int_equal(store_jobs_fail(f.service.store, b, "no reason"), STORE_OK);
    assert_int_equal(bench_number(f.service.store, "SELECT bytes FROM owners"), 10);
    assert_int_equal(bench_number(f.service.store, "SELECT waiting_seconds > 0 FROM owners"), 0);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", "{\"stored_bytes\":50}"), 200);
    assert_says(&f, "\"stored_bytes\":{\"limit\":50,\"used\":10,\"default\":false}");
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB(",\"seed\":3")), 429);
    assert_says(&f, "\"quota\":\"stored_bytes\",\"limit\":50,\"used\":10,");
    assert_int_equal(ask(&f, "POST", "/v1/jobs", JOB("")), 200);
    close_service(&f);
}

/* A sweep is taken whole or not at all. */
static void sweeps_count_by_their_points(void **state)
{
    static const char sweep[] = "{\"base\":" JOB("") ",\"axes\":{\"/seed\":[1,2,3]}}";
    struct desk f = open_service(*state);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", "{\"queued_points\":2}"), 200);
    assert_int_equal(ask(&f, "POST", "/v1/sweeps", sweep), 429);
    assert_says(&f, "\"quota\":\"queued_points\",\"limit\":2,\"used\":0,\"needed\":3");
    assert_int_equal(bench_number(f.service.store, "SELECT count(*) FROM jobs"), 0);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", "{\"queued_points\":3}"), 200);
    assert_int_equal(ask(&f, "POST", "/v1/sweeps", sweep), 202);
    assert_int_equal(bench_number(f.service.store, "SELECT queued FROM owners"), 3);
    close_service(&f);
}

static void take_sweep_id(const struct desk *f, char id[JOB_ID_SIZE])
{
    assert_int_equal(sscanf(f->reply.body, "{\"id\":\"%23[a-z0-9-]", id), 1);
}

/* Points of jobs that stand take up room, too: nobody fills the disk with sweeps of one job. */
static void sweeps_take_up_room(void **state)
{
    static const char sweep[] = "{\"base\":" JOB("") ",\"axes\":{\"/seed\":[1,2,3]}}";
    static const char turned[] = "{\"base\":" JOB("") ",\"axes\":{\"/seed\":[3,2,1]}}";
    struct desk f = open_service(*state);
    char id[JOB_ID_SIZE], path[64], quota[64];
    assert_int_equal(ask(&f, "POST", "/v1/sweeps", sweep), 202);
    take_sweep_id(&f, id);
    double used = bench_number(f.service.store, "SELECT bytes FROM owners");
    double own = bench_number(f.service.store, "SELECT bytes FROM sweeps");
    assert_true(own > 3 * 48 + strlen(JOB("")));
    assert_float_equal(used - own, bench_number(f.service.store, "SELECT sum(bytes) FROM jobs"), 0);
    snprintf(quota, sizeof(quota), "{\"stored_bytes\":%.0f}", used + own - 1);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", quota), 200);
    assert_int_equal(ask(&f, "POST", "/v1/sweeps", turned), 429);
    assert_says(&f, "\"quota\":\"stored_bytes\"");
    assert_int_equal(bench_number(f.service.store, "SELECT count(*) FROM sweeps"), 1);
    snprintf(path, sizeof(path), "/v1/sweeps/%s/extend", id);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", "{\"stored_bytes\":1}"), 200);
    assert_int_equal(ask(&f, "POST", path, "{\"axes\":{\"/seed\":[4]}}"), 429);
    /* What adds nothing is nobody's excess: the same sweep, no more points, nothing that failed. */
    assert_int_equal(ask(&f, "POST", "/v1/sweeps", sweep), 200);
    assert_int_equal(ask(&f, "POST", path, "{\"axes\":{\"/seed\":[3]}}"), 200);
    snprintf(path, sizeof(path), "/v1/sweeps/%s/retry", id);
    assert_int_equal(ask(&f, "POST", path, NULL), 200);
    /* Nor does a sweep of jobs that stand need a place in the queue. */
    snprintf(quota, sizeof(quota), "{\"stored_bytes\":%.0f,\"queued_points\":1}", used + own);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/local", quota), 200);
    assert_int_equal(ask(&f, "POST", "/v1/sweeps", turned), 202);
    assert_float_equal(bench_number(f.service.store, "SELECT bytes FROM owners"), used + own, 0);
    close_service(&f);
}

static void faulty_quotas(void **state)
{
    static const char *const bad[] = {
        "{\"queued_points\":-1}",
        "{\"queued_points\":\"1\"}",
        "{\"points\":1}",
        "{\"stored_bytes\":1e16}",
        "{\"stored_bytes\":0.5}",
        "{\"queued_points\":true}",
        "{\"core_seconds_per_day\":[]}",
        "[]",
    };
    struct desk f = open_service(*state);
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        if (ask(&f, "PUT", "/v1/owners/anna", bad[i]) != 422)
            fail_msg("%s: %d", bad[i], f.reply.status);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/anna", "{\"queued_points\":1.5}"), 422);
    assert_says(&f,
                "{\"pointer\":\"/queued_points\",\"detail\":\"must be a whole number from 0 to ");
    assert_int_equal(ask(&f, "PUT", "/v1/owners/anna", "{"), 400);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/Anna", "{}"), 404);
    assert_int_equal(ask(&f, "PUT", "/v1/owners/abcdefghijklmnopqrstuvwxyz0123456", "{}"), 404);
    assert_int_equal(ask(&f, "GET", "/v1/owners", NULL), 200);
    assert_string_equal(f.reply.body, "{\"owners\":[]}\n");
    close_service(&f);
}

/* ------------------------------------------------------------------- estimate */

static void what_waits_goes_before(void **state)
{
    struct desk f = open_service(*state);
    struct ticket other = {.owner = "bert"};
    struct waiting_before before;
    char id[JOB_ID_SIZE];
    assert_int_equal(ask(&f, "POST", "/v1/estimate", JOB("")), 200);
    double need = number(&f, "core_seconds");
    assert_says(&f, "\"queue\":{\"jobs_before\":0,\"core_seconds_before\":0}");
    assert_says(&f, "\"finishes_in_seconds\":null,\"finishes_at\":null"); /* no workers */
    for (int i = 1; i <= 3; i++) {
        char job[512];
        snprintf(job, sizeof(job), JOB(",\"seed\":%d,\"priority\":%d"), i, i - 2);
        assert_int_equal(ask(&f, "POST", "/v1/jobs", job), 202);
    }
    assert_int_equal(ask(&f, "POST", "/v1/estimate", JOB("")), 200);
    assert_says(&f, "\"jobs_before\":2");
    assert_true(number(&f, "core_seconds_before") > 1.99 * need &&
                number(&f, "core_seconds_before") < 2.01 * need);
    assert_int_equal(ask(&f, "POST", "/v1/estimate", JOB(",\"priority\":2")), 200);
    assert_says(&f, "\"jobs_before\":0");
    /* Another owner's long job takes as much as ours do, and no more. */
    job_bench_submit_as(f.service.store, NULL, job_bench_scene(2, 1), &other, id);
    assert_int_equal(store_exec(f.service.store->writer,
                                "UPDATE owners SET waiting_seconds = 1e6 WHERE owner = 'bert'"),
                     STORE_OK);
    assert_int_equal(ask(&f, "POST", "/v1/estimate", JOB(",\"priority\":2")), 200);
    assert_true(number(&f, "core_seconds_before") > 0.99 * need &&
                number(&f, "core_seconds_before") < 1.01 * need);
    assert_int_equal(store_owners_before(f.service.store, &other, 1, &before), STORE_OK);
    assert_int_equal(before.jobs, 1);
    close_service(&f);
}

static void calibration_learns(void **state)
{
    struct bench *bench = *state;
    struct calibration *c = calibration_create();
    double seconds = -1;
    assert_float_equal(calibration_factor(c, "bcd", &seconds), 1, 0);
    assert_float_equal(seconds, 0, 0);
    assert_int_equal(calibration_load(c, bench->store), STORE_OK);
    double machine = calibration_factor(c, "bcd", NULL);
    assert_true(machine > 0.01 && machine < 100);
    for (int i = 0; i < 4; i++)
        calibration_note(c, "bcd", 1, i % 2 ? 4 : 1);
    assert_float_equal(calibration_factor(c, "bcd", &seconds), 3.03, 0.4);
    assert_float_equal(seconds, 10, 1e-9);
    assert_float_equal(calibration_factor(c, "tao", NULL), machine, 0);
    /* What cannot be is not learned from. */
    calibration_note(c, "tao", 0, 1);
    calibration_note(c, "tao", 1, 0);
    calibration_note(c, "tao", 1, 1e-6);
    calibration_note(c, "tao", 0.0 / 0.0, 1);
    assert_float_equal(calibration_factor(c, "tao", NULL), machine, 0);
    double bcd = calibration_factor(c, "bcd", NULL);
    assert_int_equal(calibration_save(c, bench->store), STORE_OK);
    calibration_free(c);
    bench_reopen(bench);
    c = calibration_create();
    assert_int_equal(calibration_load(c, bench->store), STORE_OK);
    assert_float_equal(calibration_factor(c, "bcd", NULL), bcd, 0);
    assert_float_equal(calibration_factor(c, "tao", NULL), machine, 0);
    /* After a long time only the new counts: the machine has been changed. */
    for (int i = 0; i < 100; i++)
        calibration_note(c, "bcd", 10, 70);
    assert_float_equal(calibration_factor(c, "bcd", NULL), 7, 0.01);
    calibration_free(c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(queued_points),          BENCH_TEST(core_seconds),
        BENCH_TEST(stored_bytes),           BENCH_TEST(sweeps_count_by_their_points),
        BENCH_TEST(sweeps_take_up_room),    BENCH_TEST(faulty_quotas),
        BENCH_TEST(what_waits_goes_before), BENCH_TEST(calibration_learns),
    };
    return cmocka_run_group_tests_name("quotas", tests, NULL, NULL);
}
