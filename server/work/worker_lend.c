/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_lend.c - a chunk that somebody else runs: offered, followed, and its tally put away as if
 * it had been run here. Whoever has it sends checkpoints now and then; they go to the store, so
 * that the chunk survives worker and daemon.
 */
#include "worker_internal.h"

#include "limits.h"
#include "log.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { LOOK_MS = 1000 }; /* at cancel, while nothing comes: there may be hundreds who look */

bool work_begin(struct work *work)
{
    struct workers *workers = work->workers;
    struct timespec until;

    if (!workers->leases || work->worker->aside)
        return true;
    do {
        if (work_should_stop(work))
            return false;
        atomic_store(&work->worker->seen_ns, work_now_ns());
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_sec++;
    } while (sem_clockwait(&workers->working, CLOCK_MONOTONIC, &until) != 0);
    return true;
}

void work_end(struct work *work)
{
    if (work->workers->leases && !work->worker->aside)
        sem_post(&work->workers->working);
}

/* One of few at a time takes a chunk from the queue, and not before somebody may come for it. */
static bool take_to_lend(struct workers *workers, struct task *task)
{
    bool taken = false;

    while (sem_wait(&workers->taking) != 0) /* a signal, as debuggers send them */
        ;
    while (!queue_stopping(workers->queue) && !leases_room(workers->leases, LOOK_MS))
        ;
    if (!queue_stopping(workers->queue))
        taken = queue_claim(workers->queue, task);
    sem_post(&workers->taking); /* when there will be none the next one sees that, too */
    return taken;
}

/* What others run is not in the way of what is finished here. */
bool work_take(struct worker *worker, struct task *task)
{
    struct workers *workers = worker->workers;
    bool taken;

    if (worker->aside)
        return queue_claim_finish(workers->queue, workers->leases ? SIZE_MAX : workers->aside,
                                  task);
    if (!workers->leases)
        return queue_claim(workers->queue, task);
    atomic_fetch_add(&workers->looking, 1);
    taken = take_to_lend(workers, task);
    atomic_fetch_sub(&workers->looking, 1);
    return taken;
}

/* -------------------------------------------------------------------- lending */

/* Whether the chunk may be run elsewhere: what goes to and fro must fit into a request. */
static bool can_lend(const struct work *work)
{
    struct bcd_estimate estimate;

    bcd_scene_estimate(work->task->scene, &estimate);
    return estimate.tally_bytes / (double)bcd_scene_chunks(work->task->scene) <
           LIMIT_LEASE_BYTES_MAX;
}

/* What another job began of this chunk. */
static void load_begun(struct work *work, struct blob *begun)
{
    struct family_sample base = {0};

    if (store_samples_base(work->workers->store, work->task->id, &base) != STORE_OK)
        return;
    if (base.rest.bytes && base.chunks == work->task->chunk &&
        base.rest.size <= LIMIT_LEASE_BYTES_MAX) {
        *begun = base.rest;
        base.rest = (struct blob){0};
    }
    family_sample_fini(&base);
}

static struct lease *offer(struct work *work)
{
    struct workers *workers = work->workers;
    const struct task *task = work->task;
    struct lease_terms terms = {.bytes_max = work->watch.bytes_max};
    struct lease *lease;

    work_allow(work);
    terms.core_seconds_max = 1e-9 * (double)work->allowed_ns;
    if (saving_load(work, 0, &terms.checkpoint) != STORE_OK)
        load_begun(work, &terms.begun);
    if (terms.checkpoint.size > LIMIT_LEASE_BYTES_MAX)
        blob_fini(&terms.checkpoint);
    lease = lease_offer(workers->leases, task, &terms);
    blob_fini(&terms.checkpoint);
    blob_fini(&terms.begun);
    return lease;
}

