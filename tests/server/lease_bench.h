/* SPDX-License-Identifier: GPL-3.0-or-later
 * lease_bench.h - a job in the hands of nobody but a test, to be lent to workers. */
#ifndef LEASE_BENCH_H
#define LEASE_BENCH_H

#include "lease.h"

/* A job of two chunks, both in this thread's hands. */
struct lease_bench {
    struct leases *leases;
    struct bcd_scene *scene;
    atomic_bool cancelled;
    _Atomic int64_t done[2], total[2];
    struct task task[2];
    struct lease *lease[2];
};

void lease_bench_start(struct lease_bench *bench, int64_t lease_ms);
void lease_bench_stop(struct lease_bench *bench);

/* The chunk as a worker would run it; the caller's. */
struct blob lease_bench_tally(const struct bcd_scene *scene, int64_t chunk);

#endif
