/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_finish.c - from the chunks in the store to the job's tables, or to its next goal; and what
 * it leaves behind for jobs that differ from it in realizations or target alone.
 */
#include "worker_internal.h"

#include "limits.h"
#include "log.h"
#include "outcome_json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { KEPT_MAX = 32 };

/* A job's chunks put together. kept: samples, the last of them all that there is. */
struct gathered {
    struct family_sample base;
    struct bcd_tally *whole;
    struct bcd_verdict verdict;
    int64_t reused; /* realizations that others ran */
    struct sample_new kept[KEPT_MAX];
    size_t count, milestone_bytes;
};

/* ------------------------------------------------------------ what is kept */

static void kept_fini(struct sample_new *kept)
{
    blob_fini(&kept->whole);
    blob_fini(&kept->rest);
}

static void gathered_fini(struct gathered *gathered)
{
    family_sample_fini(&gathered->base);
    bcd_tally_free(gathered->whole);
    for (size_t i = 0; i < gathered->count; i++)
        kept_fini(&gathered->kept[i]);
    *gathered = (struct gathered){0};
}

/* Without memory for it nothing is kept, and that is it. */
static struct blob bytes_of(const struct bcd_tally *tally)
{
    struct blob blob = {.size = bcd_tally_size(tally)};

    blob.bytes = malloc(blob.size + 1);
    if (blob.bytes)
        bcd_tally_save(tally, blob.bytes);
    return blob;
}

static void forget_oldest(struct gathered *gathered)
{
    gathered->milestone_bytes -= gathered->kept[0].whole.size;
    kept_fini(&gathered->kept[0]);
    gathered->count--;
    memmove(gathered->kept, gathered->kept + 1, gathered->count * sizeof gathered->kept[0]);
}

/* All of `chunks` chunks are in `whole`: a milestone on the way, or the end. The latest milestones
 * stay, as far as there is room. */
static void keep_whole(struct gathered *gathered, int64_t chunks, bool end)
{
    struct sample_new kept = {.realizations = bcd_tally_realizations(gathered->whole),
                              .chunks = chunks};

    size_t size = bcd_tally_size(gathered->whole);

    if (size > (end ? LIMIT_SAMPLE_BYTES_MAX : LIMIT_MILESTONES_BYTES_MAX))
        return;
    kept.whole = bytes_of(gathered->whole);
    if (!kept.whole.bytes)
        return;
    gathered->milestone_bytes += end ? 0 : size;
    while (gathered->count == KEPT_MAX || gathered->milestone_bytes > LIMIT_MILESTONES_BYTES_MAX)
        forget_oldest(gathered);
    gathered->kept[gathered->count++] = kept;
}

/* The last chunk, not a full one, is `part` and not yet in `whole`. */
static void keep_rest(struct gathered *gathered, int64_t chunks, const struct bcd_tally *part)
{
    struct sample_new kept = {.chunks = chunks};
    int64_t before = bcd_tally_realizations(gathered->whole);

    if (bcd_tally_size(part) > LIMIT_SAMPLE_BYTES_MAX)
        return;
    kept.realizations = before + bcd_tally_realizations(part);
    if (chunks > 0)
        kept.whole = bytes_of(gathered->whole);
    kept.rest = bytes_of(part);
    if (gathered->count == KEPT_MAX)
        forget_oldest(gathered);
    if (kept.rest.bytes && (chunks == 0 || kept.whole.bytes))
        gathered->kept[gathered->count++] = kept;
    else
        kept_fini(&kept);
}

/* ---------------------------------------------------------------- gathering */

void work_drop_base(struct work *work, const struct family_sample *base)
{
    log_write(LOG_LEVEL_WARNING, "sample_dropped",
              LOG_FIELDS(log_text("job", work->task->id), log_text("from", base->job),
                         log_integer("realizations", base->realizations),
                         log_text("reason", work->error.text)));
    store_samples_drop(work->workers->store, base->seq);
    work->error = (struct bcd_error){0};
}

/* What becomes of trying to gather. */
enum gather {
    GATHER_OK,
    GATHER_FAILED, /* work->error says why */
    GATHER_HOLES,  /* a part that was taken over is gone: to be run */
};