static void put_checkpoint(struct work *work, const struct blob *checkpoint)
{
    const struct task *task = work->task;
    enum store_status status = store_results_checkpoint(work->workers->store, task->id, task->chunk,
                                                        checkpoint->bytes, checkpoint->size);

    if (status == STORE_FULL || status == STORE_BROKEN)
        log_write(LOG_LEVEL_WARNING, "checkpoint_not_kept",
                  LOG_FIELDS(log_text("job", task->id), log_integer("chunk", task->chunk),
                             log_integer("bytes", (int64_t)checkpoint->size)));
}

/* The latest checkpoint that is not in the store yet, and when one went there. A worker that dies
 * needs none there, for the lease has it; only when the daemon dies, too, it is missed. */
struct kept {
    struct blob unsaved;
    int64_t ns;
};

/* Now and then, and before the daemon stops. */
static void keep_checkpoint(struct work *work, struct kept *kept, struct lease_news *news)
{
    bool stops = queue_stopping(work->workers->queue), in_turn;

    if (news->checkpoint.size > 0) {
        blob_fini(&kept->unsaved);
        kept->unsaved = news->checkpoint;
        news->checkpoint = (struct blob){0};
    }
    if (kept->unsaved.size == 0 || news->returned || atomic_load(work->task->cancelled) ||
        (!stops && work_now_ns() < kept->ns + LIMIT_LENT_CHECKPOINT_MS * INT64_C(1000000)))
        return;
    in_turn = work_begin(work);
    put_checkpoint(work, &kept->unsaved);
    if (in_turn)
        work_end(work);
    blob_fini(&kept->unsaved);
    kept->ns = work_now_ns();
}

/* A result that was taken is put away even when the daemon is about to stop. */
static enum run_end put_away(struct work *work, const struct blob *tally)
{
    bool in_turn = work_begin(work);
    assert(work->task->count == 1); /* no teams: see workers_start_lending */
    enum run_end outcome = work_put_chunks(work, &(struct chunk_new){tally->bytes, tally->size});

    if (in_turn)
        work_end(work);
    atomic_fetch_add(&work->worker->rod_steps, (int64_t)work_rod_steps(work->task));
    return outcome;
}

/* Follows the lease to its end. */
static enum run_end follow(struct work *work, struct lease *lease)
{
    struct kept kept = {.ns = work_now_ns()};

    for (;;) {
        struct lease_news news;
        enum run_end outcome = RUN_STOPPED;
        bool ended;

        lease_wait(lease, LOOK_MS, &news);
        atomic_store(&work->worker->seen_ns, work_now_ns());
        queue_spend(work->workers->queue, work->task, news.core_seconds);
        keep_checkpoint(work, &kept, &news);
        if (news.returned) {
            outcome = put_away(work, &news.tally);
        } else if (news.failed) {
            outcome = RUN_FAILED;
            work->error = news.error;
        }
        ended = news.returned || news.failed || work_should_stop(work);
        blob_fini(&news.checkpoint);
        blob_fini(&news.tally);
        if (ended) {
            blob_fini(&kept.unsaved);
            return outcome;
        }
    }
}

/* This thread is taken from now on: that some look for chunks all the same. */
static void look_for_more(struct workers *workers)
{
    if (atomic_load(&workers->looking) >= LIMIT_LENDING_TAKE || work_grow(workers))
        return;
    if (atomic_load(&workers->looking) == 0 && !atomic_exchange(&workers->told, true))
        log_write(LOG_LEVEL_WARNING, "lending_full",
                  LOG_FIELDS(log_integer("chunks", (int64_t)(workers->most - workers->aside))));
}

/* Lends it until somebody has run it. */
static enum run_end lend(struct work *work)
{
    struct lease *lease = offer(work);
    enum run_end outcome;

    if (lease)
        look_for_more(work->workers);
    if (!lease) {
        work->error.code = BCD_NO_MEMORY;
        return RUN_FAILED;
    }
    outcome = follow(work, lease);
    lease_end(lease);
    return outcome;
}

enum run_end work_run_chunk(struct work *work)
{
    enum run_end outcome = RUN_STOPPED;

    if (work->workers->leases && can_lend(work))
        return lend(work);
    if (work_begin(work)) {
        outcome = work_run_here(work);
        work_end(work);
    }
    return outcome;
}
