/* SPDX-License-Identifier: GPL-3.0-or-later
 * plant.h - a store with queue and workers: what a daemon is without HTTP. For the tests of
 * workers.
 */
#ifndef PLANT_H
#define PLANT_H

#include "job_bench.h"

#include "worker.h"

struct plant {
    struct bench *bench;
    struct queue *queue;
    struct workers *workers;
};
struct plant plant_start(struct bench *bench, size_t workers);
/* The same under other limits of jobs than the usual. */
struct plant plant_start_within(struct bench *bench, size_t workers,
                                const struct job_limits *limits);
void plant_stop(struct plant *plant);

/* Until it has started; until the job is that far, or gone from the queue. */
void plant_wait_start(struct plant *plant, const char *id);
void plant_wait_progress(struct plant *plant, const char *id, double wanted);

/* Every table of the job in the store is, byte for byte, that of a run in this thread alone, cut
 * into slices of another length. Takes the scene, of three observables. */
void plant_assert_same_bytes(struct store *store, const char *id, struct bcd_scene *scene);

#endif
