/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * plan.h - a scene in numbers, as runs use it: everything chosen and converted once, read-only
 * afterwards. Lengths, times and energies in the user's units; ticks are time steps.
 */
#ifndef PLAN_H
#define PLAN_H

#include <stdbool.h>
#include <stdint.h>

struct potential_type;
struct pair_type;
struct method_type;

struct theory_sampler;

enum { INITIAL_UNIFORM, INITIAL_LATTICE, INITIAL_EQUILIBRIUM };

struct plan {
    int64_t particles;
    double length, diameter, free_length; /* L, sigma, ell = L - N sigma */
    bool walls; /* rods stay in [0, L] instead of on a ring */
    double low; /* least y: 0 on a ring (any turn of it), diameter / 2 at a wall */
    double mobility, temperature, diffusion, force;
    int64_t initial;
    struct theory_sampler *sampler; /* of INITIAL_EQUILIBRIUM, once prepared; the scene's */
    uint64_t seed;

    const struct potential_type *potential; /* NULL = none */
    const void *potential_par;
    bool field;    /* the potential acts: it is there and not flat */
    double slope;   /* largest force of field and drag */
    double press;   /* largest force of both against a wall */
    double barrier; /* highest minus lowest energy */
    double period;   /* of profiles along x: the potential's, or L; L between walls */
    int64_t periods; /* L / period */

    const struct pair_type *pair; /* NULL = none, or it exerts no force */
    const void *pair_par;
    double stiffness; /* of it, as its slot says; 0 without */

    double tolerance;                        /* relative error that auto choices aim at */
    bool asks_dynamics, asks_contact_forces; /* some observable does */
    bool looks_inside; /* some observable looks at points within a step */

    const struct method_type *method;
    double time_step;
    int64_t equilibration_steps, steps, sample_steps;
    double sample_ns; /* rough cost of one look of all static observables at one rod */

    int64_t realizations, per_chunk, chunks;
    int64_t blocks; /* a run's samples: 1, or more when there is but one realization */

    /* The error of the time step: `paired` of the realizations (plan_is_paired) are run once more
     * with steps of twice the length on the same noise, by a plan of their own. 0 = none, no_pair
     * says why. */
    int64_t paired;
    const char *no_pair;
    const struct plan *fine; /* of that second plan: the first one; of the first: itself */
};

/* Ticks of the fine plan that one of this plan's is long. */
static inline int64_t plan_ticks_per_step(const struct plan *plan)
{
    return plan->fine == plan ? 1 : 2;
}

/* Whether realization i is one of the pairs: the first two, then every fourth from the ninth on. A
 * matter of its number alone, so that what fewer realizations measure is how more of them begin. */
static inline bool plan_is_paired(const struct plan *plan, int64_t i)
{
    return plan->paired > 0 && (i < 2 || (i >= 8 && i % 4 == 0));
}

/* First tick after block b (0 <= b < blocks), counted from the start of the measurement. */
static inline int64_t plan_block_end(const struct plan *plan, int64_t b)
{
    int64_t whole = plan->steps / plan->blocks, rest = plan->steps % plan->blocks;
    return whole * (b + 1) + rest * (b + 1) / plan->blocks;
}

#endif
