/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * slurm.h - workers started as jobs of Slurm: as many pilots as there are chunks for them, within
 * what the configuration says. A pilot is one task of an array that runs `bcd worker` and ends when
 * there is nothing to do; which chunk it gets is lease.h's business, and whether it lives shows in
 * heartbeats. Slurm is only asked how many there are, so that its silence fails nothing: as long as
 * it does not answer, no more pilots are asked for. Where pilots fail as they start, more are asked
 * for ever more slowly.
 *
 * The file: lines "key = value", # before comments; deploy/slurm.conf.example has all of them.
 *
 * THREADS  One of its own, which runs sbatch, squeue, sacct, scancel and scontrol, each with a time
 *          limit.
 */
#ifndef SLURM_H
#define SLURM_H

#include "lease.h"

struct slurm;

/* How pilots reach the daemon. */
struct slurm_way {
    const char *url;   /* unless the file says otherwise */
    const char *share; /* a directory instead (share.h), or NULL */
    size_t chunks;     /* that the daemon can lend at a time */
};

/* NULL with words in reason when the file is wrong. */
struct slurm *slurm_start(const char *file, struct leases *leases, const struct slurm_way *way,
                          char *reason, size_t size);

/* Pilots stay: they wait for the next daemon, and end by themselves. Accepts NULL. */
void slurm_stop(struct slurm *slurm);

/* For /metrics; of any thread. */
struct slurm_counts {
    long waiting, running;  /* pilots at the last look */
    long submitted, failed; /* since the start; failed: ended badly by themselves */
    bool answers;           /* the last command went well */
};
void slurm_count(struct slurm *slurm, struct slurm_counts *counts);

#endif
