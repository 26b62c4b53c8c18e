/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_owners.h - what each owner has waiting, has used and may use. The counts are kept by
 * triggers on jobs. See store.h for threads, errors and memory.
 */
#ifndef STORE_OWNERS_H
#define STORE_OWNERS_H

#include "identity.h"
#include "store.h"
#include "ticket.h"

#include <stdbool.h>
#include <stdint.h>

enum quota { QUOTA_QUEUED, QUOTA_DAY_SECONDS, QUOTA_BYTES, QUOTAS };
extern const char *const quota_names[QUOTAS]; /* "queued_points", "core_seconds_per_day", ... */
extern const double quota_defaults[QUOTAS];   /* of limits.h */

struct owner_record {
    char owner[OWNER_SIZE];
    int64_t queued;         /* jobs in state queued */
    double waiting_seconds; /* core seconds that queued and running jobs are expected to need */
    double bytes;           /* of results; of jobs that have not ended, what is expected */
    double usage_seconds; /* core seconds used, halved every LIMIT_USAGE_HALF_LIFE_MS, as of now */
    double day_seconds;   /* core seconds used since midnight UTC */
    double quota[QUOTAS]; /* what counts; negative where the default does, in set_quota only */
    bool given[QUOTAS];   /* to this owner; else it is the default */
};

/* By name. The caller frees *records. */
enum store_status store_owners_list(struct store *store, struct owner_record **records,
                                    size_t *count);

/* Somebody nobody heard of has nothing and the default quotas. */
enum store_status store_owners_get(struct store *store, const char *owner,
                                   struct owner_record *record);

/* quota[i] < 0 = the default. `by` goes to the audit log. */
enum store_status store_owners_set_quota(struct store *store, const char *owner,
                                         const double quota[QUOTAS], const struct identity *by);

/* Core seconds that were used now. */
enum store_status store_owners_spend(struct store *store, const char *owner, double seconds);

/* How much of a quota is taken, and would be by a submission that needs this much. */
struct quota_need {
    double value[QUOTAS]; /* jobs, core seconds, bytes */
};
double owner_record_use(const struct owner_record *record, enum quota quota);
/* The first quota that the need goes beyond; QUOTAS = none. */
enum quota owner_record_excess(const struct owner_record *record, const struct quota_need *need);

/* What goes before a job of this owner and priority that is submitted now and needs `seconds`: the
 * owner's own jobs of this priority and above, and as much of each other's as they get meanwhile,
 * for all get the same. */
struct waiting_before {
    int64_t jobs; /* the owner's own */
    double seconds;
};
enum store_status store_owners_before(struct store *store, const struct ticket *ticket,
                                      double seconds, struct waiting_before *before);

/* `seconds` used `age_ms` ago, as they count now. */
double owner_decay(double seconds, int64_t age_ms);

#endif
