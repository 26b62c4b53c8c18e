/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "job_bench.h"

#include "scene_json.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include <cmocka.h>

enum { PATIENCE_MS = 120000, POLL_MS = 5 };

struct bcd_scene *job_bench_scene(int chunks, int seed)
{
    struct bcd_scene *scene =
        experiment_scene("{'particles':100,'length':200,'diameter':0.5,"
                         "'force':1,'potential':{'type':'cosine','amplitude':6},'time':25,"
                         "'time_step':0.001,'realizations':%d,'seed':%d,'observables':{"
                         "'msd':{'first':0.01,'last':10,'points':8},'density':{'bins':20},"
                         "'energy':{}}}",
                         chunks, seed);

    assert_int_equal(bcd_scene_chunks(scene), chunks);
    return scene;
}

struct bcd_scene *job_bench_small_rings(int chunks)
{
    struct bcd_scene *scene = experiment_scene(
        "{'particles':10,'length':20,'diameter':0.5,'time':400,'force':1,'time_step':0.001,"
        "'realizations':%d,'seed':3,'potential':{'type':'cosine','amplitude':6},'observables':{"
        "'msd':{'first':0.01,'last':1,'points':5},'density':{'bins':10},'energy':{}}}",
        chunks);

    assert_int_equal(bcd_scene_chunks(scene), chunks);
    assert_int_equal(bcd_scene_team(scene), 8);
    return scene;
}

void job_bench_submit(struct store *store, struct queue *queue, struct bcd_scene *scene,
                      char id[JOB_ID_SIZE])
{
    job_bench_submit_as(store, queue, scene, &(struct ticket){.owner = OWNER_LOCAL}, id);
}

void job_bench_submit_as(struct store *store, struct queue *queue, struct bcd_scene *scene,
                         const struct ticket *ticket, char id[JOB_ID_SIZE])
{
    char *text = scene_json_job(scene), *derived = scene_json_derived(scene);
    struct job_new job = {
        .job = text, .derived = derived, .chunks = bcd_scene_chunks(scene), .ticket = ticket};
    struct job_record record;
    bool existed = true;

    assert_true(queue_hash(scene, job.hash));
    assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
    assert_false(existed);
    snprintf(id, JOB_ID_SIZE, "%s", record.id);
    job_record_fini(&record);
    free(derived);
    free(text);
    if (queue)
        queue_take(queue, ticket->owner);
    bcd_scene_free(scene);
}

enum job_state job_bench_wait(struct store *store, const char *id)
{
    for (int waited = 0; waited < PATIENCE_MS; waited += POLL_MS) {
        enum job_state state = bench_state(store, id);

        if (state != JOB_QUEUED && state != JOB_RUNNING)
            return state;
        job_bench_nap(POLL_MS);
    }
    fail_msg("job %s does not end", id);
    return JOB_RUNNING;
}

void job_bench_nap(int ms)
{
    nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L}, NULL);
}

void job_bench_disk(bool none)
{
    struct rlimit limit;

    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    limit.rlim_cur = none ? 0 : limit.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
}
