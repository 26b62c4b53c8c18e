/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * slurm.h - workers started as jobs of Slurm: as many pilots as there are chunks for them, within
 * what the configuration says. A pilot is one task of an array that runs `bcd worker` and ends when
 * there is nothing to do; which chunk it gets is lease.h's business, and whether it lives shows in
 * heartbeats. Slurm is only asked how many there are, so that its silence fails nothing: as long as
 * it does not answer, no more pilots are asked for.
 *
 * The file: lines "key = value", # before comments; deploy/slurm.conf.example has all of them.
 *
 * THREADS  One of its own, which runs sbatch, squeue and scontrol, each with a time limit.
 */
#ifndef SLURM_H
#define SLURM_H

#include "lease.h"

struct slurm;

/* url: where pilots find the daemon unless the file says otherwise. NULL with words in reason when
 * the file is wrong. */
struct slurm *slurm_start(const char *file, struct leases *leases, const char *url, char *reason,
                          size_t size);

/* Pilots stay: they wait for the next daemon, and end by themselves. Accepts NULL. */
void slurm_stop(struct slurm *slurm);

#endif
