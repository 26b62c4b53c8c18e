/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * target.h - the job's "target": how well one observable is to be known, and what that may cost.
 * Realizations are added up to milestones that depend on the job alone; at each of them
 * bcd_tally_judge looks at what there is.
 */
#ifndef TARGET_H
#define TARGET_H

#include "part.h"
#include "scene.h"

/* The slot's only part. */
extern const struct part_type target_type;

/* Before anything is planned: the number of realizations that a target which gives none means. */
void target_complete(struct bcd_scene *scene, struct bcd_errors *errors);

/* When steps and pairs are planned: lowers plan.realizations to what the target may cost. */
void target_limit(struct bcd_scene *scene, struct bcd_errors *errors);

#endif
