/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * lease_json.h - what a daemon and a worker elsewhere say to each other about a chunk (see
 * lease.h), written and read by either side. Bytes go as base64 with their SHA-256. Printing
 * functions return malloc'ed JSON, NULL = out of memory; readers put every fault into errors, with
 * its pointer.
 */
#ifndef LEASE_JSON_H
#define LEASE_JSON_H

#include "bcd.h"
#include "identity.h"
#include "store_results.h"

enum { LEASE_ID_SIZE = 20, LEASE_WORKER_SIZE = 64, LEASE_DIGEST_SIZE = 32 };

/* What a worker is given. */
struct lease_loan {
    char id[LEASE_ID_SIZE], job[JOB_ID_SIZE];
    int64_t chunk, attempt;             /* how often it has been given away */
    int64_t lease_ms;                   /* until a heartbeat is due */
    double core_seconds_max, bytes_max; /* more, and the run has failed; 0 = without limit */
    unsigned char hash[JOB_HASH_SIZE];
    char *scene;                   /* the completed job, JSON */
    struct blob checkpoint, begun; /* to go on from; empty = there is none */
};
void lease_loan_fini(struct lease_loan *loan);

/* What a worker says: that it is at it, lets go, has failed; or, with a tally, that it has ended.
 */
struct lease_word {
    char id[LEASE_ID_SIZE], job[JOB_ID_SIZE];
    char owner[OWNER_SIZE]; /* by whose token; not said in JSON */
    int64_t chunk;
    int64_t ticks_done, ticks_total;
    double core_seconds;                     /* for this chunk, in all */
    bool let_go;                             /* somebody else may have it */
    bool waiting;                            /* nobody has it yet (share.h; not said in JSON) */
    char *failed;                            /* the run failed, in these words; NULL = it did not */
    struct blob bytes;                       /* a checkpoint, or the tally */
    unsigned char digest[LEASE_DIGEST_SIZE]; /* of them */
};
void lease_word_fini(struct lease_word *word);

/* {"worker","result_version"} */
char *lease_json_request(const char *worker);
bool lease_json_read_request(const char *text, size_t size, char worker[LEASE_WORKER_SIZE],
                             struct bcd_errors *errors);

/* {"lease":{...}}; NULL = there is nothing to do. loan->id is empty then, once it is read. */
char *lease_json_loan(const struct lease_loan *loan);
bool lease_json_read_loan(const char *text, size_t size, struct lease_loan *loan,
                          struct bcd_errors *errors);

/* A heartbeat, or the return of a tally. The digest is made as it is written, and checked as it is
 * read; the id stands in the path. */
char *lease_json_word(const struct lease_word *word, bool ended);
bool lease_json_read_word(const char *text, size_t size, bool ended, struct lease_word *word,
                          struct bcd_errors *errors);

#endif
