/* SPDX-License-Identifier: GPL-3.0-or-later
 * nominal.h - how long a scene's runs take, before they do. */
#ifndef NOMINAL_H
#define NOMINAL_H

#include "scene.h"

/* Core seconds of a nominal machine for so many steps of one rod, starts included. */
double nominal_seconds(const struct bcd_scene *scene, double rod_steps);

#endif