/* The chunk is damaged: it will be run again, if the store lets go of it. */
static bool drop_chunk(struct work *work, int64_t chunk)
{
    log_write(LOG_LEVEL_WARNING, "chunk_dropped",
              LOG_FIELDS(log_text("job", work->task->id), log_integer("chunk", chunk),
                         log_text("reason", work->error.text)));
    if (store_results_drop_chunk(work->workers->store, work->task->id, chunk) != STORE_OK)
        return false;
    work->error = (struct bcd_error){0};
    return true;
}

static enum gather load(struct work *work, int64_t chunk, const struct family_sample *base,
                        struct bcd_tally *part)
{
    struct blob blob = {0};
    enum store_status loaded;
    enum bcd_status status;
    int tries = 0;

    do
        loaded = store_results_load_chunk(work->workers->store, work->task->id, chunk, &blob);
    while (work_try_again(work, loaded, ++tries));
    if (loaded == STORE_NOT_FOUND && chunk == base->chunks && base->rest.bytes) {
        status = bcd_tally_restore(part, base->rest.bytes, base->rest.size, &work->error);
        if (status == BCD_CORRUPT)
            work_drop_base(work, base);
        return status == BCD_OK ? GATHER_OK : GATHER_HOLES;
    }
    if (loaded == STORE_NOT_FOUND)
        return GATHER_HOLES;
    if (loaded != STORE_OK) {
        snprintf(work->error.text, sizeof work->error.text,
                 "part %lld of the results could not be read", (long long)chunk);
        work->error.code = BCD_INTERNAL;
        return GATHER_FAILED;
    }
    work->error.code = bcd_tally_restore(part, blob.bytes, blob.size, &work->error);
    blob_fini(&blob);
    if (work->error.code == BCD_CORRUPT && drop_chunk(work, chunk))
        return GATHER_HOLES;
    return work->error.code ? GATHER_FAILED : GATHER_OK;
}

/* The chunks' tallies in the order of their numbers: the order is part of the result. */
static enum gather merge_all(struct work *work, struct bcd_tally *part, struct gathered *gathered)
{
    const struct bcd_scene *scene = work->task->scene;
    const int64_t first = gathered->base.chunks, chunks = work->task->chunks;
    int64_t milestone = bcd_scene_milestone(scene, first);
    bool several = bcd_scene_realizations(scene, bcd_scene_chunks(scene)) > 1;
    int64_t full = bcd_scene_realizations(scene, 1);

    for (int64_t i = first; i < chunks; i++) {
        enum gather status = load(work, i, &gathered->base, part);
        bool end = i + 1 == chunks;

        if (status)
            return status;
        if (several && end && (bcd_tally_realizations(part) < full || chunks == 1))
            keep_rest(gathered, i, part);
        bcd_tally_merge(gathered->whole, part);
        if (several && (end || i + 1 == milestone) && bcd_tally_realizations(part) == full &&
            chunks > 1)
            keep_whole(gathered, i + 1, end);
        if (i + 1 == milestone)
            milestone = bcd_scene_milestone(scene, i + 1);
    }
    return GATHER_OK;
}

/* Realizations of the base less those that the job ran itself before it took it over. */
static enum store_status count_reused(struct work *work, struct gathered *gathered)
{
    const struct family_sample *base = &gathered->base;
    bool *own = calloc((size_t)base->chunks + 1, sizeof *own);
    enum store_status status = STORE_BROKEN;

    gathered->reused = base->realizations;
    if (own)
        status = store_results_chunks(work->workers->store, work->task->id, own, base->chunks);
    for (int64_t i = 0; status == STORE_OK && i < base->chunks; i++)
        if (own[i])
            gathered->reused -= bcd_scene_realizations(work->task->scene, i + 1) -
                                bcd_scene_realizations(work->task->scene, i);
    free(own);
    return status;
}

static enum gather gather_from_base(struct work *work, struct gathered *gathered)
{
    const struct blob *whole = &gathered->base.whole;
    enum store_status found;
    int tries = 0;

    do
        found = store_samples_base(work->workers->store, work->task->id, &gathered->base);
    while (work_try_again(work, found, ++tries));
    if (found == STORE_OK)
        found = count_reused(work, gathered);
    if (found != STORE_OK && found != STORE_NOT_FOUND) {
        snprintf(work->error.text, sizeof work->error.text, "what it took over could not be read");
        work->error.code = BCD_INTERNAL;
        return GATHER_FAILED;
    }
    if (!whole->bytes ||
        bcd_tally_restore(gathered->whole, whole->bytes, whole->size, &work->error) == BCD_OK)
        return GATHER_OK;
    work_drop_base(work, &gathered->base);
    return GATHER_HOLES;
}

