/* SPDX-License-Identifier: GPL-3.0-or-later
 * queue_entry.c - jobs in motion and their chunks; see queue_internal.h. */
#include "queue_internal.h"

#include "goal.h"
#include "limits.h"

#include <assert.h>
#include <search.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int compare_ids(const void *a, const void *b)
{
    return strcmp(a, b);
}

struct queued *entry_find(struct queue *queue, const char *id)
{
    struct queued *const *node = tfind(id, &queue->index, compare_ids);

    return node ? *node : NULL;
}

struct queued *entry_create(struct owner *owner, const char *id)
{
    struct queued *entry = calloc(1, sizeof *entry);

    if (!entry)
        return NULL;
    snprintf(entry->id, sizeof entry->id, "%s", id);
    entry->owner = owner;
    atomic_init(&entry->cancelled, false);
    return entry;
}

/* As many chunks as may go together for their memory. */
static int64_t team_of(const struct queue *queue, const struct bcd_scene *scene)
{
    int64_t team = bcd_scene_team(scene);
    struct bcd_estimate estimate;

    bcd_scene_estimate(scene, &estimate);
    if (estimate.run_bytes > LIMIT_CHECKPOINT_ROW_BYTES) /* files are for runs that go alone */
        return 1;
    while (team > 1 && (double)team * estimate.run_bytes > queue->limits.run_bytes)
        team /= 2;
    return team;
}

bool entry_set_scene_take(struct queue *queue, struct queued *entry, struct bcd_scene *scene)
{
    bcd_scene_free(entry->scene);
    free(entry->chunk_state);
    entry->scene = NULL;
    entry->chunks = bcd_scene_chunks(scene);
    entry->team = team_of(queue, scene);
    entry->chunk_state = calloc((size_t)entry->chunks + 1, 1); /* CHUNK_FREE */
    if (!entry->chunk_state) {
        bcd_scene_free(scene);
        return false;
    }
    entry->scene = scene;
    if (bcd_scene_part(scene, BCD_SLOT_TARGET, 0))
        entry->to = (double)entry->chunks;
    return true;
}

enum store_status entry_read_goal(struct queue *queue, struct queued *entry, int64_t least)
{
    struct goal goal;
    enum store_status status = goal_read(queue->store, entry->id, entry->scene, least, &goal);

    if (status)
        return status;
    pthread_mutex_lock(&queue->mutex);
    assert(!entry->claims);
    for (int64_t i = 0; i < goal.chunks; i++)
        entry->chunk_state[i] = goal.done[i] ? CHUNK_DONE : CHUNK_FREE;
    entry->chunks = goal.chunks;
    entry->chunks_done = goal.chunks_done;
    entry->first_free = 0;
    pthread_mutex_unlock(&queue->mutex);
    free(goal.done);
    return STORE_OK;
}

/* Without a target the share of the chunks. With one nobody knows the end: from each verdict on it
 * heads for 9/10 of what was left then, where the verdict expects the end. So it never goes back.
 */
double entry_progress(const struct queued *entry)
{
    double done = (double)entry->chunks_done, share;

    for (const struct claim *claim = entry->claims; claim; claim = claim->next) {
        int64_t total = atomic_load(&claim->ticks_total);

        if (total > 0)
            done += (double)claim->count * (double)atomic_load(&claim->ticks_done) / (double)total;
    }
    if (entry->to == 0)
        return done < (double)entry->chunks ? done / (double)entry->chunks : 1;
    share = (done - entry->from) / (entry->to - entry->from);
    share = !(share > 0) ? 0 : share < 1 ? share : 1;
    return entry->progress + 0.9 * (1 - entry->progress) * share;
}

bool entry_append(struct queue *queue, struct queued *entry)
{
    struct queued *const *node = tsearch(entry, &queue->index, compare_ids);
    struct owner *owner = entry->owner;

    if (!node || *node != entry)
        return false;
    entry->previous = owner->last;
    if (owner->last)
        owner->last->next = entry;
    else
        owner->first = entry;
    owner->last = entry;
    return true;
}

