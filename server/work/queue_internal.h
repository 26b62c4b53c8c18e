/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * queue_internal.h - what the queue*.c files share. Nobody else includes this.
 *
 * In memory are the jobs in motion and, of each owner, which job comes next (its head). All others
 * that are queued stay in the store.
 *
 * THREADS  `mutex` guards everything but what is atomic. It is never held while the store works.
 * `changed` is broadcast (queue_changed) whenever a waiting worker might go on. An entry is freed
 * by whoever takes away the last reason to keep it (entry_release), always under the mutex. Owners
 * stay.
 */
#ifndef QUEUE_INTERNAL_H
#define QUEUE_INTERNAL_H

#include "queue.h"

#include <pthread.h>

enum chunk_state { CHUNK_FREE, CHUNK_CLAIMED, CHUNK_DONE };

/* Chunks in motion, `count` from `chunk` on. */
struct claim {
    struct queued *entry;
    struct claim *previous, *next;
    int64_t chunk, count;
    _Atomic int64_t ticks_done, ticks_total;
};

/* A job in motion. Chunks below `first_free` are claimed or done. */
struct queued {
    char id[JOB_ID_SIZE]; /* first: the index compares entries by it */
    struct owner *owner;
    struct queued *previous, *next; /* of the same owner */
    int64_t seq;
    int priority;
    struct bcd_scene *scene; /* NULL until it has started */
    bool started;            /* the store says running, and there is a scene */
    bool resumes;            /* the store says running since before the server's start */
    int64_t prepared_ms;     /* steady clock; a worker prepares it since then. 0 = nobody does */
    int64_t rests_until_ms;  /* steady clock; others go first until then. 0 = it does not rest */
    int64_t chunks, chunks_done, first_free; /* chunks: up to the goal */
    int64_t team;                            /* as many may go together */
    unsigned char *chunk_state;
    double progress, from, to; /* where it was when `from` chunks were done; expected end, or 0 */
    struct claim *claims;
    double spent, untold; /* core seconds in all attempts; of these, what is not in the store yet */
    bool pinned;          /* a worker is starting or finishing it */
    bool aside;           /* it is finished aside, or is to be */
    bool ended;           /* forgotten or cancelled: to be freed as soon as nobody holds it */
    atomic_bool cancelled;
};

/* Somebody who has, or had, jobs here. */
struct owner {
    char name[OWNER_SIZE];
    struct owner *next;
    struct queued *first, *last; /* in motion */
    size_t starting;             /* of these, not started yet */
    size_t claims;               /* chunks in motion */
    bool waiting;                /* the store may have queued jobs */
    bool asking;                 /* a worker asks the store for the head */
    unsigned news;               /* how often there was something new */
    bool head_known;
    struct job_waiting head; /* the queued job that comes next, */
    bool more;               /* and whether there are others */
    bool greeted;            /* has been given a chunk since there was nothing to do for it */
    double usage;            /* core seconds, decayed, as of usage_ms */
    int64_t usage_ms;
    double unsaved; /* of these, not in the store yet */
};

struct queue {
    struct store *store;
    struct calibration *calibration; /* has its own mutex, */
    struct theory_cache *theories;   /* and so has this */
    struct job_limits limits;
    size_t workers; /* like the limits as it was at the beginning */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    atomic_uint news; /* how often `changed` was broadcast */
    bool (*idle)(void *context, unsigned news);
    void *idle_context;
    struct owner *owners;
    void *index; /* tsearch tree of entries by id */
    bool jumped; /* the latest chunk went to a newcomer, out of turn */
    bool saving; /* a worker takes usage to the store */
    int64_t saved_ms;
    atomic_bool stopping;
};

/* With the mutex held. */
static inline void queue_changed(struct queue *queue)
{
    atomic_fetch_add(&queue->news, 1);
    pthread_cond_broadcast(&queue->changed);
}

/* ------------------------------------------------------------- queue_entry.c */

struct queued *entry_find(struct queue *queue, const char *id);
/* NULL = no memory. */
struct queued *entry_create(struct owner *owner, const char *id);
/* Hands over a scene, in the place of one before; false = no memory (it is freed). */
bool entry_set_scene_take(struct queue *queue, struct queued *entry, struct bcd_scene *scene);
/* Reads from the store up to where the job is to be run, and what of that is done; needs no mutex
 * while the entry is in the caller's hands alone (pinned). */
enum store_status entry_read_goal(struct queue *queue, struct queued *entry, int64_t least);
double entry_progress(const struct queued *entry);
/* Appends an entry to its owner and the index; false = no memory, or the job is here already. */
bool entry_append(struct queue *queue, struct queued *entry);
/* Frees an entry that has ended and is in nobody's hands. */
void entry_release(struct queue *queue, struct queued *entry);
void entry_free(struct queued *entry);
/* The next chunk to hand out: a free one, QUEUE_FINISH, or chunks = none. */
int64_t entry_next_chunk(struct queued *entry);
/* Hands out that chunk, and those that go with it; false = no memory. */
bool entry_claim(const struct queue *queue, struct queued *entry, struct task *task);
/* Takes the claim away from its entry and frees it. */
struct queued *entry_drop_claim(struct task *task, enum chunk_state becomes);

/* ------------------------------------------------------------- queue_owner.c */

/* The owner of this name, made when missing; NULL = no memory. */
struct owner *owner_find(struct queue *queue, const char *name);
/* The job in motion of this owner that comes first, to be resumed or with a chunk to hand out;
 * NULL = none has anything to be done. */
struct queued *owner_entry(struct owner *owner);
/* Whose turn it is; NULL = there is no work. *jumps: it is that of a newcomer, out of turn. */
struct owner *owner_choose(struct queue *queue, bool *jumps);
/* Whether it is somebody else's turn rather than that of this owner, who has work in motion. */
bool owner_gives_way(struct queue *queue, const struct owner *owner);
/* Takes usage to the store. With the mutex held, and let go meanwhile. */
void owner_save_usage(struct queue *queue);
int64_t owner_now_ms(void);
/* Whether another job of the owner's may be begun: there is one, as far as is known, and not too
 * many wait to be finished. */
bool owner_may_start(const struct owner *owner);
/* The job to be finished aside next; NULL = none waits, or it is not the time: see
 * queue_claim_finish. */
struct queued *owner_finish(struct queue *queue, size_t threads);
/* The job whose rest ends first; NULL = none rests. */
struct queued *owner_resting(struct queue *queue);
/* A clock that nobody sets. */
int64_t owner_steady_ms(void);

/* ------------------------------------------------------------- queue_start.c */

/* All three with the mutex held, and let go meanwhile. */
void start_ask(struct queue *queue, struct owner *owner);
void start_head(struct queue *queue, struct owner *owner);
void start_again(struct queue *queue, struct queued *entry);
/* Waits a moment, less when the queue stops. */
void start_wait(struct queue *queue);
/* Nobody has work, but jobs that rest: waits for news, or ends a rest. */
void start_rested(struct queue *queue);

#endif
