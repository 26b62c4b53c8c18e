/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_attempts.h - each time that a job was in motion, and how that ended. An attempt begins when
 * a job starts to run, or is taken over by another start of the server; the database itself keeps
 * that up (schema/007). See store.h for threads, errors and memory.
 *
 * An attempt is lost when the server ended without a word: kill -9, power cut, somebody else's
 * crash. That is no fault of the job's and never ends it, unless it is want of memory that ends the
 * server each time before the job gets anywhere. It has crashed when the job itself ended
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

/* What is known of the end of the server: who crashed it, and whether memory was short (starved),
 * which kills it like a kill -9. */
struct attempts_end {
    const struct attempt_crash *crashes;
    size_t count;
    bool starved;
};

/* At the start: what was in motion has crashed, or is lost; jobs that crashed too often are failed,
 * so are those whose last LIMIT_STARVED_MAX attempts were lost for want of memory before they saved
 * anything; all others that run begin another attempt. In one transaction. */
enum store_status store_attempts_recover(struct store *store, const struct attempts_end *end);

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
