/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_jobs.h - the table of jobs and the only way their states move.
 *
 *   queued -> running -> done | failed | cancelled;  queued -> cancelled | failed
 *
 * One function is one transition is one UPDATE that names the old state. Terminal states are
 * immutable. See store.h for threads, errors and memory.
 */
#ifndef STORE_JOBS_H
#define STORE_JOBS_H

#include "store.h"
#include "ticket.h"

#include <stdbool.h>
#include <stdint.h>

enum job_state { JOB_QUEUED, JOB_RUNNING, JOB_DONE, JOB_FAILED, JOB_CANCELLED, JOB_STATES };
const char *job_state_name(enum job_state state); /* "queued", ... */
bool job_state_parse(const char *name, enum job_state *state);

/* Begins the reason of a failure: its hash is another one now. */
#define JOB_OUTDATED "accepted by a version whose results differ"

enum { JOB_ID_SIZE = 24, JOB_HASH_SIZE = 32 };

/* A row as users see it. Times are milliseconds since 1970 UTC, 0 = not yet. The texts are JSON
 * as made by scene_json.c when the job was accepted. */
struct job_record {
    int64_t seq;          /* order of submission */
    char id[JOB_ID_SIZE]; /* [a-z0-9-]+ */
    unsigned char hash[JOB_HASH_SIZE];
    enum job_state state;
    int64_t submitted_ms, started_ms, finished_ms;
    int64_t chunks, chunks_done;
    int64_t attempts_lost, attempts_failed; /* store_attempts.h */
    char *job;            /* the job as completed with defaults */
    char *derived;        /* what the engine derived from it */
    char *error;          /* NULL or why it failed */
    char *outcome;        /* what became of it, outcome_json.h; NULL until it is done */
    struct ticket ticket; /* of the first who wanted it */
};
void job_record_fini(struct job_record *record);
void job_records_free(struct job_record *records, size_t count);

/* A job to be kept. hash = SHA-256 of bcd_scene_encode(). idempotency_key may be NULL. */
struct job_new {
    unsigned char hash[JOB_HASH_SIZE];
    const char *job, *derived;
    int64_t chunks;
    const char *idempotency_key;
    double core_seconds, bytes;  /* that it is expected to need, >= 0 */
    const struct identity *by;   /* for the audit log; borrowed, NULL = no line there */
    const struct ticket *ticket; /* borrowed; NULL = of OWNER_LOCAL, and nothing more */
    bool force;                  /* run anew although the same job stands; the new one then does */
};

/* On disk when it returns STORE_OK. When a job with this hash is queued, running or done already,
 * *existed is true and the record is that one; one that failed or was cancelled may be inserted
 * again. An idempotency key always answers with the job it was first used for, whatever became of
 * it; used for another job it is STORE_CONFLICT. STORE_QUOTA: a new job is more than its owner may
 * have. 1..LIMIT_IDEMPOTENCY_KEY_BYTES_MAX bytes. */
enum store_status store_jobs_insert(struct store *store, const struct job_new *job,
                                    struct job_record *record, bool *existed);

enum store_status store_jobs_get(struct store *store, const char *id, struct job_record *record);

/* How many jobs are in each state, kept by counters rather than counted. */
enum store_status store_jobs_counts(struct store *store, int64_t counts[JOB_STATES]);

/* All running jobs in order of submission, for the queue at start. */
enum store_status store_jobs_running(struct store *store, struct job_record **records,
                                     size_t *count);

/* The queued jobs of an owner that come next: by priority, then in order of submission. At most
 * `room` of them; *count tells how many there are. */
struct job_waiting {
    int64_t seq;
    int priority;
    char id[JOB_ID_SIZE];
};
enum store_status store_jobs_waiting(struct store *store, const char *owner,
                                     struct job_waiting *waiting, size_t room, size_t *count);

/* The transitions. STORE_CONFLICT when the job is not in the state it moves from.
 * (running -> done is store_results_finish: results and state change together.) */
enum store_status store_jobs_start(struct store *store, const char *id);
enum store_status store_jobs_fail(struct store *store, const char *id, const char *error);
enum store_status store_jobs_cancel(struct store *store, const char *id);
/* The same by somebody, whose line in the audit log is written with it or not at all. */
enum store_status store_jobs_cancel_by(struct store *store, const char *id,
                                       const struct identity *by);

#endif
