/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_lend.c - a chunk that somebody else runs: offered, followed, and its tally put away as if
 * it had been run here. Whoever has it sends checkpoints now and then; they go to the store, so
 * that the chunk survives worker and daemon.
 */
#include "worker_internal.h"

#include "limits.h"
#include "log.h"

#include <stdio.h>
#include <string.h>

enum { LOOK_MS = 200 }; /* at cancel and stop, while nothing comes */

bool work_can_lend(const struct work *work)
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
    const struct task *task = work->task;
    struct blob checkpoint = {0}, begun = {0};
    struct lease *lease;

    if (store_results_load_checkpoint(work->workers->store, task->id, task->chunk, &checkpoint) !=
        STORE_OK)
        load_begun(work, &begun);
    if (checkpoint.size > LIMIT_LEASE_BYTES_MAX)
        blob_fini(&checkpoint);
    lease = lease_offer(work->workers->leases, task, &checkpoint, &begun);
    blob_fini(&checkpoint);
    blob_fini(&begun);
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

/* Follows the lease to its end. */
static enum run_end follow(struct work *work, struct lease *lease)
{
    for (;;) {
        struct lease_news news;
        enum run_end outcome = RUN_STOPPED;
        bool ended;

        lease_wait(lease, LOOK_MS, &news);
        atomic_store(&work->worker->seen_ns, work_now_ns());
        queue_spend(work->workers->queue, work->task, news.core_seconds);
        if (news.checkpoint.size > 0)
            put_checkpoint(work, &news.checkpoint);
        if (news.returned) {
            outcome = work_put_chunk(work, news.tally.bytes, news.tally.size);
            atomic_fetch_add(&work->worker->rod_steps, (int64_t)work_rod_steps(work->task->scene));
        } else if (news.failed) {
            outcome = RUN_FAILED;
            work->error = news.error;
        }
        ended = news.returned || news.failed || work_should_stop(work);
        blob_fini(&news.checkpoint);
        blob_fini(&news.tally);
        if (ended)
            return outcome;
    }
}

enum run_end work_lend(struct work *work)
{
    struct lease *lease = offer(work);
    enum run_end outcome;

    if (!lease) {
        work->error.code = BCD_NO_MEMORY;
        return RUN_FAILED;
    }
    outcome = follow(work, lease);
    lease_end(lease);
    return outcome;
}