static enum gather gather(struct work *work, struct gathered *gathered)
{
    const struct bcd_scene *scene = work->task->scene;
    struct bcd_tally *part = NULL;
    enum gather status = GATHER_FAILED;

    work->error.code = bcd_tally_create(&gathered->whole, scene);
    if (work->error.code == BCD_OK)
        work->error.code = bcd_tally_create(&part, scene);
    if (work->error.code == BCD_OK)
        status = gather_from_base(work, gathered);
    if (status == GATHER_OK)
        status = merge_all(work, part, gathered);
    bcd_tally_free(part);
    if (status == GATHER_OK) {
        work->error.code = bcd_tally_judge(gathered->whole, scene, &gathered->verdict);
        status = work->error.code ? GATHER_FAILED : GATHER_OK;
    }
    return status;
}

/* ------------------------------------------------------------------ results */

/* The tables of a job as bytes: what store_results_finish takes. */
struct results {
    struct result_new *items;
    size_t count;
};

static void results_fini(struct results *results)
{
    for (size_t i = 0; i < results->count; i++)
        free((void *)results->items[i].table);
    free(results->items);
}

static enum bcd_status add_result(struct results *results, const struct bcd_tally *tally,
                                  const struct bcd_scene *scene, const struct bcd_theory *theory)
{
    struct result_new *item = &results->items[results->count];
    struct bcd_table *table = NULL;
    enum bcd_status status = bcd_tally_table(tally, scene, theory, results->count, &table);
    void *bytes;

    if (status)
        return status;
    item->observable = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, results->count)->type;
    item->size = bcd_table_size(table);
    item->table = bytes = malloc(item->size + 1);
    if (bytes) {
        bcd_table_save(table, bytes);
        results->count++;
    }
    bcd_table_free(table);
    return bytes ? BCD_OK : BCD_NO_MEMORY;
}

/* The exact theory, shared with other jobs; what it takes here is noted. */
static enum bcd_status make_theory(struct work *work, struct bcd_theory **theory)
{
    struct queue *queue = work->workers->queue;
    const double before = work_seconds(work), counted = work->watch.seconds;
    enum bcd_status status;

    work->watch.end = BCD_WATCH_GOES_ON; /* it comes after the run, or another try */
    work->watch.seconds_max = counted + LIMIT_THEORY_SECONDS_MAX;
    status = theory_cache_make(queue_theories(queue), work->task->scene, BCD_THEORY_RING,
                               &work->watch, theory);
    if (status == BCD_OK)
        calibration_note(queue_calibration(queue), CALIBRATION_THEORY,
                         work->watch.seconds - counted, work_seconds(work) - before);
    return status;
}

static enum bcd_status make_results(struct work *work, const struct bcd_tally *tally,
                                    struct results *results)
{
    const struct bcd_scene *scene = work->task->scene;
    struct bcd_theory *theory = NULL;
    enum bcd_status status = BCD_OK;
    size_t count = 0;

    while (bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, count))
        count++;
    results->items = calloc(count + 1, sizeof *results->items);
    if (!results->items)
        return BCD_NO_MEMORY;
    status = make_theory(work, &theory);
    while (status == BCD_OK && results->count < count)
        status = add_result(results, tally, scene, theory);
    bcd_theory_free(theory);
    return status;
}

/* False when the job must be failed: work->error says why. A job that was cancelled at the last
 * moment is no failure, nor is a stop: then the next start finishes it. */
