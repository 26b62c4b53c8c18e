/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * slurm_pilots.h - what Slurm's answers say about pilots, and what of it is news: which of them
 * wait, run, hang or have ended, and how. squeue knows those that ended for some minutes; sacct,
 * where there is accounting, for good.
 *
 * THREADS  Belongs to one.
 */
#ifndef SLURM_PILOTS_H
#define SLURM_PILOTS_H

#include <stdbool.h>
#include <stddef.h>

enum { PILOT_ID_SIZE = 32, PILOTS_SOME_MAX = 64 };

/* Some of them; more are seen the next time. */
struct pilots_some {
    char id[PILOTS_SOME_MAX][PILOT_ID_SIZE];
    size_t count;
};

/* What one answer of squeue says. */
struct pilots_seen {
    long waiting, running;   /* for a place; at work */
    struct pilots_some held; /* could not be launched, and wait for ever */
    struct pilots_some late; /* lost their node, and wait until a certain time */
};

/* Ends that were not told before. */
struct pilots_ended {
    long well, badly;          /* badly: failed by themselves */
    char worst[PILOT_ID_SIZE]; /* one of these, */
    char state[PILOT_ID_SIZE]; /* and how it ended */
};

struct slurm_pilots;
struct slurm_pilots *slurm_pilots_create(void);
void slurm_pilots_free(struct slurm_pilots *pilots);

/* An array was submitted: `said` is what sbatch printed. False = that is no number of a job. */
bool slurm_pilots_submitted(struct slurm_pilots *pilots, const char *said, long tasks);

/* squeue --array --states=all --format="%i %T %r" said this; it is written to. */
void slurm_pilots_queue(struct slurm_pilots *pilots, char *said, struct pilots_seen *seen,
                        struct pilots_ended *ended);

/* The arrays ("12,15") with tasks that squeue does not know any more, but whose end was not told;
 * false = there are none. */
bool slurm_pilots_missing(const struct slurm_pilots *pilots, char *jobs, size_t size);
/* sacct --parsable2 --array --format=JobID,State of these. */
void slurm_pilots_accounted(struct slurm_pilots *pilots, char *said, struct pilots_ended *ended);
/* Nobody will ever know. */
void slurm_pilots_forget(struct slurm_pilots *pilots);

#endif
