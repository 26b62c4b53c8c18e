/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_checkpoint.c - how chunks in motion are kept; see worker_internal.h.
 *
 * Small ones are rows of the database. Of large ones, where most of the memory stands still from
 * one to the next (configurations that displacements are measured from), only the pieces that have
 * changed go to a file (store_pieces.h); that is done twice: the pieces are handed to the system,
 * the run goes on while it writes, and a moment later it is asked whether all is on disk.
 *
 * What it costs comes first, and then how much work is lost: see limits.h.
 */
#include "worker_internal.h"

#include "limits.h"
#include "log.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int64_t ms = 1000000;

/* ------------------------------------------------------------------------ pace */

/* Early ones first, so that a job gets on even where the server is ended again and again. The
 * credit: what may be spent beyond the share, as long as else too much work would be lost. */
static void pace_begin(struct work *work, int64_t now)
{
    struct saving *saving = &work->saving;
    double credit = work->expected_seconds * 1e9 / LIMIT_CHECKPOINT_CREDIT_SHARE;
    const int64_t most = LIMIT_CHECKPOINT_CREDIT_MS * ms;

    saving->gap_ns = LIMIT_CHECKPOINT_FIRST_MS * ms;
    saving->due_ns = now + saving->gap_ns;
    saving->credit_ns = credit < (double)most ? (int64_t)credit : most;
}

/* After one that was begun at `begun`. What saving took of the processor counts, and not so much
 * what it waited: on a machine that others use, too, all is as slow as saving. */
static void pace_next(struct saving *saving, int64_t begun)
{
    const int64_t usual = LIMIT_CHECKPOINT_MS * ms, lost = LIMIT_CHECKPOINT_LOST_MS * ms;
    int64_t least = saving->cpu_ns * LIMIT_CHECKPOINT_SHARE,
            slow = saving->took_ns * LIMIT_CHECKPOINT_WAIT_SHARE, beyond;

    least = least > slow ? least : slow;
    beyond = least > lost ? least - lost : 0;
    beyond = beyond < saving->credit_ns ? beyond : saving->credit_ns;
    saving->credit_ns -= beyond;
    least -= beyond;
    saving->gap_ns = 2 * saving->gap_ns < usual ? 2 * saving->gap_ns : usual;
    saving->due_ns = begun + (saving->gap_ns > least ? saving->gap_ns : least);
    saving->took_ns = saving->cpu_ns = 0;
}

/* ----------------------------------------------------------------------- saving */

static struct chunk_place place_of(const struct work *work, int64_t index)
{
    struct chunk_place place = {.chunk = work->task->chunk + index};

    snprintf(place.id, sizeof place.id, "%s", work->task->id);
    return place;
}

/* The only run, or one like the others: only what goes alone has checkpoints that are large. */
static struct bcd_run *first_run(const struct work *work)
{
    return bcd_team_run(work->team, 0);
}

/* What became of them. */
static void note(struct work *work, enum store_status status)
{
    size_t each = bcd_run_checkpoint_size(first_run(work));

    if (status == STORE_FULL || status == STORE_BROKEN)
        log_write(LOG_LEVEL_WARNING, "checkpoint_not_kept",
                  LOG_FIELDS(log_text("job", work->task->id),
                             log_integer("chunk", work->task->chunk),
                             log_integer("chunks", work->task->count),
                             log_integer("bytes", (int64_t)each)));
    atomic_fetch_add(&work->worker->checkpoints, 1);
}

static void save_rows(struct work *work)
{
    struct run_bytes bytes = run_bytes_of(work->team, false);
    enum store_status status = STORE_BROKEN;

    if (bytes.at)
        status = store_results_checkpoints(work->workers->store, work->task->id, work->task->chunk,
                                           bytes.at, bytes.count);
    run_bytes_fini(&bytes);
    note(work, status);
}

static bool have_sums(struct work *work)
{
    struct saving *saving = &work->saving;
    size_t count = bcd_run_checkpoint_pieces(first_run(work));

    static_assert((int)PIECES_SIZE == (int)BCD_CHECKPOINT_PIECE &&
                      (int)PIECES_HEAD_SIZE == (int)BCD_CHECKPOINT_HEAD,
                  "the store keeps the engine's pieces");
    if (!saving->kept)
        saving->kept = calloc(count, sizeof *saving->kept);
    if (!saving->next)
        saving->next = calloc(count, sizeof *saving->next);
    return saving->kept && saving->next;
}

static enum store_status have_file(struct work *work)
{
    const struct chunk_place place = place_of(work, 0);

    if (!have_sums(work))
        return STORE_BROKEN;
    return work->saving.file ? STORE_OK
                             : pieces_create(&work->saving.file, work->workers->store, &place,
                                             bcd_run_checkpoint_size(first_run(work)));
}

/* The sums of 64 bits tell what has changed, as they tell what is damaged. */
static enum store_status put_pieces(struct work *work)
{
    struct saving *saving = &work->saving;
    unsigned char head[BCD_CHECKPOINT_HEAD];
    enum store_status status = STORE_OK;

