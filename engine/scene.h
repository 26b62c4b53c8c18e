/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * scene.h - what a struct bcd_scene holds, for the files above the parts: scene.c fills in the job,
 * plan.c makes the plan and the facts of it.
 */
#ifndef SCENE_H
#define SCENE_H

#include "bcd.h"
#include "parts.h"
#include "plan.h"

enum { BOUNDARY_PERIODIC, BOUNDARY_WALLS };
enum { STABILITY_REQUIRED, STABILITY_IGNORED };
enum { STEP_ERROR_ESTIMATED, STEP_ERROR_SKIPPED };

/* The job's own parameters, as the rows of scene.c describe them. */
struct job_par {
    int64_t model, boundary, method, initial, stability, step_error; /* indices of choices */
    int64_t particles, realizations, seed;
    double length, diameter, mobility, temperature, force;
    double tolerance;
    double time_step, equilibration_time, time, sample_every; /* NaN = auto where allowed */
};

enum { SCENE_PARTS_MAX = 16, SCENE_FACTS_MAX = 32 };

struct scene_part {
    enum bcd_slot slot;
    int64_t index; /* within the slot's list of types */
    struct bcd_group group;
    struct shared_part *shared; /* whose values they are; NULL = this scene's own */
};

struct bcd_scene {
    struct job_par job;
    struct bcd_group group; /* rows over job */
    struct scene_part parts[SCENE_PARTS_MAX]; /* by slot, then by index: the catalogue's order */
    size_t part_count;
    bool complete;
    struct plan plan, coarse; /* coarse: twice the time step, of paired realizations */
    const char *time_step_why;
    char unstable[160]; /* why the time step would be refused, had it not been asked for */
    struct bcd_fact facts[SCENE_FACTS_MAX];
    size_t fact_count;
};

/* The plan of a scene whose single fields are right; faults that only the whole can show. cache may
 * be NULL. */
void plan_make(struct bcd_scene *scene, struct bcd_scene_cache *cache, struct bcd_errors *errors);

/* What runs need beyond the plan: the sampler of equilibrium starts. */
enum bcd_status plan_prepare(struct bcd_scene *scene, struct bcd_watch *watch,
                             struct bcd_errors *errors);
void plan_list_facts(struct bcd_scene *scene);

/* The observables of a scene, in order; NULL past the last. */
const struct scene_part *scene_observable(const struct bcd_scene *scene, size_t index);
static inline const struct observable_type *scene_observable_type(const struct scene_part *part)
{
    return observable_types[part->index];
}

/* What checkpoints of this scene belong to; and its tallies, which belong to all jobs that differ
 * in the number of realizations alone (bcd_scene_encode_family). */
uint64_t scene_identity(const struct bcd_scene *scene);
uint64_t scene_family(const struct bcd_scene *scene);

#endif
