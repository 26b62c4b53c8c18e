/* SPDX-License-Identifier: GPL-3.0-or-later
 * equilibrium.h - a plan as the exact theory sees it. */
#ifndef EQUILIBRIUM_H
#define EQUILIBRIUM_H

#include "plan.h"
#include "theory/theory.h"

/* Why rods of this plan have no equilibrium that theory knows; NULL = they have. */
const char *equilibrium_missing(const struct plan *plan);

/* The system theory solves; borrows from the plan. Only when there is an equilibrium. */
struct theory_system equilibrium_system(const struct plan *plan);

#endif
