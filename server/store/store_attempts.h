/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_attempts.h - each time that a job was in motion, and how that ended. An attempt begins when
 * a job starts to run, or is taken over by another start of the server; the database itself keeps
 * that up (schema/007). See store.h for threads, errors and memory.
 *
 * An attempt is lost when the server ended without a word: kill -9, power cut, somebody else's
 * crash. That is no fault of the job's and never ends it. It has crashed when the job itself ended
 * the server; LIMIT_CRASHES_MAX such, and the job has failed.
 */
#ifndef STORE_ATTEMPTS_H
#define STORE_ATTEMPTS_H

#include "store_jobs.h"

enum { ATTEMPT_REASON_SIZE = 80 };

/* A job that is known to have ended the server, and how. */
struct attempt_crash {
    char job[JOB_ID_SIZE];
    char reason[ATTEMPT_REASON_SIZE];
};

/* At the start: what was in motion has crashed, if it is in `crashes`, or is lost; jobs that did so
 * too often are failed, and all others that run begin another attempt. In one transaction. */
enum store_status store_attempts_recover(struct store *store, const struct attempt_crash *crashes,
                                         size_t count);

/* At the end, when workers have left their checkpoints behind: what was in motion was stopped. */
enum store_status store_attempts_stop(struct store *store);

/* How many of the job's latest attempts, one after another, were lost or crashed without having
 * saved anything; and how many of these crashed. */
struct attempts_barren {
    int64_t lost, crashed;
};
enum store_status store_attempts_barren(struct store *store, const char *id,
                                        struct attempts_barren *barren);

/* Core seconds that jobs have used go to the latest attempt of each. */
struct attempt_use {
    char job[JOB_ID_SIZE];
    double seconds;
};
enum store_status store_attempts_use(struct store *store, const struct attempt_use *uses,
                                     size_t count);
/* Those of all attempts of a job together. */
enum store_status store_attempts_used(struct store *store, const char *id, double *seconds);

/* The job's attempts, newest first, at most `limit`; STORE_NOT_FOUND = no such job. */
struct attempt {
    int64_t number, started_ms, ended_ms, saves; /* ended_ms 0 = it is in motion */
    char ended[16];                              /* "" = it is in motion */
    double core_seconds;                         /* used, as far as they are in the store */
    char *reason;                                /* or NULL */
};
enum store_status store_attempts_list(struct store *store, const char *id, size_t limit,
                                      struct attempt **attempts, size_t *count);
void attempts_free(struct attempt *attempts, size_t count);

#endif