    bcd_run_checkpoint_head(first_run(work), head, saving->next);
    for (size_t i = 0; i < bcd_run_checkpoint_pieces(first_run(work)) && status == STORE_OK; i++) {
        size_t size;
        const void *piece = bcd_run_checkpoint_piece(first_run(work), i, &size);
        bool same = pieces_any(saving->file) && saving->next[i] == saving->kept[i];

        status = pieces_put(saving->file, i, piece, same);
    }
    if (status == STORE_OK)
        pieces_head(saving->file, head);
    return status;
}

/* The first half: whether there is a second. */
static bool save_pieces(struct work *work)
{
    enum store_status status = have_file(work);

    if (status == STORE_OK)
        status = put_pieces(work);
    if (status)
        note(work, status);
    return status == STORE_OK;
}

/* The second half. */
static void keep_pieces(struct work *work)
{
    struct saving *saving = &work->saving;
    uint64_t *before = saving->kept;
    enum store_status status = pieces_keep(saving->file);

    if (status == STORE_OK) {
        saving->kept = saving->next;
        saving->next = before;
    }
    note(work, status);
}

/* ---------------------------------------------------------------------- moments */

/* Does one half or all of it; true if there is a second half to come. */
static bool step(struct work *work)
{
    struct saving *saving = &work->saving;
    int64_t cpu = work_cpu_ns(), began = work_now_ns();
    bool more = false;

    if (saving->file && pieces_waiting(saving->file))
        keep_pieces(work);
    else if (bcd_run_checkpoint_size(first_run(work)) > LIMIT_CHECKPOINT_ROW_BYTES)
        more = save_pieces(work);
    else
        save_rows(work);
    cpu = work_cpu_ns() - cpu;
    saving->cpu_ns += cpu;
    saving->took_ns += work_now_ns() - began;
    atomic_fetch_add(&work->worker->saving_ns, cpu);
    return more;
}

void saving_begin(struct work *work, int64_t now_ns)
{
    pace_begin(work, now_ns);
}

bool saving_look(struct work *work, int64_t now_ns)
{
    struct saving *saving = &work->saving;
    bool waits = saving->file && pieces_waiting(saving->file);
    const int64_t settle = LIMIT_CHECKPOINT_SETTLE_MS * ms;
    int64_t pause = saving->gap_ns / 5 < settle ? saving->gap_ns / 5 : settle;

    if (now_ns < (waits ? saving->put_ns + pause : saving->due_ns))
        return false;
    if (!waits)
        saving->put_ns = now_ns;
    if (!step(work))
        pace_next(saving, saving->put_ns);
    return true;
}

void saving_last(struct work *work)
{
    if (work->saving.file)
        pieces_forget(work->saving.file);
    if (step(work))
        step(work);
}

void saving_end(struct work *work, bool ended)
{
    struct saving *saving = &work->saving;

    pieces_close(saving->file, ended);
    free(saving->kept);
    free(saving->next);
    *saving = (struct saving){0};
}

/* -------------------------------------------------------------------- restoring */

/* What the file holds is what the next checkpoint differs from; without memory for that, all of it
 * is taken to have changed. */
static void go_on_with_file(struct work *work)
{
    unsigned char head[BCD_CHECKPOINT_HEAD];

    if (have_sums(work))
        bcd_run_checkpoint_head(first_run(work), head, work->saving.kept);
}

enum store_status saving_load(struct work *work, int64_t index, struct blob *checkpoint)
{
    struct store *store = work->workers->store;
    const struct chunk_place place = place_of(work, index);
    struct blob row = {0};
    enum store_status status = store_results_load_checkpoint(store, place.id, place.chunk, &row);

    if (status)
        return STORE_NOT_FOUND; /* what cannot be read now is done again */
    status = pieces_open(&work->saving.file, store, &place, &row, checkpoint);
    if (status == STORE_CONFLICT) { /* it is all in the row */
        *checkpoint = row;
        return STORE_OK;
    }
    blob_fini(&row);
    if (work->task->count > 1) { /* it was alone before */
        pieces_close(work->saving.file, false);
        work->saving.file = NULL;
    }
    return status == STORE_NOT_FOUND ? STORE_CONFLICT : status;
}

enum saved saving_restore(struct work *work, int64_t index)
{
    struct blob checkpoint = {0};
    enum store_status status = saving_load(work, index, &checkpoint);

    if (status == STORE_NOT_FOUND)
        return SAVED_NOTHING;
    if (status == STORE_BROKEN)
        return SAVED_LATER;
    work->error.code = BCD_CORRUPT;
    if (status == STORE_OK)
        work->error.code = bcd_run_restore(bcd_team_run(work->team, index), checkpoint.bytes,
                                           checkpoint.size, &work->error);
    else
        snprintf(work->error.text, sizeof work->error.text, "its file cannot be read");
    blob_fini(&checkpoint);
    if (work->error.code) {
        saving_end(work, false);
        return SAVED_DAMAGED;
    }
    if (work->saving.file)
        go_on_with_file(work);
    return SAVED_RESTORED;
}
