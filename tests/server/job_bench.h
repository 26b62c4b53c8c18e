/* SPDX-License-Identifier: GPL-3.0-or-later
 * job_bench.h - jobs as a handler would submit them, for the tests of queue and worker. */
#ifndef JOB_BENCH_H
#define JOB_BENCH_H

#include "store_bench.h"

#include "queue.h"

/* A job of `chunks` chunks of one realization each, about 25000 steps of 100 rods long; jobs with
 * different seeds are different. Driven, so that no exact theory (slow) is looked for. Owned by the
 * caller. */
struct bcd_scene *job_bench_scene(int chunks, int seed);

/* A job of rings so small that up to 8 chunks, of one realization each, go together. */
struct bcd_scene *job_bench_small_rings(int chunks);

/* Keeps the scene's job in the store, where it must be new, and hands it to the queue. The scene is
 * taken; queue may be NULL. */
void job_bench_submit(struct store *store, struct queue *queue, struct bcd_scene *scene,
                      char id[JOB_ID_SIZE]);

/* The same for an owner and a priority. */
void job_bench_submit_as(struct store *store, struct queue *queue, struct bcd_scene *scene,
                         const struct ticket *ticket, char id[JOB_ID_SIZE]);

/* Waits until the job has ended and returns its state; fails the test after a minute or more. */
enum job_state job_bench_wait(struct store *store, const char *id);

/* Sleeps. */
void job_bench_nap(int ms);

/* While `none` is true no file of this process can grow: what a full disk looks like. */
void job_bench_disk(bool none);

#endif
