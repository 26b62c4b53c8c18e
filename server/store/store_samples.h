/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_samples.h - what finished jobs measured, kept for jobs of the same family: those that
 * differ in the number of realizations or the target alone. A sample is the family's first
 * realizations: the tally of their whole chunks, merged, and that of a last chunk which is not
 * full. A running job may stand on one, its base. Blobs are the engine's (bcd_tally_save). See
 * store.h for threads, errors and memory.
 */
#ifndef STORE_SAMPLES_H
#define STORE_SAMPLES_H

#include "store_jobs.h"
#include "store_results.h"

struct family_sample {
    int64_t seq;
    int64_t realizations, chunks; /* chunks: whole ones, those in `whole` */
    char job[JOB_ID_SIZE];        /* who measured it */
    struct blob whole, rest;      /* bytes NULL = none */
};
void family_sample_fini(struct family_sample *sample);

/* The family's largest sample of more than `above` and at most `most` realizations, for a job that
 * may take one over: STORE_NOT_FOUND when there is none, or the job was run by force. */
struct sample_query {
    const char *id; /* the job's */
    const unsigned char *family;
    int64_t above, most;
};
enum store_status store_samples_find(struct store *store, const struct sample_query *query,
                                     struct family_sample *sample);

/* The job stands on this sample from now on; on no other. STORE_CONFLICT when it has ended,
 * STORE_NOT_FOUND when there is no such sample (any more). */
enum store_status store_samples_adopt(struct store *store, const char *id, int64_t seq);

/* What a job stands on; STORE_NOT_FOUND = nothing. */
enum store_status store_samples_base(struct store *store, const char *id,
                                     struct family_sample *sample);

/* A sample that turned out damaged: nobody stands on it any more. */
enum store_status store_samples_drop(struct store *store, int64_t seq);

#endif
