/* SPDX-License-Identifier: GPL-3.0-or-later
 * parts.h - the lists of all parts: the one place that names them all. Lists end with NULL. */
#ifndef PARTS_H
#define PARTS_H

#include "part.h"

extern const struct method_type *const method_types[];
extern const struct potential_type *const potential_types[];
extern const struct pair_type *const pair_types[];
extern const struct observable_type *const observable_types[];

#endif
