/* SPDX-License-Identifier: GPL-3.0-or-later
 * pair_force.c - the force of a scene's interaction on one pair of rods (bcd.h). */
#include "part.h"
#include "scene.h"

double bcd_scene_pair_force(const struct bcd_scene *scene, double gap)
{
    const struct plan *plan = &scene->plan;
    const double y[2] = {0, gap};
    double force[2] = {0, 0};
    struct ring pair = {.y = y,
                        .count = 2,
                        .free_length = gap,
                        .diameter = plan->diameter,
                        .temperature = plan->temperature,
                        .walls = true}; /* no second contact round the ring */
    if (plan->pair)
        plan->pair->add_force(plan->pair_par, &pair, 1, force);
    return force[1];
}
