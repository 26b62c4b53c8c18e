/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker_internal.h - what worker.c, which moves runs, worker_chunks.c, which makes them,
 * worker_checkpoint.c, which keeps them, worker_lend.c, which has all that done elsewhere, and
 * worker_finish.c, which ends jobs, share.
 */
#ifndef WORKER_INTERNAL_H
#define WORKER_INTERNAL_H

#include "crew.h"
#include "lease.h"
#include "store_pieces.h"
#include "store_results.h"
#include "store_samples.h"
#include "worker.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>

enum { MEMORY_TRIES_MAX = 8 };

/* One thread, and what it tells others of itself. */
struct worker {
    struct workers *workers;
    pthread_t thread;
    atomic_int id; /* the kernel's; 0 = not started yet */
    bool aside;    /* it finishes jobs that were put off */
    atomic_bool alive, busy;
    atomic_int_least64_t seen_ns; /* when it last came by its clock */
    atomic_int_least64_t chunks, rod_steps;
    atomic_int_least64_t checkpoints, saving_ns; /* made, and what that took of the processor */
};

/* Where chunks are lent there are hundreds of threads, most of which wait for theirs to come back.
 * So that those who do not wait leave the machine to others, only so many at a time take a chunk
 * from the queue (which may start a job), and only so many work: put a result away, finish a job,
 * or run what cannot be lent. Who takes waits for work, and must keep nobody from that. */
struct workers {
    struct queue *queue;
    struct store *store;
    char *crash_path;
    struct leases *leases; /* NULL = chunks are run here, and nobody waits for the two: */
    sem_t taking, working;
    struct crew *crew; /* who has no chunk helps with large rings; NULL = nobody does */
    size_t most, aside;    /* threads; of these, the first ones, that finish jobs */
    atomic_size_t count;   /* of them that there are: it grows where chunks are lent, */
    atomic_size_t looking; /* while none of those is looking for a task */
    atomic_bool told;      /* that there are no more to be had */
    pthread_mutex_t grow;
    struct worker each[];
};

/* A task's checkpoints: when the next ones are due and what they may cost (worker_checkpoint.c);
 * the file of large ones, which are of a run that goes alone, the sums of what is kept in it, and
 * of what is about to be. */
struct saving {
    int64_t due_ns, gap_ns, credit_ns;
    int64_t put_ns, took_ns, cpu_ns; /* since when the newest one waits for the disk, its cost */
    struct pieces *file;
    uint64_t *kept, *next;
};

/* One task in work. `cpu_ns`: this thread's clock when its use was told last. */
struct work {
    struct workers *workers;
    struct worker *worker;
    struct task *task;
    struct bcd_team *team; /* the runs of its chunks */
    struct crew_lead *lead; /* those who help; NULL = nobody does */
    int64_t helped_ns;      /* what that took of their processors */
    struct bcd_error error;
    int64_t cpu_ns;
    double expected_seconds; /* of its chunks as a whole */
    struct saving saving;
    struct bcd_watch watch;       /* over everything that the engine does for it */
    int64_t began_ns, allowed_ns; /* of this thread's clock; allowed: 0 = whatever it takes */
};

/* What became of a task's chunks. */
enum run_end {
    RUN_DONE,     /* their tallies are stored */
    RUN_STOPPED,  /* cancelled or stopping; go back */
    RUN_GAVE_WAY, /* checkpoints are stored; go back */
    RUN_FAILED,   /* the job cannot be run */
};

/* ------------------------------------------------------------------ worker.c */

int64_t work_now_ns(void); /* steady, */
int64_t work_cpu_ns(void); /* and of this thread alone */
bool work_should_stop(const struct work *work);
/* Tells the queue what this task has used since it was told last. */
void work_tell_use(struct work *work);
/* Core seconds that the thread, and those who helped, have used for the task so far. */
double work_seconds(const struct work *work);
/* Waits before try number `tries` + 1 (tries >= 1); false as soon as there is no use in waiting. */
bool work_back_off(const struct work *work, int tries);
/* What to do about a store that answered `status` at try number `tries`: true = try again. */
bool work_try_again(struct work *work, enum store_status status, int tries);

/* Runs the task's chunks in this thread, and stores their tallies. */
enum run_end work_run_here(struct work *work);
/* Sets how much of the processor they may take. */
void work_allow(struct work *work);
double work_rod_steps(const struct task *task);

/* One more thread; false = there are as many as there may be, or it cannot be had (logged once). */
bool work_grow(struct workers *workers);

/* ----------------------------------------------------------- worker_chunks.c */

/* Makes the runs, each where it was left if it was left anywhere. */
enum bcd_status work_create_team(struct work *work);

/* Of each run its checkpoint, or, of those that have ended, its tally. */
struct run_bytes {
    int64_t count;
    struct chunk_new *at; /* [count]; NULL = no memory for all of them */
};
struct run_bytes run_bytes_of(const struct bcd_team *team, bool tally);
void run_bytes_fini(struct run_bytes *bytes);

/* Stores the tallies of runs that have ended, with patience. */
enum run_end work_put_tallies(struct work *work);
/* The same for tallies at hand, one for each of the task's chunks. */
enum run_end work_put_chunks(struct work *work, const struct chunk_new *tallies);

/* ------------------------------------------------------------- worker_lend.c */

/* The next task; false = there will be none. */
bool work_take(struct worker *worker, struct task *task);

/* Between these a task that was lent is worked at here; false = it is to stop, and nothing was
 * begun. Where nothing is lent, and for what was put off, they do nothing. */
bool work_begin(struct work *work);
void work_end(struct work *work);

/* The chunks, here or, one by one, elsewhere. */
enum run_end work_run_chunk(struct work *work);

/* ------------------------------------------------------- worker_checkpoint.c */

/* Puts a run that was just made, of the task's index-th chunk, where its newest checkpoint left
 * it. */
enum saved {
    SAVED_NOTHING,
    SAVED_RESTORED,
    SAVED_LATER,   /* there is no memory to read it at the moment */
    SAVED_DAMAGED, /* work->error says in which way; the run is as it was */
};
enum saved saving_restore(struct work *work, int64_t index);
/* The chunk's newest checkpoint, sound or not; the file it may be in is opened to go on with.
 * STORE_NOT_FOUND: there is none. STORE_CONFLICT: its file cannot be read. STORE_BROKEN: no memory.
 */
enum store_status saving_load(struct work *work, int64_t index, struct blob *checkpoint);

/* The runs are about to move. */
void saving_begin(struct work *work, int64_t now_ns);
/* Between two slices: makes checkpoints if they are due. True if that took time. Some that cannot
 * be kept cost work after a crash, not the runs: logged, and that is it. */
bool saving_look(struct work *work, int64_t now_ns);
/* The runs will not move any more for now: where they stand is kept. */
void saving_last(struct work *work);
/* ended: no checkpoint of the chunks is needed any more. */
void saving_end(struct work *work, bool ended);

/* ----------------------------------------------------------- worker_finish.c */

/* All chunks up to the goal are done: the results, or the next goal. */
enum finish {
    FINISH_ENDED,  /* results are stored, or the job was cancelled, or the next start finishes it */
    FINISH_FAILED, /* work->error says why */
    FINISH_AGAIN,  /* the queue has it back, or it was put off; the task is no longer ours */
};
enum finish work_finish(struct work *work);
/* Threads that finish what is put off, beside `count` that run chunks. */
size_t work_finishers(size_t count);

/* What the job stands on turned out damaged: logged and dropped. */
void work_drop_base(struct work *work, const struct family_sample *base);

#endif
