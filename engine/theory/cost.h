/* SPDX-License-Identifier: GPL-3.0-or-later
 * cost.h - what the theory will take, before it is computed. */
#ifndef THEORY_COST_H
#define THEORY_COST_H

#include "theory.h"

/* Nominal core seconds, as a watch counts them; bytes at their most. What is refused after a look
 * costs nothing. */
struct theory_cost {
    double seconds, bytes;
};

/* Of theory_canonical and theory_infinite. Takes some ten microseconds; evaluates no energy. A
 * guess, for what decides is how fine a grid the answer turns out to need: right within a factor 2
 * for smooth potentials as a rule. */
struct theory_cost theory_cost_canonical(const struct theory_system *system,
                                         const struct theory_wanted *wanted);
struct theory_cost theory_cost_infinite(const struct theory_system *system,
                                        const struct theory_wanted *wanted);

/* Of theory_sampler_create, and of one draw. */
struct theory_cost theory_cost_sampler(const struct theory_system *system);
struct theory_cost theory_cost_draw(const struct theory_system *system);

#endif
