/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue.h - which chunk of which job a worker runs next, and how far each running job is.
 * Jobs in motion live in memory; the queued ones stay in the store until a worker wants one.
 *
 * Between owners the one who has used the fewest core seconds goes first (see queue_owner.c); a
 * newcomer waits for one chunk at most. Of one owner's jobs the one of the highest priority goes
 * first, then one that runs already, then in order of submission; all free workers take chunks of
 * it, so one job uses all workers. What is in motion goes on to the end of its chunk; several that
 * go together (small rings) give way at a checkpoint.
 *
 * THREADS  One mutex and condition variable inside. Any thread may call anything. Ticks are
 *          atomics: workers write them without the mutex.
 */
#ifndef QUEUE_H
#define QUEUE_H

#include "bcd.h"
#include "calibration.h"
#include "job_admit.h"
#include "store_jobs.h"
#include "theory_cache.h"

#include <stdatomic.h>

struct queue;

/* Chunks in a worker's hands, one as a rule. Borrowed from the queue until queue_done /
 * queue_release. */
struct task {
    const char *id;                /* the job's */
    const struct bcd_scene *scene; /* completed, shared, read-only */
    int64_t chunk;                 /* QUEUE_FINISH: none is left, only finishing the job */
    int64_t count;                 /* of chunks from there on: a team's (bcd.h) */
    int64_t chunks;                /* the job's, up to its goal: see goal.h */
    const atomic_bool *cancelled;  /* look at it between slices */
    _Atomic int64_t *ticks_done;   /* the worker writes its progress here, */
    _Atomic int64_t *ticks_total;  /* and what will make it complete; both NULL for QUEUE_FINISH */
    void *claim, *owner;           /* the queue's own, */
    void *entry;                   /* and the job, NULL when it is the queue's again */
};
enum { QUEUE_FINISH = -1 };

/* SHA-256 of bcd_scene_encode(): what makes a job the same job. False = out of memory. */
bool queue_hash(const struct bcd_scene *scene, unsigned char hash[JOB_HASH_SIZE]);

/* The same of bcd_scene_encode_family(): jobs that differ in realizations or target alone. */
bool queue_family(const struct bcd_scene *scene, unsigned char family[JOB_HASH_SIZE]);

enum store_status queue_create(struct queue **queue, struct store *store);
void queue_free(struct queue *queue);

/* How long what takes how long on this machine; the queue's own, and kept in the store by it. */
struct calibration *queue_calibration(struct queue *queue);

/* Exact theories that jobs share; the queue's own. */
struct theory_cache *queue_theories(struct queue *queue);

/* What jobs may take: set, if at all, before there are other threads. */
void queue_set_limits(struct queue *queue, const struct job_limits *limits);
const struct job_limits *queue_limits(const struct queue *queue);

/* How many workers there will be, 1 unless told: teams leave each of them its part. 0 = no teams.
 * Set before there are any. */
void queue_set_workers(struct queue *queue, size_t count);

/* Takes over every running job of the store, and who has queued ones. Called once before workers
 * start. Little is done here: each is prepared by the worker that takes it up, before queued ones
 * of its priority; until then only the store knows how far it is. A job that this program would not
 * run as it was accepted (its text no longer parses, or means something else) is failed with the
 * reason when its turn comes. So is, at once, one that has crashed the server LIMIT_CRASHES_MAX
 * times. One whose latest attempts came to nothing (LIMIT_LOST_BARREN lost, or one crashed) rests:
 * others go first, for LIMIT_REST_MS_MAX at most, so that what they do is saved should it end the
 * server again. */
enum store_status queue_recover(struct queue *queue);

/* There are new jobs of this owner in the store. */
void queue_take(struct queue *queue, const char *owner);

/* Waits for work; false when the queue is stopping. Marks the job running in the store before its
 * first chunk is handed out; a job that the store no longer lets start is dropped. A recovered job
 * whose chunks are all finished comes as one task with chunk == QUEUE_FINISH: finish it, then
 * queue_forget. */
bool queue_claim(struct queue *queue, struct task *task);

/* What a worker for whom there is nothing does in queue_claim instead of waiting: idle(context,
 * news) returns soon after queue_news() is no longer `news`; false = it has nothing to do either.
 * Set before there are workers. queue_tell_idle: there is something to do for them. */
void queue_set_idle(struct queue *queue, bool (*idle)(void *context, unsigned news), void *context);
unsigned queue_news(const struct queue *queue);
void queue_tell_idle(struct queue *queue);

/* The task is finished and its tallies stored. The last chunk of a job makes the caller finish the
 * job (merge, tables, store): *last tells, and id, scene and cancelled then stay borrowed until the
 * caller ends the job here with queue_forget, which it must. */
void queue_done(struct queue *queue, struct task *task, bool *last);
void queue_forget(struct queue *queue, const char *id);

/* In place of finishing a job that takes long, and of queue_forget: it waits for
 * queue_claim_finish, and the task is no longer the caller's. */
void queue_put_off(struct queue *queue, struct task *task);

/* Waits for a job that was put off, as a task with chunk == QUEUE_FINISH; false when the queue is
 * stopping. One at a time while there are chunks in motion, so that it takes a core's worth from
 * others at most; else as many as there are `threads`, chunks included. An owner of whom many wait
 * has no further jobs begun. */
bool queue_claim_finish(struct queue *queue, size_t threads, struct task *task);

/* In place of queue_forget: the job is not at its end, its next goal is one of at least `least`
 * chunks. expected (chunks, 0 = unknown): where the end will probably be, for the progress. On
 * failure the job is as it was before. */
enum store_status queue_again(struct queue *queue, struct task *task, int64_t least,
                              double expected);

/* Core seconds that were used for a task of the queue: the owner's, and the job's while the caller
 * has a part of it. They go to the store now and then, and when the queue is freed. */
void queue_spend(struct queue *queue, const struct task *task, double seconds);

/* The same for what an owner had done beside jobs. */
void queue_spend_of(struct queue *queue, const char *owner, double seconds);

/* Core seconds that the job has used in all attempts; and those of them that the store has not been
 * told, which from here on are the caller's to tell. For who finishes it. */
void queue_spent_take(struct queue *queue, const struct task *task, double *seconds,
                      double *untold);

/* The task was not finished (stopping, cancelled, failed, gave way) and goes back. */
void queue_release(struct queue *queue, struct task *task);

/* Whether a team, which holds its worker for longer than a chunk does, is to give way to somebody
 * whose turn it is: worth asking when a checkpoint has been made. */
bool queue_gives_way(struct queue *queue, const struct task *task);

/* Cancels a job: no further chunk is handed out, running ones are told; when the last of them is
 * let go, the job is gone from here. Unknown ids are ignored. The store is the caller's business.
 * */
void queue_cancel(struct queue *queue, const char *id);

/* 0..1 of a job in motion; negative when it is not here (the store then knows). */
double queue_progress(struct queue *queue, const char *id);

/* The jobs that have begun, at most `room` of them. */
struct queue_running {
    char id[JOB_ID_SIZE];
    double progress; /* 0..1 */
};
size_t queue_running(struct queue *queue, struct queue_running *jobs, size_t room);

/* How long the worker has been at it that prepares a job the longest; 0 = none does. */
int64_t queue_preparing_ms(struct queue *queue);

/* The file beside the database for crash_enter; malloc'ed, NULL = no memory. */
char *queue_crash_path(const struct queue *queue);

/* Wakes all waiting workers for good. */
void queue_stop(struct queue *queue);
bool queue_stopping(const struct queue *queue);

#endif
