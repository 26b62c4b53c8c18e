/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * lease.h - chunks lent to workers elsewhere: who has which, for how long, and what comes back.
 *
 * A thread of worker.c offers a chunk in its hands and waits; a worker that asks is given it for
 * LIMIT_LEASE_MS, and longer with every heartbeat. When none comes in time the next one who asks is
 * given the chunk, from its latest checkpoint. Whoever returns a tally first, that one counts: it
 * does not matter who of those who were given a chunk ran it, for the bits are the same. One that
 * comes later is compared: other bits are an alarm about a machine. A run that fails is tried by
 * another worker before the job has failed.
 *
 * Nothing of this is kept on disk. After a restart of the daemon the same chunks are offered again,
 * and a heartbeat of one who has such a chunk already makes it that worker's again.
 *
 * THREADS  One mutex inside; any thread may call anything.
 */
#ifndef LEASE_H
#define LEASE_H

#include "lease_json.h"
#include "queue.h"

struct leases;
/* lease_ms: 0 = LIMIT_LEASE_MS. NULL = no memory. */
struct leases *leases_create(int64_t lease_ms);
void leases_free(struct leases *leases); /* all offers have been taken back */

/* So many workers may come: as many chunks are offered at a time. Without it a few more than are
 * taken at the moment, so that what is offered does not keep others waiting whose turn it is. */
void leases_expect(struct leases *leases, size_t workers);

/* What is going on, for /metrics and for who starts workers. */
struct lease_counts {
    size_t offered, held;              /* chunks nobody runs, chunks in somebody's hands */
    size_t expected;                   /* see leases_expect */
    int64_t granted, expired;          /* since the start */
    int64_t returned, again, differed; /* results taken; come once more; with other bits */
    int64_t unwanted;                  /* results of chunks that nobody waits for */
    int64_t missed;                    /* who asked and was given nothing */
};
void leases_count(struct leases *leases, struct lease_counts *counts);

/* ------------------------------------------------------ whoever lends: worker.c */

struct lease;
/* What a worker goes on from, `checkpoint` or else `begun` (see bcd_run_continue), and what the
 * chunk may take before it counts as failed; 0 = without limit. */
struct lease_terms {
    struct blob checkpoint, begun;
    double core_seconds_max, bytes_max;
};
/* Offers a chunk. Takes the blobs over. The task is borrowed until lease_end. NULL = no memory. */
struct lease *lease_offer(struct leases *leases, const struct task *task,
                          struct lease_terms *terms);

/* Waits at most `wait_ms` for something to happen, and gives what did. Blobs are the caller's. */
struct lease_news {
    bool returned; /* `tally` is there */
    bool failed;   /* the run failed: `error`, all of it in its text */
    struct blob tally;
    struct blob checkpoint; /* a newer one, or empty */
    double core_seconds;    /* used since the last time */
    struct bcd_error error;
};
void lease_wait(struct lease *lease, int64_t wait_ms, struct lease_news *news);
/* Whether another chunk may be offered; waits at most `wait_ms` for it. */
bool leases_room(struct leases *leases, int64_t wait_ms);
/* The end is near: all who wait in lease_wait or leases_room look up. */
void leases_wake(struct leases *leases);
/* Takes the offer back; whoever has it is told at the next heartbeat. */
void lease_end(struct lease *lease);

/* -------------------------------------------------- whoever runs: handle_leases.c */

/* Who asks: by whose token, and what it calls itself. What is lent to one owner's workers another's
 * cannot speak for. */
struct lease_asker {
    const char *owner, *worker;
};
/* STORE_NOT_FOUND = there is nothing to do; STORE_BROKEN = no memory. */
enum store_status leases_take(struct leases *leases, const struct lease_asker *asker,
                              struct lease_loan *loan);

enum lease_answer {
    LEASE_GO_ON,   /* heard; of a return: taken */
    LEASE_STOP,    /* cancelled, or another worker has it */
    LEASE_UNKNOWN, /* no such chunk is lent: ended, or the daemon has just started */
    LEASE_AGAIN,   /* it had been returned before, with the same bits */
    LEASE_DIFFERS, /* the same with other bits */
    LEASE_REFUSED, /* not this chunk's tally */
};
enum lease_answer leases_hear(struct leases *leases, const struct lease_word *word);
/* Whether it is still that worker's, and wanted: nothing is heard of it by that. */
enum lease_answer leases_look(struct leases *leases, const struct lease_word *word);
enum lease_answer leases_return(struct leases *leases, const struct lease_word *word);

#endif