void entry_release(struct queue *queue, struct queued *entry)
{
    struct owner *owner = entry->owner;

    if (!entry->ended || entry->pinned || entry->claims)
        return;
    tdelete(entry, &queue->index, compare_ids);
    if (entry->previous)
        entry->previous->next = entry->next;
    else
        owner->first = entry->next;
    if (entry->next)
        entry->next->previous = entry->previous;
    else
        owner->last = entry->previous;
    entry_free(entry);
}

void entry_free(struct queued *entry)
{
    if (!entry)
        return;
    assert(!entry->claims);
    bcd_scene_free(entry->scene);
    free(entry->chunk_state);
    free(entry);
}

int64_t entry_next_chunk(struct queued *entry)
{
    while (entry->first_free < entry->chunks && entry->chunk_state[entry->first_free] != CHUNK_FREE)
        entry->first_free++;
    if (entry->first_free == entry->chunks && entry->chunks_done == entry->chunks && !entry->pinned)
        return QUEUE_FINISH;
    return entry->first_free;
}

/* How many chunks from the free one on go together: no more than leave the other workers as many,
 * a power of two. */
static int64_t count_of(const struct queue *queue, const struct queued *entry, int64_t chunk)
{
    const int64_t workers = (int64_t)queue->workers;
    int64_t most = workers ? (entry->chunks - chunk + workers - 1) / workers : 1;
    int64_t free = 1, count = 1;

    most = most < entry->team ? most : entry->team;
    while (free < most && entry->chunk_state[chunk + free] == CHUNK_FREE)
        free++;
    while (2 * count <= free)
        count *= 2;
    return count;
}

bool entry_claim(const struct queue *queue, struct queued *entry, struct task *task)
{
    int64_t chunk = entry_next_chunk(entry), count = 0;
    struct claim *claim = NULL;

    if (chunk == QUEUE_FINISH) {
        entry->pinned = true;
    } else {
        claim = calloc(1, sizeof *claim);
        if (!claim)
            return false;
        count = count_of(queue, entry, chunk);
        claim->entry = entry;
        claim->chunk = chunk;
        claim->count = count;
        atomic_init(&claim->ticks_done, 0);
        atomic_init(&claim->ticks_total, 0);
        claim->next = entry->claims;
        if (entry->claims)
            entry->claims->previous = claim;
        entry->claims = claim;
        memset(entry->chunk_state + chunk, CHUNK_CLAIMED, (size_t)count);
        entry->owner->claims++;
    }
    *task = (struct task){
        .id = entry->id,
        .scene = entry->scene,
        .chunk = chunk,
        .count = count,
        .chunks = entry->chunks,
        .cancelled = &entry->cancelled,
        .ticks_done = claim ? &claim->ticks_done : NULL,
        .ticks_total = claim ? &claim->ticks_total : NULL,
        .claim = claim,
        .owner = entry->owner,
        .entry = entry,
    };
    return true;
}

struct queued *entry_drop_claim(struct task *task, enum chunk_state becomes)
{
    struct claim *claim = task->claim;
    struct queued *entry = claim->entry;

    if (claim->previous)
        claim->previous->next = claim->next;
    else
        entry->claims = claim->next;
    if (claim->next)
        claim->next->previous = claim->previous;
    assert(entry->chunk_state[claim->chunk] == CHUNK_CLAIMED);
    memset(entry->chunk_state + claim->chunk, (int)becomes, (size_t)claim->count);
    if (becomes == CHUNK_DONE)
        entry->chunks_done += claim->count;
    else if (claim->chunk < entry->first_free)
        entry->first_free = claim->chunk;
    entry->owner->claims--;
    task->claim = NULL;
    task->ticks_done = task->ticks_total = NULL;
    free(claim);
    return entry;
}
