/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * job_seeds.h - jobs that differ in their seed alone, made from the first of them. Nothing that the
 * completion of a scene finds out depends on the seed: it is one number in the text of the job and
 * in what is hashed, and the rest stays, byte for byte.
 */
#ifndef JOB_SEEDS_H
#define JOB_SEEDS_H

#include "bcd.h"
#include "store_jobs.h"

struct job_seeds;

/* `job` is what job_admit_fill made of the scene. NULL = no memory. */
struct job_seeds *job_seeds_create(const struct bcd_scene *scene, const struct job_new *job);
void job_seeds_free(struct job_seeds *seeds);

/* Could a job have this seed? */
bool job_seeds_fit(const struct job_seeds *seeds, int64_t seed);

/* What job_admit_fill would make of the scene with this seed, which fits; malloc'ed and refused as
 * there. */
bool job_seeds_fill(const struct job_seeds *seeds, int64_t seed, struct job_new *job);

#endif
