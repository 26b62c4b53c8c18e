/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_chunks.c - the runs of a task: how they are made, and what they leave in the end. See
 * worker_internal.h; checkpoints on the way are worker_checkpoint.c's.
 */
#include "worker_internal.h"

#include "log.h"

#include <stdio.h>
#include <stdlib.h>

/* ------------------------------------------------------------------- beginning */

/* A chunk that another job began: goes on from there. A beginning that is damaged is dropped, and
 * the chunk run from its own beginning. */
static enum bcd_status go_on(struct work *work, int64_t index)
{
    const struct task *task = work->task;
    struct family_sample base = {0};
    struct bcd_tally *tally = NULL;
    enum bcd_status status = BCD_OK;

    if (store_samples_base(work->workers->store, task->id, &base) != STORE_OK)
        return BCD_OK;
    if (base.rest.bytes && base.chunks == task->chunk + index) {
        status = bcd_tally_create(&tally, task->scene);
        if (status == BCD_OK)
            status = bcd_tally_restore(tally, base.rest.bytes, base.rest.size, &work->error);
        if (status == BCD_OK)
            status = bcd_run_continue(bcd_team_run(work->team, index), tally, &work->error);
        bcd_tally_free(tally);
    }
    if (status == BCD_CORRUPT) {
        work_drop_base(work, &base);
        status = BCD_OK;
    }
    family_sample_fini(&base);
    return status;
}

/* One of the runs where it was left, if it was left anywhere. */
static enum bcd_status resume(struct work *work, int64_t index)
{
    enum saved saved = saving_restore(work, index);

    if (saved == SAVED_RESTORED)
        return BCD_OK;
    if (saved == SAVED_LATER)
        return BCD_NO_MEMORY;
    if (saved == SAVED_DAMAGED)
        log_write(LOG_LEVEL_WARNING, "checkpoint_dropped",
                  LOG_FIELDS(log_text("job", work->task->id),
                             log_integer("chunk", work->task->chunk + index),
                             log_text("reason", work->error.text)));
    return go_on(work, index);
}

static enum bcd_status create_team(struct work *work)
{
    const struct task *task = work->task;
    const struct bcd_team_wanted wanted = {
        .scene = task->scene, .first = task->chunk, .count = task->count, .watch = &work->watch};
    enum bcd_status status = bcd_team_create(&work->team, &wanted, &work->error);

    for (int64_t i = 0; status == BCD_OK && i < task->count; i++)
        status = resume(work, i);
    if (status) {
        bcd_team_free(work->team);
        work->team = NULL;
    }
    return status;
}

/* The machine may be short of memory for the moment only. */
enum bcd_status work_create_team(struct work *work)
{
    enum bcd_status status = create_team(work);

    for (int tries = 1; status == BCD_NO_MEMORY && tries < MEMORY_TRIES_MAX; tries++) {
        log_write(
            LOG_LEVEL_WARNING, "worker_waits_for_memory",
            LOG_FIELDS(log_text("job", work->task->id), log_integer("chunk", work->task->chunk)));
        if (!work_back_off(work, tries))
            break;
        status = create_team(work);
    }
    return status;
}

/* --------------------------------------------------------------------- keeping */

void run_bytes_fini(struct run_bytes *bytes)
{
    for (int64_t i = 0; bytes->at && i < bytes->count; i++)
        free((void *)bytes->at[i].bytes);
    free(bytes->at);
    bytes->at = NULL;
}

struct run_bytes run_bytes_of(const struct bcd_team *team, bool tally)
{
    struct run_bytes all = {.count = bcd_team_count(team)};
    bool good;

    all.at = calloc((size_t)all.count, sizeof *all.at);
    good = all.at != NULL;
    for (int64_t i = 0; good && i < all.count; i++) {
        const struct bcd_run *run = bcd_team_run(team, i);
        size_t size = tally ? bcd_tally_size(bcd_run_tally(run)) : bcd_run_checkpoint_size(run);
        void *bytes = malloc(size + 1);

        all.at[i] = (struct chunk_new){bytes, size};
        good = bytes != NULL;
        if (good && tally)
            bcd_tally_save(bcd_run_tally(run), bytes);
        else if (good)
            bcd_run_save(run, bytes);
    }
    if (!good)
        run_bytes_fini(&all);
    return all;
}

enum run_end work_put_chunks(struct work *work, const struct chunk_new *tallies)
{
    const struct task *task = work->task;
    enum store_status status;
    int tries = 0;

    do
        status = store_results_put_chunks(work->workers->store, task->id, task->chunk, tallies,
                                          task->count);
    while (work_try_again(work, status, ++tries));
    if (status == STORE_OK)
        return RUN_DONE;
    if (status == STORE_BROKEN && !work_should_stop(work)) {
        work->error.code = BCD_INTERNAL;
        snprintf(work->error.text, sizeof work->error.text, "a finished part could not be stored");
        return RUN_FAILED;
    }
    /* No longer running in the store: cancelled, and nobody is to take these chunks up again. */
    if (status == STORE_CONFLICT || status == STORE_NOT_FOUND)
        queue_cancel(work->workers->queue, task->id);
    return RUN_STOPPED;
}

enum run_end work_put_tallies(struct work *work)
{
    struct run_bytes bytes = run_bytes_of(work->team, true);
    enum run_end end;

    for (int i = 1; !bytes.at && i < MEMORY_TRIES_MAX && work_back_off(work, i); i++)
        bytes = run_bytes_of(work->team, true);
    if (!bytes.at) {
        work->error.code = BCD_NO_MEMORY;
        return work_should_stop(work) ? RUN_STOPPED : RUN_FAILED;
    }
    end = work_put_chunks(work, bytes.at);
    run_bytes_fini(&bytes);
    return end;
}
