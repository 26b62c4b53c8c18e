/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sim.h - the rods in motion: what methods advance and observables look at.
 *
 * Reduced coordinates y[i] = x[i] - i * diameter, unwrapped, on a ring of length ell = L - N sigma:
 * y[0] <= y[1] <= ... <= y[N-1] <= y[0] + ell. Contact is bitwise equality of neighbours.
 */
#ifndef SIM_H
#define SIM_H

#include "arena.h"
#include "bcd.h"
#include "plan.h"
#include "kernels/normals.h"

#include <string.h>

struct sim_clock {
    int64_t tick;  /* steps since the initial configuration */
    int64_t turns; /* y was moved back by turns * L to keep its digits; x = y + i sigma + turns L */
};

struct sim {
    const struct plan *plan; /* the scene's, or in a second pass that of twice its time step */
    double *y;               /* [N], kept in checkpoints; room for arena_whole(N) */
    const double *seen;      /* [N], what static observables look at: y, or a method's view */
    struct sim_clock *clock; /* kept in checkpoints */
    void *work;              /* the method's scratch */
    struct noise_key noise;
};

/* Streams of the counter-based generator. */
enum {
    STREAM_STEPS = 0,
    STREAM_INITIAL = 1,
    STREAM_VIEW = 2,
    STREAM_FIRST_KICK = 3, /* lm: the noise before the first step */
    STREAM_ACCEPT = 4,     /* metropolis: which moves are accepted */
    STREAM_REDRAW = 5,     /* tao: noise drawn anew after a contact */
    STREAM_BONDS = 6,      /* strang_bonds: which bonds break and form, how fast they part */
};

static inline double sim_time(const struct sim *sim)
{
    return (double)sim->clock->tick * sim->plan->time_step;
}

/* Ticks since the measurement began; negative during equilibration. */
static inline int64_t sim_measured(const struct sim *sim)
{
    return sim->clock->tick - sim->plan->equilibration_steps;
}

/* A number for each rod, and how to copy them: with the room behind them (arena_whole). */
static inline double *sim_take_rods(const struct plan *plan, struct arena *arena)
{
    return arena_take(arena, (size_t)arena_whole(plan->particles) * sizeof(double));
}

static inline void sim_copy_rods(const struct plan *plan, double *to, const double *from)
{
    memcpy(to, from, (size_t)arena_whole(plan->particles) * sizeof *to);
}

void sim_layout(struct sim *sim, const struct plan *plan, struct arena *kept);

/* Places the rods for a realization and sets the clock to 0. Only an equilibrium draw can fail. */
enum bcd_status sim_begin(struct sim *sim, int64_t realization, struct bcd_error *error);

/* Moves all rods back by whole lengths L when they have drifted far: keeps the digits of y. */
void sim_recentre(struct sim *sim);

#endif
