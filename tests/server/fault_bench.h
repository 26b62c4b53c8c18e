/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * fault_bench.h - a small day in a store's life, in which something fails at the k-th call: the
 * power, the disk, its room, SQLite's memory. Each function does it for every stride-th k up to the
 * first that comes no more, and fails the test when anything acknowledged is not there afterwards,
 * when a failed step does not work after the fault is gone, or when the database is not whole. They
 * return how many k there were. stride 1 = every k.
 */
#ifndef FAULT_BENCH_H
#define FAULT_BENCH_H

#include "power_vfs.h"
#include "store_bench.h"

/* First thing in main: SQLite's memory and files are the bench's from here on. */
void fault_bench_begin(void);

/* An open store without faults: how many of its connections wrote or checkpointed. */
int fault_writers(struct bench *bench);

int fault_power_cuts(struct bench *bench, int stride);
/* The same while the database is made, migration by migration. */
int fault_power_cuts_at_start(struct bench *bench, int stride);
int fault_disk(struct bench *bench, enum power_fault fault, int stride);
int fault_memory(struct bench *bench, int stride);

#endif