static bool put_results(struct work *work, const struct gathered *gathered,
                        const struct results *results)
{
    struct store *store = work->workers->store;
    const char *id = work->task->id;
    unsigned char family[JOB_HASH_SIZE];
    double spent, untold;
    work_tell_use(work);
    queue_spent_take(work->workers->queue, work->task, &spent, &untold);
    const struct outcome outcome = {.verdict = &gathered->verdict,
                                    .reused = gathered->reused,
                                    .reused_from = gathered->reused > 0 ? gathered->base.job : NULL,
                                    .core_seconds = spent};
    char *text = NULL;
    struct samples_kept kept = {.family = family, .samples = gathered->kept};
    const struct finish_new finish = {
        .results = results->items, .count = results->count, .core_seconds = untold, .kept = &kept};
    enum store_status status = STORE_BROKEN;
    int tries = 0;

    kept.count = queue_family(work->task->scene, family) ? gathered->count : 0;
    do {
        text = text ? text : outcome_json_print(&outcome); /* there may be memory for it now */
        kept.outcome = text;
        if (text)
            status = store_results_finish_with(store, id, &finish);
    } while (work_try_again(work, status, ++tries));
    free(text);
    if (status == STORE_OK) {
        work->task->entry = NULL; /* what the job has used is told */
        log_write(LOG_LEVEL_INFO, "job_done",
                  LOG_FIELDS(log_text("job", id),
                             log_integer("realizations", gathered->verdict.realizations),
                             log_integer("reused", gathered->reused)));
    }
    if (status != STORE_BROKEN || work_should_stop(work))
        return true;
    work->error.code = BCD_INTERNAL;
    snprintf(work->error.text, sizeof work->error.text, "the results could not be stored");
    return false;
}

/* Back to the queue with a goal of at least `least` chunks. */
static enum finish go_on(struct work *work, int64_t least, double expected)
{
    enum store_status status;
    int tries = 0;

    if (work_should_stop(work)) /* a cancel takes the chunks away */
        return FINISH_ENDED;
    work_tell_use(work);
    do
        status = queue_again(work->workers->queue, work->task, least, expected);
    while (status != STORE_OK && work_try_again(work, status, ++tries));
    if (status == STORE_OK)
        return FINISH_AGAIN;
    if (status != STORE_BROKEN || work_should_stop(work))
        return FINISH_ENDED;
    work->error.code = BCD_INTERNAL;
    snprintf(work->error.text, sizeof work->error.text, "what comes next could not be stored");
    return FINISH_FAILED;
}

/* Whether the job's theory takes so long that a worker should go on with something else. */
static bool takes_long(const struct work *work)
{
    struct bcd_theory_cost cost;
    double factor =
        calibration_factor(queue_calibration(work->workers->queue), CALIBRATION_THEORY, NULL);

    bcd_theory_estimate(work->task->scene, BCD_THEORY_RING, LIMIT_THEORY_SECONDS_MAX, &cost);
    return factor * cost.seconds > LIMIT_THEORY_AT_ONCE_SECONDS;
}

/* With all chunks up to the goal: enough, or more of them? */
static enum finish conclude(struct work *work, const struct gathered *gathered)
{
    const struct bcd_verdict *verdict = &gathered->verdict;
    const int64_t chunks = work->task->chunks;
    struct results results = {0};
    enum finish finish = FINISH_FAILED;

    if (verdict->stop == BCD_STOP_NOT)
        return go_on(work, chunks + 1,
                     (double)chunks * verdict->expected / (double)verdict->realizations);
    if (!work->worker->aside && takes_long(work)) {
        work_tell_use(work);
        queue_put_off(work->workers->queue, work->task);
        return FINISH_AGAIN;
    }
    work->error.code = make_results(work, gathered->whole, &results);
    if (work->error.code == BCD_OK && put_results(work, gathered, &results))
        finish = FINISH_ENDED;
    results_fini(&results);
    return finish;
}

size_t work_finishers(size_t count)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);

    return cores < 1 ? 1 : count < (size_t)cores ? count : (size_t)cores;
}

enum finish work_finish(struct work *work)
{
    enum finish finish = FINISH_FAILED;

    /* All chunks are computed: want of memory is worth waiting for. */
    for (int tries = 1; tries == 1 || (work->error.code == BCD_NO_MEMORY &&
                                       tries <= MEMORY_TRIES_MAX && work_back_off(work, tries));
         tries++) {
        struct gathered gathered = {0};
        enum gather status = gather(work, &gathered);

        finish = status == GATHER_OK      ? conclude(work, &gathered)
                 : status == GATHER_HOLES ? go_on(work, work->task->chunks, 0)
                                          : FINISH_FAILED;
        gathered_fini(&gathered);
        if (finish != FINISH_FAILED)
            return finish;
    }
    /* A cancel takes the chunks away; after a stop the next start finishes the job. */
    return work_should_stop(work) ? FINISH_ENDED : FINISH_FAILED;
}
