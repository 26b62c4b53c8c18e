/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue.h - which chunk of which job a worker runs next, and how far each running job is.
 * Lives in memory; rebuilt from the store at start. Jobs in order of submission; all free workers
 * take chunks of the oldest job first, so one job uses all workers.
 *
 * THREADS  One mutex and condition variable inside. Any thread may call anything. Ticks are
 *          atomics: workers write them without the mutex.
 */
#ifndef QUEUE_H
#define QUEUE_H

#include "bcd.h"
#include "store.h"

#include <stdatomic.h>

struct queue;

/* A chunk in a worker's hands. Borrowed from the queue until queue_done / queue_release. */
struct task {
    const char *id;                /* the job's */
    const struct bcd_scene *scene; /* completed, shared, read-only */
    int64_t chunk;
    const atomic_bool *cancelled;  /* look at it between slices */
    _Atomic int64_t *ticks_done;   /* the worker writes its progress here */
    void *entry;                   /* the queue's own */
};

enum store_status queue_create(struct queue **queue, struct store *store);
void queue_free(struct queue *queue);

/* Takes over every unfinished job of the store. Called once before workers start. */
enum store_status queue_recover(struct queue *queue);

/* A job that was just inserted; the queue owns the scene afterwards (_take). */
void queue_take(struct queue *queue, const char *id, struct bcd_scene *scene);

/* Waits for work; false when the queue is stopping. Marks the job running in the store when this
 * is its first chunk. */
bool queue_claim(struct queue *queue, struct task *task);

/* The chunk is finished and its tally stored. The last chunk of a job makes the caller finish the job
 * (merge, tables, store): *last tells. After that, queue_forget ends the job here. */
void queue_done(struct queue *queue, struct task *task, bool *last);
void queue_forget(struct queue *queue, const char *id);

/* The chunk was not finished (stopping, cancelled, failed) and goes back. */
void queue_release(struct queue *queue, struct task *task);

/* Cancels a job: no further chunk is handed out, running ones are told. The store is the caller's
 * business. */
void queue_cancel(struct queue *queue, const char *id);

/* 0..1 of a job in the queue; negative when it is not here (the store then knows). */
double queue_progress(struct queue *queue, const char *id);

/* Wakes all waiting workers for good. */
void queue_stop(struct queue *queue);
bool queue_stopping(const struct queue *queue);

#endif
